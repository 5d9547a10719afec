#include "app/report/compare.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/base/columns.hpp"
#include "app/base/parameters.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/page/html.hpp"
#include "app/page/page.hpp"
#include "app/report/compare_plots.hpp"
#include "app/report/report.hpp"

namespace dqw {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kFullScale = 32768.0;
/// Decimal places of a percentage.
constexpr int kPlaces = 4;

const Estimate* find(const Result& result, const std::string& name) { return find_estimate(result.parameters, name); }

std::string signed_number(double x, int places)
{
    const std::string text = fmt::format("{:+.{}f}", x, places);
    // No sign of nothing.
    return text.find_first_of("123456789") == std::string::npos ? text.substr(1) : text;
}

std::string percent(const Result& first, const Result& second, const std::string& name)
{
    const auto d = difference_percent(first, second, name);
    return d ? signed_number(*d, kPlaces) : "–";
}

/// Q15 less float, in parts of 1/32768 of the parameter's unit.
std::string last_places(const Comparison& c, const std::string& name)
{
    const auto& all = compared_parameters(c.reference.regime);
    const auto at = std::find_if(all.begin(), all.end(), [&](const Compared& p) { return p.name == name; });
    const Estimate *a = find(c.fixed, name), *b = find(c.single, name);
    if (at == all.end() || a == nullptr || b == nullptr) return "–";
    return signed_number((a->value - b->value) / c.unit[static_cast<std::size_t>(at - all.begin())] * kFullScale, 2);
}

/// Every parameter that one of the three may have, the effects' behind the machine's.
std::vector<std::string> names_in(const Comparison& c)
{
    std::vector<std::string> out = known_parameters();
    for (const auto& [who, result] : estimates_of(c))
        for (const Estimate& e : result->parameters)
            if (std::find(out.begin(), out.end(), e.name) == out.end()) out.push_back(e.name);
    return out;
}

/// Heading first.
std::vector<std::vector<std::string>> table_rows(const Comparison& c)
{
    std::vector<std::vector<std::string>> rows = {{"parameter", "unit", "reference", "float", "Q15",
                                                   "float−reference %", "Q15−float %", "Q15−reference %",
                                                   "Q15−float LSB"}};
    for (const std::string& name : names_in(c)) {
        const Estimate* const three[] = {find(c.reference, name), find(c.single, name), find(c.fixed, name)};
        const auto first = std::find_if(std::begin(three), std::end(three),
                                        [](const Estimate* e) { return e != nullptr; });
        if (first == std::end(three)) continue;
        const Quantity q = quantity(name, (*first)->value, 0.0, 6);
        std::vector<std::string> row = {name, q.unit};
        for (const Estimate* e : three)
            row.push_back(e == nullptr           ? "–"
                          : name == "pole_pairs" ? fmt::format("{:g}", e->value)
                                                 : number_like(q, name, e->value, 6));
        for (const auto& [a, b] :
             {std::pair(&c.single, &c.reference), std::pair(&c.fixed, &c.single), std::pair(&c.fixed, &c.reference)})
            row.push_back(percent(*a, *b, name));
        row.push_back(last_places(c, name));
        rows.push_back(row);
    }
    return rows;
}

std::string about_last_places(const Comparison& c)
{
    const Regime regime = c.reference.regime;
    const auto& all = compared_parameters(regime);
    std::string units, symbols;
    for (std::size_t k = 0; k < all.size(); ++k) {
        const Quantity q = quantity(all[k].name, c.unit[k], 0.0);
        units += fmt::format("{}{} {}", k ? ", " : "", q.value, q.unit);
        symbols += (k ? ", " : "") + std::string(all[k].symbol);
    }
    const bool timed = regime == Regime::dynamic || regime == Regime::mechanical;
    return "1 LSB is 1/32768 of " + units + ": the unit that the full scales make of " + symbols +
           (timed ? "" : ", with 1 µs as the period of settled rows");
}

std::vector<std::string> missing(const Comparison& c)
{
    std::vector<std::string> out;
    for (const auto& [who, result] : estimates_of(c))
        for (const NotIdentifiable& n : result->not_identifiable)
            out.push_back(fmt::format("{}, {}: {}{}", n.name, who, n.why,
                                      n.excitation.empty() ? "" : "; what would help: " + n.excitation));
    return out;
}

Json differences(const Result& first, const Result& second)
{
    Json out = Json::object();
    for (const Estimate& e : first.parameters)
        if (const auto d = difference_percent(first, second, e.name)) out[e.name] = *d;
    return out;
}

/// The parameter on which two results differ most, in percent; none: a null name.
std::pair<const char*, double> worst(const Result& first, const Result& second)
{
    std::pair<const char*, double> out{nullptr, 0.0};
    for (const auto& [name, symbol] : compared_parameters(first.regime))
        if (const auto d = difference_percent(first, second, name))
            if (out.first == nullptr || std::fabs(*d) > std::fabs(out.second)) out = {name, *d};
    return out;
}

std::string apart(const char* what, const std::pair<const char*, double>& w)
{
    return w.first == nullptr ? fmt::format("{} have no parameter in common", what)
                              : fmt::format("{} differ by {:.2g} % at most ({})", what, std::fabs(w.second), w.first);
}

}  // namespace

