// The parameters of the schema dqwatch.parameters/1.
#ifndef DQW_APP_BASE_PARAMETERS_HPP
#define DQW_APP_BASE_PARAMETERS_HPP

#include <optional>
#include <string>
#include <vector>

#include "ref/log/log.hpp"
#include "ref/log/residual.hpp"
#include "ref/log/result.hpp"

namespace dqw {

struct Parameter {
    const char *name, *symbol;  ///< "R_ohm", and "R" as people write it
    std::optional<double> Machine::*nominal;
    double PlainModel::*model;
};

/// All, in the order in which they are told: the electrical ones first, as in dqw_parameter.
inline constexpr Parameter kParameters[] = {
    {"R_ohm", "R", &Machine::R_ohm, &PlainModel::R_ohm},
    {"Ld_H", "L_d", &Machine::Ld_H, &PlainModel::Ld_H},
    {"Lq_H", "L_q", &Machine::Lq_H, &PlainModel::Lq_H},
    {"psi_Wb", "ψ", &Machine::psi_Wb, &PlainModel::psi_Wb},
    {"pole_pairs", "p", &Machine::pole_pairs, &PlainModel::pole_pairs},
    {"J_kgm2", "J", &Machine::J_kgm2, &PlainModel::J_kgm2},
    {"B_Nms_rad", "B", &Machine::B_Nms_rad, &PlainModel::B_Nms_rad},
    {"torque_constant_Nm_A", "K_t", &Machine::torque_constant_Nm_A, &PlainModel::torque_constant_Nm_A},
};

/// Their names: what `--parameters` may ask for.
const std::vector<std::string>& known_parameters();

/// "R" for R_ohm; a name that is none of them stands for itself.
std::string symbol(const std::string& parameter);

/// What the machine file says about a parameter.
std::optional<double> nominal_of(const Machine& machine, const std::string& parameter);

/// The estimate of that name; nullptr where there is none.
const Estimate* find_estimate(const std::vector<Estimate>& estimates, const std::string& name);

}  // namespace dqw
#endif
