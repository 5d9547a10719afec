#include "app/format/format.hpp"

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"

namespace dqw {

Expression Import::field(std::string_view name) const
{
    const std::size_t f = head.find(name);
    if (f == Head::none) throw InputError(head.path, head.line, "no column " + shown(name));
    return field(f);
}

bool Import::take(Column column, std::string_view field, std::string_view unit)
{
    return take(column, head.find(field), unit);
}

bool Import::take(Column column, std::size_t f, std::string_view unit)
{
    if (f >= head.fields.size()) return false;
    take(column, field(f), unit);
    return true;
}

void Import::take(Column column, const Expression& x, std::string_view unit)
{
    Source source;
    source.unit = unit;
    source.expression = in_si(column, x, unit, given, v_dc(), source.needs);
    columns[column] = source;
}

void Import::take_si(Column column, const Expression& x)
{
    columns[column] = Source();
    columns[column]->expression = x;
}

std::optional<Expression> Import::v_dc() const
{
    if (known(col_v_dc)) return columns[col_v_dc]->expression;
    if (given.v_dc_V) return constant(*given.v_dc_V);
    return {};
}

void Import::take_park(Column d, Column q, const TwoAxes& stationary)
{
    if (!columns[col_theta_e]) return;
    const Source& angle = *columns[col_theta_e];
    const TwoAxes turned = park(stationary, angle.expression);
    take_si(d, turned.first);
    take_si(q, turned.second);
    columns[d]->needs = columns[q]->needs = angle.needs;
}

void Import::take_duty(const Expression& duty)
{
    const auto link = v_dc();
    take_si(col_v_q, duty);
    if (!link)
        columns[col_v_q]->needs = {"v_dc"};
    else
        take_si(col_v_q, voltage_of_duty(duty, *link, known(col_v_d) ? &columns[col_v_d]->expression : nullptr));
    voltage_is_size = link && !known(col_v_d);
}

void Import::drop(std::string_view name, bool (*is_none)(double), const std::string& why)
{
    const std::size_t f = head.find(name);
    if (f != Head::none) rules.push_back({field(f), is_none, why});
}

void Import::insert_fields(std::size_t at, std::size_t count, const std::string& name)
{
    head.fields.insert(head.fields.begin() + static_cast<std::ptrdiff_t>(at), count, name);
}

ColumnSet Import::has() const
{
    ColumnSet set = {};
    for (std::size_t c = 0; c < column_count; ++c) set[c] = known(static_cast<Column>(c));
    return set;
}

bool is_zero(double value) { return value == 0.0; }
bool is_not_zero(double value) { return value != 0.0; }

}  // namespace dqw
