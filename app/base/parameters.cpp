#include "app/base/parameters.hpp"

#include <algorithm>
#include <iterator>

namespace dqw {
namespace {

const Parameter* parameter_named(const std::string& name)
{
    const auto found = std::find_if(std::begin(kParameters), std::end(kParameters),
                                    [&](const Parameter& p) { return name == p.name; });
    return found == std::end(kParameters) ? nullptr : found;
}

}  // namespace

const Parameter kParameters[8] = {
    {"R_ohm", "R", &Machine::R_ohm, &PlainModel::R_ohm},
    {"Ld_H", "L_d", &Machine::Ld_H, &PlainModel::Ld_H},
    {"Lq_H", "L_q", &Machine::Lq_H, &PlainModel::Lq_H},
    {"psi_Wb", "ψ", &Machine::psi_Wb, &PlainModel::psi_Wb},
    {"pole_pairs", "p", &Machine::pole_pairs, &PlainModel::pole_pairs},
    {"J_kgm2", "J", &Machine::J_kgm2, &PlainModel::J_kgm2},
    {"B_Nms_rad", "B", &Machine::B_Nms_rad, &PlainModel::B_Nms_rad},
    {"torque_constant_Nm_A", "K_t", &Machine::torque_constant_Nm_A, &PlainModel::torque_constant_Nm_A},
};

const std::vector<std::string>& known_parameters()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const Parameter& p : kParameters) all.emplace_back(p.name);
        return all;
    }();
    return names;
}

std::string symbol(const std::string& parameter)
{
    const Parameter* p = parameter_named(parameter);
    return p ? p->symbol : parameter;
}

std::optional<double> nominal_of(const Machine& machine, const std::string& parameter)
{
    const Parameter* p = parameter_named(parameter);
    return p ? machine.*(p->nominal) : std::nullopt;
}

const Estimate* find_estimate(const std::vector<Estimate>& estimates, const std::string& name)
{
    const auto found = std::find_if(estimates.begin(), estimates.end(),
                                    [&](const Estimate& e) { return e.name == name; });
    return found == estimates.end() ? nullptr : &*found;
}

}  // namespace dqw
