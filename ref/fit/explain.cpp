#include "ref/fit/explain.hpp"

#include <cmath>
#include <cstdio>

namespace dqw {
namespace {

struct Spread {
    double rms = 0.0, mean = 0.0, sd = 0.0;
};

Spread spread(const std::vector<Log>& logs, std::vector<double> Log::*column)
{
    double sum = 0.0, squares = 0.0, count = 0.0;
    for (const Log& log : logs)
        for (double x : log.*column) sum += x, squares += x * x, count += 1.0;
    if (!(count > 0.0)) return {};
    const double mean = sum / count;
    double centred = 0.0;
    for (const Log& log : logs)
        for (double x : log.*column) centred += (x - mean) * (x - mean);
    return {std::sqrt(squares / count), mean, std::sqrt(centred / count)};
}

std::string current(const char* name, const Spread& s)
{
    return std::string(name) + " is " + figure(s.rms) + " A RMS (mean " + figure(s.mean) + ", standard deviation " +
           figure(s.sd) + ")";
}

/// What in the signals bears on the parameter.
std::string signals(const std::string& name, const std::vector<Log>& logs)
{
    const Spread d = spread(logs, &Log::i_d_A), q = spread(logs, &Log::i_q_A), w = spread(logs, &Log::w_m_rad_s);
    std::string speed = "w_m is " + figure(w.rms) + " rad/s RMS (standard deviation " + figure(w.sd) + ")";
    if (name == "R_ohm") return current("i_d", d) + ", " + current("i_q", q);
    if (name == "Ld_H") return current("i_d", d) + ", " + speed;
    if (name == "Lq_H") return current("i_q", q) + ", " + speed;
    if (name == "psi_Wb" || name == "J_kgm2" || name == "B_Nms_rad") return speed;
    if (name == "torque_constant_Nm_A") return current("i_q", q);
    return current("i_d", d) + ", " + current("i_q", q) + ", " + speed;
}

std::string list(const std::vector<int>& index, const std::vector<std::string>& names)
{
    std::string out;
    for (int j : index) {
        const std::string& name = names[static_cast<std::size_t>(j)];
        if (name.empty()) continue;
        out += (out.empty() ? "" : " and ") + name;
    }
    return out;
}

}  // namespace

std::string figure(double x)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", x == 0.0 ? 0.0 : x);
    return text;
}

std::string excitation_for(const std::string& name, Regime regime)
{
    const bool dynamic = regime == Regime::dynamic;
    if (name == "R_ohm") return "current on either axis, some tenths of rated, also at low speed";
    if (name == "Ld_H" || name == "Lq_H") {
        const std::string i = name == "Ld_H" ? "i_d" : "i_q";
        if (regime == Regime::standstill) return "a dynamic log with steps of " + i;
        return dynamic ? "steps or a random signal on " + i + ", a tenth of rated or more"
                       : "settled points at several values of " + i + ", the machine turning; or a dynamic log";
    }
    if (name == "psi_Wb")
        return dynamic ? "the machine turning, speed or currents changing, and the pole pairs given"
                       : "the machine turning, at two speeds or two values of i_d, and the pole pairs given";
    if (name == "pole_pairs")
        return dynamic ? "steps of i_d and i_q while the machine turns fast"
                       : "a dynamic log with steps of i_d and i_q at speed; or give the pole pairs";
    if (name == "J_kgm2") return "steps of torque, so that the speed changes";
    if (name == "B_Nms_rad") return "several settled speeds, also high ones";
    return "steps of i_q, with a measured torque_Nm";
}

NotIdentifiable explain(const std::string& name, const Assessment& a, const std::vector<std::string>& names,
                        const std::vector<Log>& logs)
{
    std::string why;
    switch (a.verdict) {
    case Verdict::no_effect: why = "it has no effect on this log: " + signals(name, logs); break;
    case Verdict::collinear:
        why = "it acts only together with " + list(a.partners, names) +
              ", and no row tells them apart (both stayed in the fit): " + signals(name, logs);
        break;
    default:
        why = "its standard deviation is " +
              (a.value != 0.0 ? figure(100.0 * a.sd / std::abs(a.value)) + " % of its value" : "all of its value") +
              " (it stayed in the fit): " + signals(name, logs);
    }
    return {name, why, excitation_for(name, logs.front().regime)};
}

}  // namespace dqw
