// Whether a tracer named what is in a log.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "blind.hpp"

namespace blind {
namespace {

constexpr std::size_t kMostConfusable = 3;

bool holds(const std::vector<std::string>& list, const std::string& name)
{
    return std::find(list.begin(), list.end(), name) != list.end();
}

std::vector<std::string> split(const std::string& text, char separator)
{
    std::vector<std::string> parts;
    std::stringstream stream(text);
    for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
    return parts;
}

std::string join(const std::vector<std::string>& parts, char separator)
{
    std::string text;
    for (const std::string& part : parts) text += (text.empty() ? "" : std::string(1, separator)) + part;
    return text;
}

/// No field may be empty, or hold what separates fields.
std::string field(std::string text)
{
    for (char& c : text)
        if (c == '\t' || c == '\n' || c == '\r') c = ' ';
    return text.empty() ? "-" : text;
}
std::string unfield(const std::string& text) { return text == "-" ? "" : text; }

}  // namespace

bool Outcome::right() const
{
    if (!failure.empty()) return false;
    if (kind == Kind::outside) return named.empty();
    for (const std::string& t : truth) {
        bool found = holds(named, t);
        for (const auto& list : confusable) found = found || holds(list, t);
        if (!found) return false;
    }
    for (std::size_t n = 0; n < named.size(); ++n) {
        if (confusable[n].size() > kMostConfusable) return false;
        bool meant = holds(truth, named[n]);
        for (const std::string& t : truth) meant = meant || holds(confusable[n], t);
        if (!meant) return false;
    }
    return true;
}

bool Outcome::base_right() const
{
    return failure.empty() && std::all_of(off.begin(), off.end(), [](const Off& o) {
               return std::abs(o.percent) <= (o.name == "psi_Wb" ? 0.5 : 2.0);
           });
}

Outcome score(const Case& c, const dqw::TraceResult& result, double seconds)
{
    Outcome o;
    o.seed = c.seed, o.kind = c.kind, o.strength = c.strength(), o.about = c.about, o.verdict = result.verdict,
    o.seconds = seconds;
    for (const Drawn& d : c.drawn) o.truth.push_back(d.name);
    for (const dqw::TraceEffect& e : result.effects)
        o.named.push_back(e.name), o.confusable.push_back(e.confusable_with);
    const std::pair<const char*, double> base[] = {
        {"R_ohm", c.truth.R_ohm}, {"Ld_H", c.truth.Ld_H}, {"Lq_H", c.truth.Lq_H}, {"psi_Wb", c.truth.psi_Wb}};
    for (const dqw::Estimate& e : result.after.parameters)
        for (const auto& [name, value] : base)
            if (e.name == name && !e.given) o.off.push_back({name, 100 * (e.value / value - 1)});
    return o;
}

std::string line_of(const Outcome& o)
{
    std::vector<std::string> confusable, off;
    for (const auto& list : o.confusable) confusable.push_back(list.empty() ? "-" : join(list, ','));
    for (const Off& x : o.off) off.push_back(fmt::format("{}={}", x.name, x.percent));
    return fmt::format("{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}", o.seed, static_cast<int>(o.kind), o.strength,
                       field(o.verdict), field(join(o.truth, ',')), field(join(o.named, ',')),
                       field(join(confusable, ';')), field(join(off, ',')), o.seconds, field(o.failure),
                       field(o.about));
}

Outcome outcome_of(const std::string& line)
{
    const std::vector<std::string> f = split(line, '\t');
    if (f.size() != 11) throw std::runtime_error("not an outcome: " + line);
    Outcome o;
    o.seed = std::stoull(f[0]), o.kind = static_cast<Kind>(std::stoi(f[1])), o.strength = std::stod(f[2]),
    o.verdict = unfield(f[3]);
    o.truth = split(unfield(f[4]), ','), o.named = split(unfield(f[5]), ',');
    for (const std::string& list : split(f[6], ';'))
        if (o.confusable.size() < o.named.size()) o.confusable.push_back(split(unfield(list), ','));
    for (const std::string& x : split(unfield(f[7]), ','))
        o.off.push_back({x.substr(0, x.find('=')), std::stod(x.substr(x.find('=') + 1))});
    o.seconds = std::stod(f[8]), o.failure = unfield(f[9]), o.about = f[10];
    return o;
}

}  // namespace blind
