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

/// Known, and three deviations below a tenth of it.
bool usable(const dqw::Estimate& e) { return e.value > 0 && 3 * e.sd < 0.1 * e.value; }

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

bool Outcome::exact() const
{
    if (!right() || kind == Kind::outside) return right();
    for (std::size_t n = 0; n < named.size(); ++n) {
        std::vector<std::string> said = confusable[n];
        said.push_back(named[n]);
        // Whom it stands for: itself, where it is true, or the true ones that it lists.
        std::vector<std::string> may;
        for (std::size_t t = 0; t < truth.size(); ++t) {
            if (holds(truth, named[n]) ? truth[t] != named[n] : !holds(said, truth[t])) continue;
            may.push_back(truth[t]);
            if (t < close.size()) may.insert(may.end(), close[t].begin(), close[t].end());
            const auto listed = [&](const std::string& s) { return holds(said, s) || holds(named, s); };
            const std::vector<std::string> none, &alike = t < same.size() ? same[t] : none;
            const auto told = static_cast<std::size_t>(std::count_if(alike.begin(), alike.end(), listed));
            if (told + holds(said, truth[t]) < 1 + std::min(alike.size(), kMostConfusable)) return false;
        }
        for (const std::string& s : said)
            if (!holds(may, s) && !holds(truth, s)) return false;
    }
    return true;
}

bool Outcome::holds_name(std::size_t n) const
{
    if (kind == Kind::outside || kind == Kind::clean) return false;
    if (holds(truth, named[n])) return true;
    for (std::size_t t = 0; t < truth.size(); ++t)
        if (!holds(named, truth[t]) && t < close.size() && holds(close[t], named[n])) return true;
    return false;
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
    o.switching = c.switching;
    for (const Drawn& d : c.drawn) o.truth.push_back(d.name), o.same.push_back(d.same), o.close.push_back(d.close);
    for (const dqw::TraceEffect& e : result.effects)
        o.named.push_back(e.name), o.confusable.push_back(e.confusable_with), o.confidence.push_back(e.confidence);
    const std::pair<const char*, double> base[] = {
        {"R_ohm", c.truth.R_ohm}, {"Ld_H", c.truth.Ld_H}, {"Lq_H", c.truth.Lq_H}, {"psi_Wb", c.truth.psi_Wb}};
    for (const dqw::Estimate& e : result.after.parameters)
        for (const auto& [name, value] : base)
            if (e.name == name && !e.given)
                o.off.push_back({name, 100 * (e.value / value - 1), 100 * e.sd / value, usable(e)});
    return o;
}

std::string line_of(const Outcome& o)
{
    const auto lists = [](const std::vector<std::vector<std::string>>& all) {
        std::vector<std::string> parts;
        for (const auto& list : all) parts.push_back(list.empty() ? "-" : join(list, ','));
        return field(join(parts, ';'));
    };
    std::vector<std::string> off, confidence;
    for (const Off& x : o.off)
        off.push_back(fmt::format("{}={}={}={}", x.name, x.percent, x.sd_percent, x.usable ? 1 : 0));
    for (const double c : o.confidence) confidence.push_back(fmt::format("{}", c));
    return fmt::format("{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}", o.seed, static_cast<int>(o.kind),
                       o.strength, field(o.verdict), field(join(o.truth, ',')), field(join(o.named, ',')),
                       lists(o.confusable), field(join(off, ',')), o.seconds, field(o.failure), field(o.about),
                       o.switching ? 1 : 0, field(join(confidence, ',')), lists(o.same), lists(o.close));
}

Outcome outcome_of(const std::string& line)
{
    const std::vector<std::string> f = split(line, '\t');
    if (f.size() != 15) throw std::runtime_error("not an outcome: " + line);
    Outcome o;
    o.seed = std::stoull(f[0]), o.kind = static_cast<Kind>(std::stoi(f[1])), o.strength = std::stod(f[2]),
    o.verdict = unfield(f[3]);
    o.truth = split(unfield(f[4]), ','), o.named = split(unfield(f[5]), ',');
    const auto lists = [](const std::string& text, std::size_t count) {
        std::vector<std::vector<std::string>> all;
        for (const std::string& list : split(text, ';'))
            if (all.size() < count) all.push_back(split(unfield(list), ','));
        return all;
    };
    o.confusable = lists(f[6], o.named.size()), o.same = lists(f[13], o.truth.size()),
    o.close = lists(f[14], o.truth.size());
    for (const std::string& x : split(unfield(f[7]), ',')) {
        const std::vector<std::string> part = split(x, '=');
        if (part.size() != 4) throw std::runtime_error("not a parameter: " + x);
        o.off.push_back({part[0], std::stod(part[1]), std::stod(part[2]), part[3] == "1"});
    }
    o.switching = f[11] == "1";
    for (const std::string& c : split(unfield(f[12]), ',')) o.confidence.push_back(std::stod(c));
    o.seconds = std::stod(f[8]), o.failure = unfield(f[9]), o.about = f[10];
    return o;
}

}  // namespace blind
