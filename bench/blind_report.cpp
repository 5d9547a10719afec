// The campaign in figures: confusion table, rates, failed logs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "blind.hpp"

namespace blind {
namespace {

constexpr double kClear = 3.0;

bool holds(const std::vector<std::string>& list, const std::string& name)
{
    return std::find(list.begin(), list.end(), name) != list.end();
}

/// What became of one true thing over all logs.
struct Row {
    int logs = 0, named = 0, confusable = 0, nothing = 0, failed = 0;
    std::map<std::string, int> instead;
};

void count(const Outcome& o, const std::string& truth, Row& row)
{
    ++row.logs;
    if (!o.failure.empty()) {
        ++row.failed;
        return;
    }
    bool mistaken = false;
    for (const auto& list : o.confusable) mistaken = mistaken || holds(list, truth);
    if (holds(o.named, truth)) {
        ++row.named;
    } else if (mistaken) {
        ++row.confusable;
    } else {
        bool other = false;
        for (const std::string& n : o.named)
            if (!holds(o.truth, n)) ++row.instead[n], other = true;
        if (!other) ++row.nothing;
    }
}

/// 95 % interval of a share, Wilson's.
std::pair<double, double> interval(int hits, int n)
{
    if (n == 0) return {0, 1};
    const double z2 = 1.96 * 1.96, p = static_cast<double>(hits) / n, middle = p + z2 / (2.0 * n),
                 half = 1.96 * std::sqrt(p * (1 - p) / n + z2 / (4.0 * n * n)), whole = 1 + z2 / n;
    return {std::max((middle - half) / whole, 0.0), std::min((middle + half) / whole, 1.0)};
}

std::string rate(const char* what, int part, int of, const char* wanted)
{
    return fmt::format("{:<62} {:>3} of {:>3}  {:5.1f} %  ({})\n", what, part, of, of ? 100.0 * part / of : 0.0,
                       wanted);
}

bool failed(const Outcome& o) { return !o.exact() || (o.kind == Kind::clean && o.verdict != "clean"); }

/// Of the usable parameters: within so many deviations, or 1 %; over 15 % off. Faults from outside apart: no model of
/// them has true parameters.
std::string coverage(const std::vector<Outcome>& outcomes)
{
    struct Sum {
        int known = 0, usable = 0, two = 0, three = 0, gross = 0;
        double worst = 0;
    };
    std::map<std::string, Sum> sums;
    for (const Outcome& o : outcomes)
        for (const Off& x : o.off) {
            if (o.kind == Kind::outside) continue;
            for (const std::string& name : {x.name, std::string("all")}) {
                Sum& s = sums[name];
                ++s.known;
                if (!x.usable) continue;
                ++s.usable;
                const double off = std::abs(x.percent);
                s.two += off <= std::max(2 * x.sd_percent, 1.0), s.three += off <= std::max(3 * x.sd_percent, 1.0);
                s.gross += off > 15, s.worst = std::max(s.worst, off);
            }
        }
    std::string text =
        "| usable parameters | known | usable | within 2 sd or 1 % | within 3 sd or 1 % | over 15 % off | "
        "worst % |\n| --- | --: | --: | --: | --: | --: | --: |\n";
    for (const auto& [name, s] : sums) {
        const double n = std::max(s.usable, 1);
        text += fmt::format("| {} | {} | {} | {:.1f} % | {:.1f} % | {} | {:.1f} |\n", name, s.known, s.usable,
                            100 * s.two / n, 100 * s.three / n, s.gross, s.worst);
    }
    return text + "\n";
}

/// What is stated of a name beside the share that is right, in bins of at least 30 where there are so many.
std::string calibration(const std::vector<Outcome>& outcomes)
{
    constexpr std::size_t kBin = 30;
    std::vector<std::pair<double, bool>> said;
    for (const Outcome& o : outcomes)
        for (std::size_t n = 0; n < o.named.size() && n < o.confidence.size(); ++n)
            if (std::isfinite(o.confidence[n])) said.emplace_back(o.confidence[n], o.holds_name(n));
    if (said.empty()) return "no confidence is stated\n\n";
    std::sort(said.begin(), said.end());
    std::string text = "| confidence stated | names | mean | right | 95 % interval | holds |\n"
                       "| --- | --: | --: | --: | --- | --- |\n";
    const std::size_t bins = std::max<std::size_t>(said.size() / kBin, 1);
    for (std::size_t b = 0; b < bins; ++b) {
        const std::size_t from = b * said.size() / bins, to = (b + 1) * said.size() / bins;
        int right = 0;
        double mean = 0;
        for (std::size_t k = from; k < to; ++k) right += said[k].second, mean += said[k].first;
        const int n = static_cast<int>(to - from);
        mean /= n;
        const auto [low, high] = interval(right, n);
        text += fmt::format("| {:.3f} to {:.3f} | {} | {:.3f} | {} | {:.3f} to {:.3f} | {} |\n", said[from].first,
                            said[to - 1].first, n, mean, right, low, high, low <= mean && mean <= high ? "yes" : "NO");
    }
    return text + "\n";
}

}  // namespace

std::string report(const std::vector<Outcome>& outcomes)
{
    std::map<std::string, Row> rows[2];
    std::map<std::string, int> extra;
    int exact[2] = {}, meant[2] = {}, effects[2] = {}, plants[2] = {}, plants_exact[2] = {}, clean = 0,
        false_effect = 0, structured = 0, outside = 0, named_outside = 0, missed_outside = 0, base = 0, base_ok = 0;
    int present = 0;
    double seconds = 0, slowest = 0;
    for (const Outcome& o : outcomes) {
        seconds += o.seconds, slowest = std::max(slowest, o.seconds);
        const bool clear = o.strength >= kClear;
        for (const std::string& t : o.truth) count(o, t, rows[o.kind == Kind::outside][t]);
        if (o.kind == Kind::clean) {
            ++clean, false_effect += !o.named.empty() || !o.failure.empty(),
                structured += o.named.empty() && o.verdict != "clean";
            Row& row = rows[0]["none"];
            ++row.logs, row.nothing += o.named.empty();
            for (const std::string& n : o.named) ++row.instead[n];
        } else if (o.kind == Kind::outside) {
            ++outside, named_outside += !o.named.empty() || !o.failure.empty(), missed_outside += o.verdict == "clean";
        } else {
            ++effects[clear], exact[clear] += o.exact(), meant[clear] += o.right();
            if (clear) ++plants[o.switching], plants_exact[o.switching] += o.exact();
            if (!o.right())
                for (const std::string& n : o.named)
                    if (!holds(o.truth, n)) ++extra[n];
        }
        if (o.kind == Kind::outside || (o.kind != Kind::clean && !clear) || o.off.empty()) continue;
        ++base, base_ok += o.base_right();
        present += static_cast<int>(o.off.size());
    }

    std::string text = fmt::format("{} logs, {:.0f} s of tracing, the slowest {:.1f} s\n\n", outcomes.size(), seconds,
                                   slowest);
    text += "| true | logs | named | confusable | nothing | failed | instead |\n| --- | --: | --: | --: | --: | --: | "
            "--- |\n";
    for (const auto& part : rows)
        for (const auto& [name, row] : part) {
            std::string instead;
            for (const auto& [other, times] : row.instead)
                instead += fmt::format("{}{} {}", instead.empty() ? "" : ", ", other, times);
            text += fmt::format("| {} | {} | {} | {} | {} | {} | {} |\n", name, row.logs, row.named, row.confusable,
                                row.nothing, row.failed, instead);
        }
    text += "\n";
    text += rate("exact set right, every effect above 3 times the noise floor", exact[1], effects[1], "97 %");
    text += rate("exact set right, an effect from 1.5 to 3 times the noise floor", exact[0], effects[0], "92 %");
    text += rate("above 3 times, the inverter's mean voltage", plants_exact[0], plants[0], "of these");
    text += rate("above 3 times, the inverter at its switches", plants_exact[1], plants[1], "of these");
    text += rate("above 3 times, whatever look-alikes are listed", meant[1], effects[1], "no bound");
    text += rate("from 1.5 to 3 times, whatever look-alikes are listed", meant[0], effects[0], "no bound");
    text += rate("clean logs with a false effect", false_effect, clean, "0");
    text += rate("clean logs without one, but said to be structured", structured, clean, "0");
    text += rate("outside effects named as something of the catalogue", named_outside, outside, "5 % at most");
    text += rate("outside effects taken for clean", missed_outside, outside, "no bound");
    text += rate("base parameters: R, L within 2 %, psi within 0.5 %", base_ok, base,
                 "all; effects above 3 times, and clean");
    text += fmt::format("({} parameters of {} logs; one that the tracer withholds is not counted)\n", present, base);
    text += "\n" + coverage(outcomes) + calibration(outcomes);
    if (!extra.empty()) {
        text += "named beside or instead of the truth:";
        for (const auto& [name, times] : extra) text += fmt::format(" {} {}", name, times);
        text += "\n";
    }
    for (const Outcome& o : outcomes) {
        const bool off = !o.base_right() && o.failure.empty() && o.kind != Kind::outside &&
                         (o.kind == Kind::clean || o.strength >= kClear);
        if (!failed(o) && !off) continue;
        std::string named, wide;
        for (std::size_t n = 0; n < o.named.size(); ++n) {
            named += (n ? ", " : "") + o.named[n];
            for (const std::string& c : o.confusable[n]) named += "/" + c;
        }
        for (const Off& x : o.off)
            if (std::abs(x.percent) > (x.name == "psi_Wb" ? 0.5 : 2.0))
                wide += fmt::format(" {} {:+.2g} %", x.name, x.percent);
        text += fmt::format("{} seed {}: {} ({:.1f}x): {}: [{}]{}{}\n    {}\n    build/bench/blind --seed {}\n",
                            !o.right()  ? "WRONG"
                            : failed(o) ? "VAGUE"
                                        : "OFF  ",
                            o.seed, name_of(o.kind), o.strength, o.failure.empty() ? o.verdict : "threw: " + o.failure,
                            named, wide.empty() ? "" : " off:", wide, o.about, o.seed);
    }
    return text;
}

}  // namespace blind
