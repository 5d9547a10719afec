// Finds what a log holds that the plain model lacks: residual, effect, the same residual again. The data behind
// dqwatch.trace/1.
#ifndef DQW_REF_TRACE_TRACE_HPP
#define DQW_REF_TRACE_TRACE_HPP

#include <functional>
#include <string>
#include <vector>

#include "ref/effect/found.hpp"
#include "ref/effect/plane.hpp"
#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// Parameters of one model, and what it leaves of the rows that its fit did not see.
struct TraceFit {
    std::vector<Estimate> parameters;
    double heldout_rms = 0.0;
    std::vector<AxisResidual> axes;  ///< of the held-out blocks
};

/// A candidate that was not taken. `heldout_rms`: what it would leave if it alone were added to the plain model (NaN:
/// not tried).
struct TraceRejected {
    std::string name;
    std::string why;
    double heldout_rms = 0.0;
};

/// The effects that the search took and that explain too little to be named. Empty: it took none, or they are named.
struct TracePartial {
    std::vector<TraceEffect> effects;
    double share = 0.0;        ///< of the residual's power above the noise that they explain
    double heldout_rms = 0.0;  ///< with them
    std::string rest;          ///< what they leave, in words
};

/// One thing that a residual goes with: "time", "angle, order 6", "i_q", "speed", "temperature", "voltage", "signs of
/// the phase currents",
/// "a line at 37 Hz". `share`: part of the residual's variance above the noise that a smooth function of it explains.
struct TraceCorrelate {
    std::string with;
    std::string axis;  ///< "d", "q" or "torque"
    double share = 0.0;
};

/// Block means of all logs, for plots: every vector has one entry for each block. Absent columns are empty.
struct TraceAxisBlocks {
    std::string axis;                     ///< "d", "q" or "torque"
    std::vector<double> measured;         ///< V or Nm
    std::vector<double> residual_before;  ///< measured less the plain model
    std::vector<double> residual_after;   ///< measured less the model with the effects found
};
struct TraceSpectrum {
    std::string axis;
    std::vector<double> order;  ///< of the electrical angle (mechanical logs: of the shaft angle); empty: no angle
    std::vector<double> before, after;                      ///< amplitude, V or Nm
    std::vector<double> frequency_Hz, before_at, after_at;  ///< amplitude over frequency; empty: no time
};
struct TraceBlocks {
    std::vector<double> t_s, theta_e_rad, i_d_A, i_q_A, w_m_rad_s, temp_C;
    std::vector<char> heldout;  ///< 1: the fit did not see it
    std::vector<TraceAxisBlocks> axes;
    std::vector<TraceSpectrum> spectra;
};

struct TraceResult {
    std::string verdict;           ///< clean, explained, partly_explained, unexplained
    double real_pole_pairs = 0.0;  ///< as the plain fit has them, where they are not known; 0: it has none
    Regime regime = Regime::dynamic;
    std::size_t rows = 0, heldout_rows = 0;
    std::string unit = "V";
    std::size_t beyond_hexagon = 0;  ///< rows that were left out: no inverter on their link makes their voltage
    double noise_floor = 0.0;        ///< block RMS that the log's own noise would leave
    TraceFit before, after;
    std::vector<TraceEffect> effects;  ///< in the order found
    TracePartial partial;              ///< where none is named
    std::vector<TraceRejected> rejected;
    std::vector<TraceCorrelate> structure;  ///< of the residual before, strongest first
    std::vector<TraceCorrelate> rest;       ///< of the residual after
    std::string rest_signature;             ///< one sentence on what remains; empty where nothing does
    std::string doubt;               ///< why the log may not be what the format says; empty: nothing speaks against it
    std::vector<std::string> notes;  ///< gaps, what could not be tested and why
    std::vector<TraceInput> inputs;  ///< of the effects found, for lib/
    FluxMap map;                     ///< where saturation was found
    std::vector<char> heldout_row;   ///< one for each row of all logs, one after the other: 1 where no fit saw it
    TraceBlocks blocks;
};

struct TraceOptions {
    std::vector<std::string> effects;           ///< try these alone; empty: the whole catalogue
    double pole_pairs = 0.0;                    ///< where no log says them; 0: found
    std::function<void(double)> progress = {};  ///< called with 0..1 now and then
};

/// Traces all logs jointly. Throws std::invalid_argument (one line) as fit() does, and where rows are too few to hold
/// some out.
TraceResult trace(const std::vector<Log>& logs, const TraceOptions& options = {});

}  // namespace dqw
#endif
