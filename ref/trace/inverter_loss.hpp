// A dead time that was found: which legs switch, by which law its loss grows with the current, and what of the
// machine's parameters hangs on that law.
#ifndef DQW_REF_TRACE_INVERTER_LOSS_HPP
#define DQW_REF_TRACE_INVERTER_LOSS_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

/// Which legs switch, as the logs' machine files say it; empty where they say nothing, or not the same.
std::string stated_modulation(const std::vector<Log>& logs);

/// Whether that is a leg that rests.
bool states_a_rest(const std::vector<Log>& logs);

/// Voltage of the link to begin with where legs pulse, V; 0: it has its column. It is fitted: a pass of refine() halves
/// or doubles it, so from what the largest vector needs to six times that is one pass away.
double link_to_fit_V(const std::vector<Log>& logs);

/// (E114). The same point with the modulation and the law of its dead time that predict best; as it is where it has
/// none. A modulation is left only for one that the rows held out confirm; one that a machine file says, only for all
/// legs: what switches conduct through, bipolar ones, they lose in a leg that rests as well.
Refined settle_loss(const TraceSetup& setup, const Model& model, Refined found);

/// The same point with its dead time as firmware learns it: one loss of one width, by the sample's current. Costs a fit
/// where it is another.
Point as_firmware_learns(const TraceSetup& setup, const Refined& best);

/// (E114). Largest change of each column of `best` from its law of the loss to another that the rows held out do not
/// tell from it, or that fits no worse beside it than it itself does beside the noise; 0 where it has no dead time.
Eigen::VectorXd spread_over_laws(const TraceSetup& setup, const Refined& best);

/// Deviation of the machine's parameters by a loss of the inverter that the log neither shows nor excludes, (E124): of
/// `plain`, from `lossy`, the same model with a dead time. Costs two fits.
Eigen::VectorXd hidden_loss(const TraceSetup& setup, const Point& plain, const Point& lossy);

}  // namespace dqw
#endif
