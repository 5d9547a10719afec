#include "ref/trace/rules.hpp"

#include <algorithm>
#include <cstdlib>

namespace dqw {
namespace {

/// Part of the excess that effects must explain, or they are not named: the larger part. With all of it, neither the
/// 3000-rpm grid nor any inverter sweep has an effect; with a quarter, the same as here.
constexpr double kLeastExplained = 0.5;
/// A residual that effects make larger than that is not explained by them. 1.01 or 1.04 changes nothing on the logs
/// named in confirmed().
constexpr double kGrown = 1.02;

double excess(double rms, double floor) { return std::max(rms * rms - floor * floor, 0.0); }

bool above(double rms, double floor, bool exact) { return rms > kStructured * floor && !exact; }

}  // namespace

bool explains(const Finding& f)
{
    if (f.fault || f.before_exact || f.after > kGrown * f.before) return false;
    return !above(f.after, f.floor, f.after_exact) ||
           excess(f.after, f.floor) <= (1.0 - kLeastExplained) * excess(f.before, f.floor);
}

double share_of(double before, double after, double floor)
{
    const double most = excess(before, floor);
    return most > 0.0 ? 1.0 - excess(after, floor) / most : 0.0;
}

double part_of_rest(double before, double after, double floor)
{
    return before > floor ? share_of(before, after, floor) : 1.0;
}

bool completes(double before, double after, double floor)
{
    constexpr double kNearlyAll = 0.9;
    return above(before, floor, false) && share_of(before, after, floor) >= kNearlyAll;
}

bool carries(const Finding& all, double with, double without)
{
    return !above(all.after, all.floor, all.after_exact) ||
           without * without - with * with >= excess(all.after, all.floor);
}

bool carries_most(const Finding& f, double without, double told)
{
    constexpr double kLeastTold = 0.5;
    return told > kLeastTold && above(f.before, f.floor, f.before_exact) &&
           without * without - f.after * f.after >= kLeastExplained * excess(f.before, f.floor);
}

bool carries_all(const Finding& f, double without)
{
    constexpr double kFarAbove = 2.0;  // of the floor: clearly more than is_structured() asks for
    return without > kFarAbove * f.floor && completes(without, f.after, f.floor) &&
           !above(f.after, f.floor, f.after_exact);
}

bool is_idle(double without, double floor, std::size_t alike) { return alike > 0 && without <= kStructured * floor; }

bool reads_better(const Finding& f, double read, std::size_t effects)
{
    // As little: as what is not made larger; clearly less: as the reading itself is judged.
    constexpr double kClearlyLess = 0.8;
    return (effects > 1 && read <= kGrown * f.after) ||
           (above(f.after, f.floor, f.after_exact) && read < kClearlyLess * f.after);
}

std::size_t against_reading(std::size_t found, bool shifted, int rows_before)
{
    return shifted && std::abs(rows_before) < 2 ? 1 : found;
}

bool turns_with_rotor(double t, std::size_t here, std::size_t there, bool noise)
{
    if (there > here && noise) return false;
    return t >= kClearlyT || (there < here && t >= -kClearlyT);
}

bool is_structured(const Rest& rest)
{
    const Finding& f = rest.is;
    // Something was found, and is not named: a floor above the whole residual then contains the model's error, and is
    // unusable.
    const bool no_floor = !rest.effects && rest.taken_back && f.floor > kStructured * f.before;
    return above(f.after, f.floor, f.after_exact) || f.fault || no_floor;
}

std::string verdict_of(bool effects, bool structured, bool doubt)
{
    if (effects) return structured ? "partly_explained" : "explained";
    return structured || doubt ? "unexplained" : "clean";
}

}  // namespace dqw
