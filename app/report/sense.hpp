// Does an estimate make sense? What the estimators cannot see of themselves, said before a number is believed.
#ifndef DQW_APP_REPORT_SENSE_HPP
#define DQW_APP_REPORT_SENSE_HPP

#include <vector>

#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// Takes back what cannot be a parameter, and warns where the model does not hold:
/// a dynamic log whose currents and speed stay within their own noise is one operating point, which tells R, L and psi
/// from each other no better than one equation; R, L, psi and J are positive; a residual above 5 % of an axis' voltage
/// (torque) is no noise, and the values take up what the model lacks.
void check_sense(const std::vector<Log>& logs, Result& result);

}  // namespace dqw
#endif
