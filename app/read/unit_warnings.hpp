// Warnings of columns that physics doubts, each with the line of the machine file that corrects it.
#ifndef DQW_APP_READ_UNIT_WARNINGS_HPP
#define DQW_APP_READ_UNIT_WARNINGS_HPP

#include <string>
#include <vector>

#include "app/format/format.hpp"
#include "app/read/machine_file.hpp"
#include "app/read/voltage_fit.hpp"

namespace dqw {

/// Notes that begin "warning: ", of the rows of `probe`.
std::vector<std::string> unit_warnings(const SpeedProbe& probe, const Import& import, const MachineFile& machine);

}  // namespace dqw
#endif
