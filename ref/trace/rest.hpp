// What a residual is made of: the noise that the log itself shows, and what the rest goes with.
#ifndef DQW_REF_TRACE_REST_HPP
#define DQW_REF_TRACE_REST_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

/// (E46). Block RMS that the sensors' noise alone would leave, all axes together.
/// Dynamic and mechanical: the single rows' residual in the upper half band, where slow structure is not, told apart
/// into noise of the state's sensor (differenced) and of the input (white), with the speed sensor's own noise beside
/// them.
/// Settled: second differences of rows that follow one another.
double noise_floor(const TraceSetup& setup, const Point& at);

/// What each axis' residual goes with, strongest first; shares below 5 % are left out.
std::vector<TraceCorrelate> correlates(const TraceSetup& setup, const std::vector<ReportBlock>& blocks, double floor);

/// Amplitude over order of the angle and over frequency, of the residual of `before` and `after`.
std::vector<TraceSpectrum> spectra(const TraceSetup& setup, const std::vector<ReportBlock>& before,
                                   const std::vector<ReportBlock>& after);

/// A fault of the record itself (held rows, clipped currents), in words; empty where there is none.
std::string record_fault(const std::vector<Log>& logs);

double rms_of(const std::vector<ReportBlock>& blocks, int channels);

}  // namespace dqw
#endif
