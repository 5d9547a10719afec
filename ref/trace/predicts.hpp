// Of a mechanical log: whether what a prediction found holds of the torque's means, too.
#ifndef DQW_REF_TRACE_PREDICTS_HPP
#define DQW_REF_TRACE_PREDICTS_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

/// A prediction takes the speed's noise for what it may not be, or looks at what is fast alone. Whether it stands beside
/// the averaged model's fit, `averaged`: where that leaves clearly more of the reported residual; or J and B are those
/// that the prediction's own effects have of the means, within three deviations, and no other effects leave less of the
/// means of rows held out. (E190)
bool predicts_means(const TraceSetup& setup, const Refined& averaged, const Point& predicted);

}  // namespace dqw
#endif
