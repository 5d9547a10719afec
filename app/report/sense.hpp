// Does an estimate make sense? What the estimators cannot see of themselves, said before a number is believed.
#ifndef DQW_APP_REPORT_SENSE_HPP
#define DQW_APP_REPORT_SENSE_HPP

#include <string>
#include <vector>

#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// Takes back what cannot be a parameter, and warns where the model does not hold:
/// a dynamic log whose currents and speed stay within their own noise is one operating point, which tells R, L and psi
/// from each other no better than one equation; R, L, psi and J are positive; a residual above 5 % of an axis' voltage
/// (torque) is no noise, and the values take up what the model lacks. What slips is allowed for; what an observer hides is
/// taken back too.
void check_sense(const std::vector<Log>& logs, Result& result);

/// Where the electrical angle turns otherwise than pole pairs times the speed by two parts in a hundred or more, one of
/// both is wrong, and no parameter is known better than by that part. The note that says so; empty where nothing slips.
std::string allow_for_slip(const std::vector<Log>& logs, std::vector<Estimate>& parameters);

}  // namespace dqw
#endif
