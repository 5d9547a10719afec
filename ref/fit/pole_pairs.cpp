#include "ref/fit/pole_pairs.hpp"

#include <algorithm>
#include <cmath>

#include "ref/fit/explain.hpp"

namespace dqw {
namespace {

constexpr double kDeviations = 4.0;  // a normal exceeds it in 6 of 100000 cases

}  // namespace

PolePairs decide_pole_pairs(const Assessment& real)
{
    constexpr double kFarthest = 0.3;
    PolePairs p;
    p.sought = true;
    p.real = real;
    p.whole = std::max(1.0, std::round(real.value));
    const double off = std::abs(real.value - p.whole);
    p.clear = real.verdict == Verdict::determined && off < kFarthest && 1.0 - off > kDeviations * real.sd;
    return p;
}

void report_pole_pairs(Task& task, const PolePairs& p, double product, double product_sd, Result& result)
{
    if (task.pole_pairs) {
        result.parameters.push_back({"pole_pairs", *task.pole_pairs, 0.0, !task.by_angle});
        return;
    }
    if (p.clear) {
        result.parameters.push_back({"pole_pairs", p.whole, p.real.sd, false});
        result.notes.push_back("pole_pairs rounded to a whole number from " + figure(p.real.value) +
                               " with standard deviation " + figure(p.real.sd));
        return;
    }
    if (!task.asks("pole_pairs") && !task.asks("psi_Wb")) return;
    NotIdentifiable n;
    if (!p.sought) {
        n = {"pole_pairs", "w_m is 0 rad/s on every row, and the pole pairs act only through it",
             excitation_for("pole_pairs", Regime::dynamic)};
    } else if (p.real.verdict == Verdict::determined) {
        result.real_pole_pairs = p.real.value;
        n = {"pole_pairs",
             "no whole number stands out: standard deviation " + figure(p.real.sd) + ", " +
                 figure(std::abs(p.real.value - p.whole)) + " off the nearest (a real number stayed in the fit)",
             excitation_for("pole_pairs", Regime::dynamic)};
    } else {
        n = explain("pole_pairs", p.real, {"R_ohm", "Ld_H", "Lq_H", "psi_Wb", "pole_pairs", "", ""}, task.logs);
    }
    result.not_identifiable.push_back(n);
    // No machine has a part of a pole pair: the fit, and what turns with it, took up what the model lacks.
    if (p.sought && p.real.verdict == Verdict::determined && std::abs(p.real.value - p.whole) > kDeviations * p.real.sd)
        for (const char* name : {"Ld_H", "Lq_H", "psi_Wb"})
            withhold(task, name,
                     "the pole pairs come out as " + figure(p.real.value) + ", " +
                         figure(std::abs(p.real.value - p.whole) / p.real.sd) +
                         " deviations from a whole number: the model lacks something, and took up " + name + " for it",
                     "give the pole pairs, and trace the log", result);
    constexpr double kDoubt = 0.1;
    if (p.sought && !(p.real.sd < kDoubt * std::abs(p.real.value)))
        withhold_product(task, "psi_Wb", product, product_sd, result);
}

}  // namespace dqw
