// What double and ceres::Jet have in common.
#ifndef DQW_REF_MODEL_JETS_HPP
#define DQW_REF_MODEL_JETS_HPP

#include <ceres/jet.h>

namespace dqw {

inline double value_of(double x) { return x; }
template <int N> double value_of(const ceres::Jet<double, N>& x) { return x.a; }

/// x clamped to [0, 1]; beyond, its derivative is zero.
template <typename T> T on_unit(const T& x) { return value_of(x) < 0.0 ? T(0.0) : value_of(x) > 1.0 ? T(1.0) : x; }

}  // namespace dqw
#endif
