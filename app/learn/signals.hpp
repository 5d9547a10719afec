// What the learners are shown of a log, row by row, and the bases that scale it.
#ifndef DQW_APP_LEARN_SIGNALS_HPP
#define DQW_APP_LEARN_SIGNALS_HPP

#include <vector>

#include "dqw_effect.h"
#include "ref/effect/found.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// Largest magnitude in all logs; 1 where a channel is zero throughout: its base only must not divide by zero.
float largest(const std::vector<Log>& logs, std::vector<double> Log::*a, std::vector<double> Log::*b);

/// Largest length of the current vector; 1 where there is no current.
double largest_current(const std::vector<Log>& logs);

/// The learners' period, s: that of the rows; 1 for settled rows, unless something heats from row to row.
float period_of(const Log& log, const std::vector<TraceInput>& inputs);

/// True where the effect goes with a heating state instead of a thermometer.
bool heats_by_current(const TraceInput& input);

/// Largest heating state in any of the logs, each from cold, by the learners' rule; 1 for an input without.
double heat_reach(const TraceInput& input, const std::vector<Log>& logs);

/// What 1 of the learners' weights of an input is in the unit of `TraceInput::weights`: a settled log's delay is in
/// seconds there, in the learners' periods here; all others are 1.
double weight_unit(const TraceInput& input, const Log& log, const std::vector<TraceInput>& inputs);

/// An electrical log's rows as samples. The angle, where an effect may need it, is theta_e_rad, else p theta_m_rad,
/// else p w_m integrated from a dead time's start angle; a magnet without a thermometer follows the winding's.
class SampleSource {
public:
    /// Where the rows of a log end whose next rows are another Log: its angle goes on.
    struct End {
        double angle_rad = 0.0, t_s = 0.0, w_m_rad_s = 0.0;
        bool any = false;
    };

    SampleSource(const Log& log, double pole_pairs, const std::vector<TraceInput>& inputs);
    /// For the next rows behind `end`, which is then theirs.
    SampleSource(const Log& log, double pole_pairs, const std::vector<TraceInput>& inputs, End& end);
    dqw_sample operator()(std::size_t row) const;

private:
    void fill(double pole_pairs, const std::vector<TraceInput>& inputs, End& end);
    const Log& log_;
    std::vector<float> theta_e_rad_;
};

/// The shaft angle of a mechanical log between -pi and pi: theta_m_rad, else w_m integrated from 0.
std::vector<float> shaft_angle_of(const Log& log);

}  // namespace dqw
#endif
