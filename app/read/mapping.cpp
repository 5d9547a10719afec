#include "app/read/mapping.hpp"

#include <fmt/format.h>

#include <cctype>
#include <stdexcept>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"

namespace dqw {
namespace {

constexpr std::size_t none = Head::none;

/// The field of exactly this name; a name that is there twice is refused.
std::size_t field_named(const Head& head, const std::string& name)
{
    std::size_t found = none;
    for (std::size_t f = 0; f < head.fields.size(); ++f) {
        if (head.fields[f] != name) continue;
        if (found != none)
            throw InputError(head.path, head.line,
                             fmt::format("column {} is there twice (fields {} and {}); expected once", shown(name),
                                         found + 1, f + 1));
        found = f;
    }
    return found;
}

Expression linear(const Import& in, std::size_t f, const ColumnSource& source)
{
    Expression x = in.field(f);
    if (source.scale != 1.0 || source.offset != 0.0)
        x = scaled(x, source.scale,
                   (source.scale != 1.0 ? fmt::format(" · {:g}", source.scale) : "") +
                       (source.offset != 0.0 ? fmt::format(" + {:g}", source.offset) : ""),
                   source.offset);
    return x;
}

/// The field that the machine file names; throws InputError where the log has none of that name.
std::size_t field_asked(const Import& in, const std::string& name, const std::string& machine_path, std::size_t line)
{
    const std::size_t f = field_named(in.head, name);
    if (f != none) return f;
    throw InputError(
        machine_path, line,
        fmt::format("{} has no column {}, but {}", in.head.path, shown(name), list(shown_all(in.head.fields))));
}

/// What a log may lack: a machine file for several logs may name it.
bool may_lack(Column column)
{
    switch (column) {
    case col_t:
    case col_v_d:
    case col_v_q:
    case col_i_d:
    case col_i_q:
    case col_w_m: return false;
    default: return true;
    }
}

void take_named(Import& in, Column column, const ColumnSource& source, const std::string& machine_path)
{
    in.columns[column].reset();
    if (source.value) return in.take_si(column, constant(*source.value));
    if (may_lack(column) && field_named(in.head, source.name) == none)
        return in.notes.push_back(fmt::format("{}:{}: no column {}: {} is left out", machine_path, source.line,
                                              shown(source.name), columns[column].name));
    const std::size_t f = field_asked(in, source.name, machine_path, source.line);
    Expression x = linear(in, f, source);
    if (!source.times.empty()) {
        const std::size_t factor = field_asked(in, source.times, machine_path, source.line);
        x = combined(
            {x, in.field(factor)}, [](const double* v) { return v[0] * v[1]; }, x.text + " · " + source.times);
    }
    if (source.unit == "duty") return in.take_duty(x);
    in.take(column, x, source.unit.empty() ? unit_names(column).front() : source.unit);
}

void take_frame(Import& in, Column d, Column q, const FrameSource& source)
{
    if (source.line == 0) return;
    std::vector<Expression> parts;
    Source scratch;
    for (const std::string& name : source.names) {
        const std::size_t f = field_named(in.head, name);
        if (f == none)
            throw InputError(in.head.path, in.head.line,
                             fmt::format("no column {}, which [columns] of the machine file makes {} of", shown(name),
                                         columns[d].name));
        ColumnSource one;
        one.scale = source.scale;
        parts.push_back(in_si(d, linear(in, f, one), source.unit.empty() ? unit_names(d).front() : source.unit,
                              in.given, in.v_dc(), scratch.needs));
    }
    if (!in.columns[col_theta_e])
        throw InputError(in.head.path, in.head.line,
                         "no theta_e_rad, which d and q of phases need; name it under [columns] of the machine file");
    if (source.kind == "alpha_beta")
        in.take_park(d, q, {parts[0], parts[1]});
    else
        in.take_park(d, q, source.kind == "line" ? clarke_of_lines(parts) : clarke_of_phases(parts));
    for (const Column c : {d, q})
        in.columns[c]->needs.insert(in.columns[c]->needs.end(), scratch.needs.begin(), scratch.needs.end());
}

/// RMS values that nobody says are any: they are read as peaks, too small by √2 or, between lines, too large by √3/√2.
void note_rms(Import& in, Column column, const ColumnSource& source)
{
    if (!in.columns[column] || source.value || source.scale != 1.0 || source.unit.find("RMS") != none) return;
    const bool volts = column == col_v_d || column == col_v_q;
    std::string name = source.name;
    for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (name.find("rms") == none && !(volts && in.voltage.rfind("RMS", 0) == 0)) return;
    in.notes.push_back(fmt::format("{} of {} is taken as a peak, and it {} RMS: {}", columns[column].name,
                                   shown(source.name), name.find("rms") == none ? "is" : "is called",
                                   volts ? "unit = \"V RMS\" of a phase, \"V RMS line\" between lines"
                                         : "unit = \"A RMS\" of a phase"));
}

bool maps_columns(const MachineFile& machine)
{
    for (const ColumnSource& source : machine.sources)
        if (source.line) return true;
    return machine.i_dq.line || machine.v_dq.line;
}

/// What a column's name says before its unit: i_d of i_d_A, w_m of w_m_rad_s.
std::string stem_of(const ColumnInfo& column)
{
    const std::string name = column.name;
    const std::size_t slow = name.rfind("_rad_s");
    return name.substr(0, slow == name.npos ? name.rfind('_') : slow);
}

/// Columns that have dqwatch's names but for the unit: read in theirs. With one without a unit that every log of its
/// kind needs there is no log: without it, it would be taken for another kind.
void take_other_units(Import& in, const MachineFile& machine)
{
    std::vector<std::string> bare, own;
    for (const ColumnInfo& column : columns) {
        if (in.columns[column.id] || machine.sources[column.id].line) continue;
        if (column.id == col_t && in.given.period_s) continue;
        const std::string stem = stem_of(column);
        std::vector<std::size_t> found;
        std::string unit;
        for (std::size_t f = 0; f < in.head.fields.size(); ++f) {
            const std::string& field = in.head.fields[f];
            const std::string below = f < in.head.units.size() ? in.head.units[f] : "";
            const std::string says = field == stem                     ? below
                                     : field.rfind(stem + "_", 0) == 0 ? field.substr(stem.size() + 1)
                                                                       : "";
            if (field == stem && says.empty() && !may_lack(column.id) && !maps_columns(machine))
                bare.push_back(shown(field)), own.push_back(fmt::format("{} = \"{}\"", column.name, stem));
            if (says.empty() || !is_unit(column.id, says)) continue;
            found.push_back(f), unit = says;
        }
        if (found.size() > 1)
            throw InputError(in.head.path, in.head.line,
                             fmt::format("{} and {} both stand for {}; name one of them otherwise",
                                         shown(in.head.fields[found[0]]), shown(in.head.fields[found[1]]),
                                         column.name));
        if (found.empty()) continue;
        in.take(column.id, found.front(), unit);
        in.notes.push_back(
            fmt::format("{} is read from {}, in {}", column.name, shown(in.head.fields[found.front()]), unit));
    }
    if (!bare.empty())
        in.no_log = fmt::format("column{} {} say{} no unit: under [columns] of the machine file {}",
                                bare.size() == 1 ? "" : "s", list(bare), bare.size() == 1 ? "s" : "", list(own));
}

/// A line of units below the header, where its names are dqwatch's.
void take_units(Import& in)
{
    for (const ColumnInfo& column : columns) {
        const std::size_t f = field_named(in.head, column.name);
        if (f < in.head.units.size() && in.columns[column.id] && is_unit(column.id, in.head.units[f]))
            in.take(column.id, f, in.head.units[f]);
    }
}

}  // namespace

const Format& format_for(const Head& head, const Format* json, const std::string& name, const MachineFile& machine)
{
    if (!name.empty()) {
        const Format& format = format_named(name);
        require_marks(format, head);
        return format;
    }
    if (json) return *json;
    try {
        return format_of(head);
    } catch (const InputError&) {
        if (!maps_columns(machine)) throw;
        return plain;
    }
}

void map_columns(Import& in, const Format& format, const MachineFile& machine)
{
    format.describe(in);
    if (&format == &plain) {
        for (const ColumnInfo& column : columns) field_named(in.head, column.name);
        take_units(in);
        take_other_units(in, machine);
        in.gaps = maps_columns(machine);
    }
    // What others are made of first: the link, the angle, v_d beside which a duty leaves v_q.
    for (const Column c : {col_v_dc, col_theta_e, col_v_d})
        if (machine.sources[c].line) take_named(in, c, machine.sources[c], machine.path);
    for (const ColumnInfo& column : columns) {
        const bool done = column.id == col_v_dc || column.id == col_theta_e || column.id == col_v_d;
        if (!done && machine.sources[column.id].line)
            take_named(in, column.id, machine.sources[column.id], machine.path);
    }
    for (const Column c : {col_v_d, col_v_q, col_i_d, col_i_q})
        if (machine.sources[c].line) note_rms(in, c, machine.sources[c]);
    take_frame(in, col_i_d, col_i_q, machine.i_dq);
    take_frame(in, col_v_d, col_v_q, machine.v_dq);
    if (!in.columns[col_v_dc] && in.given.v_dc_V) in.take_si(col_v_dc, constant(*in.given.v_dc_V));
    if (in.even && &format == &plain && in.columns[col_t]) {
        in.notes.push_back(fmt::format("rows are taken {:g} s apart, whatever {} says", *in.given.period_s,
                                       in.columns[col_t]->expression.text));
        in.columns[col_t].reset();
    }
    if (!in.columns[col_t] && !in.row_period_s) in.row_period_s = in.given.period_s;
    if (in.row_period_s && !in.columns[col_t]) {
        in.take_si(col_t, constant(0.0));
        in.columns[col_t]->expression.text = fmt::format("row · {:g} s", *in.row_period_s);
    } else {
        in.row_period_s.reset();
    }
    if (in.speed_from_angle && in.columns[col_theta_e] && in.columns[col_t] && !machine.sources[col_w_m].line) {
        in.take_si(col_w_m, constant(0.0));
        Source& speed = *in.columns[col_w_m];
        speed.needs = in.columns[col_theta_e]->needs;
        speed.expression.text = "slope of theta_e_rad over p";
        if (!in.given.pole_pairs) speed.needs.emplace_back("pole pairs");
    } else {
        in.speed_from_angle = false;
    }
}

std::vector<std::string> unused_fields(const Import& in)
{
    std::vector<bool> used(in.head.fields.size(), false);
    if (in.counter) used[*in.counter] = true;
    for (const auto& source : in.columns)
        if (source)
            for (const std::size_t f : source->expression.fields) used[f] = true;
    std::vector<std::string> unused;
    for (std::size_t f = 0; f < used.size(); ++f)
        if (!used[f]) unused.push_back(in.head.fields[f].empty() ? "(nameless)" : in.head.fields[f]);
    return shown_all(unused);
}

std::vector<std::string> shown_all(const std::vector<std::string>& names)
{
    std::vector<std::string> out;
    for (const auto& name : names) {
        // shown() minus its quotes: names of a healthy header read better bare.
        const std::string text = shown(name);
        out.push_back(text.substr(1, text.size() - 2));
    }
    return out;
}

}  // namespace dqw
