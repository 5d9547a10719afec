// What a point of the tracer's models means: parameters of the machine and of its effects, residuals.
#ifndef DQW_REF_TRACE_RESULT_HPP
#define DQW_REF_TRACE_RESULT_HPP

#include "ref/log/residual.hpp"
#include "ref/trace/setup.hpp"

namespace dqw {

PlainModel plain_of(const TraceSetup& setup, const Point& at);

/// Parameters of the machine and the pole pairs; `sd` as deviations() gives it. What the log cannot tell is absent.
std::vector<Estimate> base_parameters(const TraceSetup& setup, const Point& at, const Eigen::VectorXd& sd);

/// Physical parameters of the effect `name`.
std::vector<Estimate> effect_parameters(const TraceSetup& setup, const Point& at, const Eigen::VectorXd& sd,
                                        const std::string& name);

/// Of what the effect is, where it may be of several things.
void put_channel(const TraceSetup& setup, const Point& at, TraceEffect& effect);

/// RMS of each axis' reported residual, and what part it is of the axis' voltage (torque).
std::vector<AxisResidual> axes_of(const TraceSetup& setup, const std::vector<ReportBlock>& blocks);

}  // namespace dqw
#endif
