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
extern const Parameter kParameters[8];

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
