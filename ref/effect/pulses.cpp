#include "ref/effect/pulses.hpp"

#include <algorithm>
#include <cmath>

#include "ref/effect/filter.hpp"

namespace dqw {

Duties::Duties(Modulation modulation, const double v_V[3], double link_V)
{
    const auto [least, most] = std::minmax_element(v_V, v_V + 3);
    const double low = *least, high = *most, link = std::max(link_V, high - low);
    double shift = -0.5 * (high + low);
    const int rests = resting_leg(modulation, v_V);
    // The leg that rests is the highest or the lowest, whichever it is of.
    if (rests >= 0) shift = v_V[rests] >= high ? 0.5 * link - high : -0.5 * link - low;
    for (int leg = 0; leg < 3; ++leg)
        of[leg] = link > 0.0 ? std::clamp(0.5 + (v_V[leg] + shift) / link, 0.0, 1.0) : 0.5;
    // A duty that rounds off its rail would have edges.
    if (rests >= 0 && link > 0.0) of[rests] = v_V[rests] >= high ? 1.0 : 0.0;
}

double pulse_beyond_mean(double duty, double u_s, double period_s)
{
    const double u = std::min(std::abs(u_s), period_s), begins = 0.5 * (1.0 - duty) * period_s;
    return std::copysign(1.0, u_s) * (std::clamp(u - begins, 0.0, duty * period_s) - duty * u);
}

double pulse_moment(double duty, double u_s, double period_s)
{
    const double u = std::min(std::abs(u_s), period_s), behind = std::max(u - 0.5 * (1.0 - duty) * period_s, 0.0),
                 over = std::max(behind - duty * period_s, 0.0);
    return 0.5 * (behind * behind - over * over - duty * u * u);
}

double second_moment(double duty) { return (duty * duty - 1.0) * duty / 12.0; }

double mean_product(double duty, double other)
{
    const auto [low, high] = std::minmax(duty, other);
    return low * (1.0 - high) * (2.0 * high - high * high - low * low) / 24.0;
}

FilteredPulse::FilteredPulse(double tau_s, double period_s) : tau_s_(tau_s)
{
    const double tau = std::abs(tau_s);
    rate_ = tau > 0.0 ? 0.5 * period_s / tau : 0.0;
    kept = tau > 0.0 ? left_after(2.0 * rate_) : 0.0;
    all_ = -std::expm1(-2.0 * rate_);
}

double FilteredPulse::beyond_mean(double duty) const
{
    if (!(rate_ > 0.0)) return 0.0;
    // What its falling edge has left, as long before the period's end as the rising one is behind its start.
    const double fell = left_after(rate_ * (1.0 - duty)), rose = fell > 0.0 ? kept / fell : 0.0;
    return tau_s_ * ((fell - rose) / all_ - duty);
}

}  // namespace dqw
