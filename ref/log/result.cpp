#include "ref/log/result.hpp"

#include <cmath>
#include <cstdio>

namespace dqw {

std::string why_observed(bool observed, const std::string& name)
{
    if (!observed || name != "Lq_H") return "";
    return "the angle is an observer's, whose own L_q puts the frame where the machine's does not show";
}

std::string why_not_usable(const Estimate& e)
{
    if (e.given) return "";
    if (e.observed) return why_observed(true, e.name);
    if (!std::isfinite(e.value) || !std::isfinite(e.sd)) return "it is not known";
    if (!(e.value > 0.0)) return "no machine has one that is not above zero";
    if (e.times_pole_pairs) return "this is its product with the pole pairs, which are not known";
    constexpr double kDeviations = 3.0, kPart = 0.1;
    const double part = kDeviations * e.sd / e.value;
    // What is rounded to a whole number is known where it is told.
    if (e.name == "pole_pairs" || part < kPart) return "";
    char text[80];
    std::snprintf(text, sizeof text, "three deviations are %.3g %% of it, and 10 is the most", 100.0 * part);
    return text;
}

}  // namespace dqw
