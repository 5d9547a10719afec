// The residual that dqwatch reports for every model, whoever estimated it (no Ceres).
#ifndef DQW_REF_LOG_RESIDUAL_HPP
#define DQW_REF_LOG_RESIDUAL_HPP

#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// Parameters of the plain model; a NaN term (not identifiable) counts as zero.
struct PlainModel {
    double pole_pairs = 1, R_ohm = 0, Ld_H = 0, Lq_H = 0, psi_Wb = 0;  ///< electrical
    double J_kgm2 = 0, B_Nms_rad = 0, torque_constant_Nm_A = 0;        ///< mechanical
    bool rotor_held = false;  ///< the voltage turns with the rotor within a period
};

/// (E43). Fills residual_rms, residual_unit and axes of `result` from all logs: v minus the model's v, averaged over
/// blocks of max(20 rows, 1 ms) in dynamic logs, 50 ms in mechanical ones, one row otherwise; L di from the block's end
/// currents.
void report_residual(const std::vector<Log>& logs, const PlainModel& model, Result& result);

/// v less the plain model's v over the period from row k to k + 1, times dt, without L di: added to d and q, Wb.
void add_period(const Log& log, const PlainModel& model, std::size_t k, double dt_s, double& d, double& q);

/// Torque of a mechanical log: torque_Nm, else K_t i_q, else torque_cmd_Nm. `source` names which.
std::vector<double> torque_of(const Log& log, double torque_constant_Nm_A, std::string& source);

}  // namespace dqw
#endif
