#include "app/learn/signals.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

constexpr double kTurn_rad = 6.283185307179586;

float at(const std::vector<double>& column, std::size_t row)
{
    return column.empty() ? 0.0F : static_cast<float>(column[row]);
}

double current_at(const Log& log, std::size_t k)
{
    return std::hypot(log.i_d_A.empty() ? 0.0 : log.i_d_A[k], log.i_q_A.empty() ? 0.0 : log.i_q_A[k]);
}

double speed_integrated(const Log& log, std::size_t k)
{
    if (k == 0 || log.t_s.empty() || log.w_m_rad_s.empty()) return 0.0;
    return 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k - 1]) * (log.t_s[k] - log.t_s[k - 1]);
}

double start_angle(const std::vector<TraceInput>& inputs)
{
    for (const TraceInput& in : inputs)
        if (in.effect == "dead_time" && in.shape.size() > 1) return in.shape[1];
    return 0.0;
}

}  // namespace

bool heats_by_current(const TraceInput& in)
{
    return (in.effect == "winding_temperature" || in.effect == "magnet_temperature") && in.shape.size() > 1 &&
           in.shape[1] > 0.0 && !(in.shape.size() > 2 && std::isnan(in.shape[2]));
}

double heat_reach(const TraceInput& in, const std::vector<Log>& logs)
{
    if (!heats_by_current(in)) return 1.0;
    const double i_base_A = in.shape.size() > 2 && in.shape[2] > 0.0 ? in.shape[2] : largest_current(logs);
    double most = 0.0;
    for (const Log& log : logs) {
        const double part = std::min(log.dt_s / in.shape[1], 1.0);
        double heat = 0.0;
        for (std::size_t k = 0; k < log.rows(); ++k) {
            most = std::max(most, heat);
            const double i = current_at(log, k) / i_base_A;
            if (std::isfinite(i)) heat += part * (i * i - heat);
        }
    }
    return most > 0.0 ? most : 1.0;
}

float largest(const std::vector<Log>& logs, std::vector<double> Log::*a, std::vector<double> Log::*b)
{
    double most = 0.0;
    for (const Log& log : logs)
        for (const auto* column : {&(log.*a), &(log.*b)})
            for (double x : *column) most = std::max(most, std::abs(x));
    return most > 1e-30 ? static_cast<float>(most) : 1.0F;
}

float period_of(const Log& log, const std::vector<TraceInput>& inputs)
{
    if (log.regime == Regime::dynamic) return static_cast<float>(log.dt_s);
    const bool heats = std::any_of(inputs.begin(), inputs.end(), heats_by_current);
    return heats && log.dt_s > 0.0 ? static_cast<float>(log.dt_s) : 1.0F;
}

double weight_unit(const TraceInput& input, const Log& log, const std::vector<TraceInput>& inputs)
{
    return input.effect == "delay" && log.regime != Regime::dynamic ? static_cast<double>(period_of(log, inputs)) : 1.0;
}

double largest_current(const std::vector<Log>& logs)
{
    double most = 0.0;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k) most = std::max(most, current_at(log, k));
    return most > 1e-30 ? most : 1.0;
}

SampleSource::SampleSource(const Log& log, double pole_pairs, const std::vector<TraceInput>& inputs) : log_(log)
{
    End end;
    fill(pole_pairs, inputs, end);
}

SampleSource::SampleSource(const Log& log, double pole_pairs, const std::vector<TraceInput>& inputs, End& end)
    : log_(log)
{
    fill(pole_pairs, inputs, end);
}

void SampleSource::fill(double pole_pairs, const std::vector<TraceInput>& inputs, End& end)
{
    const Log& log = log_;
    if (inputs.empty()) return;
    theta_e_rad_.resize(log.rows());
    double integrated = end.any ? end.angle_rad : start_angle(inputs);
    if (end.any && !log.t_s.empty() && !log.w_m_rad_s.empty())
        integrated += pole_pairs * (0.5 * (log.w_m_rad_s[0] + end.w_m_rad_s) * (log.t_s[0] - end.t_s));
    for (std::size_t k = 0; k < log.rows(); ++k) {
        integrated += pole_pairs * speed_integrated(log, k);
        double angle = integrated;
        if (!log.theta_m_rad.empty()) angle = pole_pairs * log.theta_m_rad[k];
        if (!log.theta_e_rad.empty()) angle = log.theta_e_rad[k];
        // Single precision keeps the digits of a small angle alone.
        theta_e_rad_[k] = static_cast<float>(std::remainder(angle, kTurn_rad));
    }
    if (log.rows() == 0 || log.t_s.empty() || log.w_m_rad_s.empty()) return;
    end = {integrated, log.t_s.back(), log.w_m_rad_s.back(), true};
}

dqw_sample SampleSource::operator()(std::size_t k) const
{
    dqw_sample s = dqw_sample_from_dq(at(log_.v_d_V, k), at(log_.v_q_V, k), at(log_.i_d_A, k), at(log_.i_q_A, k),
                                      at(log_.w_m_rad_s, k), theta_e_rad_.empty() ? 0.0F : theta_e_rad_[k]);
    if (theta_e_rad_.empty()) return s;
    s.temp_winding_C = at(log_.temp_winding_C, k);
    s.temp_magnet_C = at(log_.temp_magnet_C.empty() ? log_.temp_winding_C : log_.temp_magnet_C, k);
    return s;
}

std::vector<float> shaft_angle_of(const Log& log)
{
    std::vector<float> angle(log.rows());
    double integrated = 0.0;
    for (std::size_t k = 0; k < angle.size(); ++k) {
        integrated += speed_integrated(log, k);
        angle[k] = static_cast<float>(
            std::remainder(log.theta_m_rad.empty() ? integrated : log.theta_m_rad[k], kTurn_rad));
    }
    return angle;
}

}  // namespace dqw