const std::vector<Compared>& compared_parameters(Regime regime)
{
    static const std::vector<Compared> electrical = {
        {"R_ohm", "R"}, {"Ld_H", "L_d"}, {"Lq_H", "L_q"}, {"psi_Wb", "psi"}};
    static const std::vector<Compared> mechanical = {{"J_kgm2", "J"}, {"B_Nms_rad", "B"}};
    return regime == Regime::mechanical ? mechanical : electrical;
}

std::array<NamedResult, 3> estimates_of(const Comparison& c)
{
    return {{{"reference", &c.reference}, {"float", &c.single}, {"Q15", &c.fixed}}};
}

std::optional<double> difference_percent(const Result& first, const Result& second, const std::string& parameter)
{
    const Estimate *a = find(first, parameter), *b = find(second, parameter);
    if (a == nullptr || b == nullptr || b->value == 0.0) return {};
    return 100.0 * (a->value - b->value) / b->value;
}

std::vector<std::string> disagreements(const std::vector<Estimate>& first, const std::string& who,
                                       const std::vector<Estimate>& second, const std::string& other)
{
    constexpr double kDeviations = 3.0, kPart = 0.01;
    std::vector<std::string> out;
    for (const Estimate& a : first) {
        const Estimate* b = find_estimate(second, a.name);
        if (b == nullptr || a.given || b->given || a.name == "pole_pairs") continue;
        const double apart = std::fabs(a.value - b->value), sd = std::hypot(a.sd, b->sd);
        if (!(apart > kDeviations * sd) || !(apart > kPart * std::fabs(b->value))) continue;
        out.push_back(fmt::format("warning: {} and {} differ on {} by {:.2g} %{}: one of them takes up what the model "
                                  "lacks",
                                  who, other, symbol(a.name), 100.0 * apart / std::fabs(b->value),
                                  sd > 0.0 ? fmt::format(", {:.2g} of their deviations", apart / sd) : ""));
    }
    return out;
}

Json compare_json(const Comparison& c)
{
    const auto parameters = [&](const Result& r) { return result_json(r, c.nominal).at("parameters"); };
    return {{"schema", "dqwatch.compare/1"},
            {"reference", parameters(c.reference)},
            {"float", parameters(c.single)},
            {"q15", parameters(c.fixed)},
            {"difference_percent",
             {{"float_reference", differences(c.single, c.reference)},
              {"q15_float", differences(c.fixed, c.single)},
              {"q15_reference", differences(c.fixed, c.reference)}}}};
}

std::string compare_text(const Comparison& c)
{
    const auto rows = table_rows(c);
    std::string out = fmt::format("{}, {}\n\n", name_of(c.reference.regime), counted(c.reference.rows, "row"));
    if (rows.size() > 1) out += with_minus(table(rows)) + "\n" + about_last_places(c) + "\n";
    const auto left = missing(c);
    if (!left.empty()) out += "\nnot identifiable from this log\n";
    for (const std::string& line : left) out += "  " + line + "\n";
    return out;
}

std::string compare_page(const Comparison& c, Extent extent)
{
    PagePlots plots;
    const std::string name = names_of_files({c.log});
    const auto fixed = worst(c.fixed, c.single), single = worst(c.single, c.reference);
    const auto left = missing(c);
    std::string body = page_header(
        fmt::format("{} · comparison, {}, {} rows", name, name_of(c.reference.regime), grouped(c.reference.rows)),
        left.empty() ? "clean" : "part", left.empty() ? "compared" : "compared in part",
        apart("Q15 and float", fixed) + "; " + apart("float and the reference fit", single) + ".");
    auto rows = table_rows(c);
    for (auto& row : rows)
        for (auto& cell : row) cell = with_minus(cell);
    body += card("Parameters",
                 html_table(rows, "numbers named") + "<p class=\"hint\">" + unbroken(about_last_places(c)) + ".</p>");
    const std::string title = name + " – dqwatch compare";
    if (extent == Extent::first_screen) return page_around(title, body, plots);
    body += plots.section({"Parameters over time",
                           "What float and Q15 learners have read after each block; dashed: the reference fit of the "
                           "whole log. " +
                               std::string(kPlotHint),
                           compare_plots(c)});
    std::vector<std::string> notes = left;
    for (const std::string& note : c.notes) notes.push_back(with_minus(note));
    return page_around(title, body + lists_section("Log and notes", {c.log}, notes), plots);
}

}  // namespace dqw
