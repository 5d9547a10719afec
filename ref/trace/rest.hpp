// What a residual goes with.
#ifndef DQW_REF_TRACE_REST_HPP
#define DQW_REF_TRACE_REST_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

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
