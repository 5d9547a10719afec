// A result in the numbers of data sheets, and as the settings of common controllers.
#ifndef DQW_APP_REPORT_DATASHEET_HPP
#define DQW_APP_REPORT_DATASHEET_HPP

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

struct ControllerSettings {
    std::string controller;  ///< "VESC"
    std::vector<std::string> lines;
};

/// (E155): Kv_rpm_V (line-to-line peak), Kt_Nm_A (per ampere of i_q), R_line_to_line_ohm, and by how many kelvin R and
/// psi say that the machine is warmer than where `nominal` had its own; as far as the result has what they are made of.
std::vector<Estimate> datasheet_numbers(const Result& result, const Machine& nominal = {});

/// The same parameters as each controller names and counts them; only what is usable, and nothing without
/// pole pairs.
std::vector<ControllerSettings> controller_settings(const Result& result);

/// Both, as the object `datasheet`; empty where there is none.
nlohmann::ordered_json datasheet_json(const Result& result, const Machine& nominal = {});

/// Both, for people; empty where there is none.
std::string datasheet_text(const Result& result, const Machine& nominal = {});

}  // namespace dqw
#endif
