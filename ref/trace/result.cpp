#include "ref/trace/result.hpp"

#include <algorithm>
#include <cmath>

#include "ref/effect/effect.hpp"
#include "ref/effect/range.hpp"
#include "ref/trace/flux_map.hpp"

namespace dqw {

PlainModel plain_of(const TraceSetup& setup, const Point& at)
{
    PlainModel m;
    m.pole_pairs = setup.pole_pairs;
    if (setup.regime == Regime::mechanical)
        m.J_kgm2 = at.base[0], m.B_Nms_rad = at.base[1];
    else
        m.R_ohm = at.base[0], m.Ld_H = at.base[1], m.Lq_H = at.base[2], m.psi_Wb = at.base[3];
    return m;
}

std::vector<Estimate> base_parameters(const TraceSetup& setup, const Point& at, const Eigen::VectorXd& sd)
{
    std::vector<Estimate> out;
    const bool turns = range_of(*setup.logs, &Log::w_m_rad_s).size() > 0.0;
    const auto& names = setup.full->base_names();
    for (Eigen::Index j = 0; j < at.base.size(); ++j) {
        // What the log cannot tell is absent; nothing is as small as this but zero.
        constexpr double kZero = 1e-12;
        if (!std::isfinite(sd[j]) || sd[j] > std::max(std::abs(at.base[j]), kZero)) continue;
        const std::string& name = names[static_cast<std::size_t>(j)];
        // In time L di/dt tells L, but where the machine turns w_e L i pulls it to the product; psi never stands alone.
        const bool product = !setup.pole_pairs_known && (name == "psi_Wb" || (name != "R_ohm" && turns));
        out.push_back({name, at.base[j], sd[j], false, product && setup.regime != Regime::mechanical});
    }
    const auto& given = setup.logs->front().machine.pole_pairs;
    if (setup.regime != Regime::mechanical && setup.pole_pairs_known)
        out.push_back({"pole_pairs", setup.pole_pairs, 0.0, given.has_value()});
    return out;
}

std::vector<AxisResidual> axes_of(const TraceSetup& setup, const std::vector<ReportBlock>& blocks)
{
    std::vector<AxisResidual> out;
    for (int c = 0; c < setup.full->channels(); ++c) {
        double r = 0.0, m = 0.0;
        for (const ReportBlock& b : blocks) r += b.residual[c] * b.residual[c], m += b.measured[c] * b.measured[c];
        const double n = static_cast<double>(std::max<std::size_t>(blocks.size(), 1));
        out.push_back({setup.regime == Regime::mechanical ? "torque"
                       : c == 0                           ? "d"
                                                          : "q",
                       std::sqrt(r / n), m > 0.0 ? 100.0 * std::sqrt(r / m) : 0.0});
    }
    return out;
}

std::vector<Estimate> effect_parameters(const TraceSetup& setup, const Point& at, const Eigen::VectorXd& sd,
                                        const std::string& name)
{
    std::vector<TraceInput> inputs;
    std::vector<std::vector<double>> weight_sd;
    std::vector<double> shape_sd;
    Eigen::Index j = at.base.size() + at.gain.size();
    for (const Term& t : at.terms) {
        const int w = weights_of(t.input.law), s = free_shapes_of(t.input);
        if (name == name_of(t.input.law)) {
            weight_sd.emplace_back(sd.data() + j, sd.data() + j + w);
            inputs.push_back(input_of(setup, at, is_map(t.input.law) ? polynomial_of(setup, t, &weight_sd.back()) : t));
            shape_sd.push_back(s > 0 ? sd[j + w] : 0.0);
        }
        j += w + s;
    }
    return physical(inputs, weight_sd, shape_sd, plain_of(setup, at));
}

void put_channel(const TraceSetup& setup, const Point& at, TraceEffect& effect)
{
    for (const Term& t : at.terms) {
        if (effect.name != name_of(t.input.law)) continue;
        const TraceInput in = input_of(setup, at, t);
        effect.channel = channel_of(in), effect.turned = is_turned(in);
    }
}

}  // namespace dqw
