// Currents that firmware filters before it logs them: what they were before, and by how many rows. (E197)
#ifndef DQW_REF_TRACE_FIRMWARE_FILTER_HPP
#define DQW_REF_TRACE_FIRMWARE_FILTER_HPP

#include <optional>
#include <vector>

#include "ref/log/log.hpp"
#include "ref/model/model.hpp"

namespace dqw {

/// `y_k = y_{k-1} + (i_k - y_{k-1})/(1 + rows)`, of the rotor's axes, or of the stator's.
struct FirmwareFilter {
    double rows = 0.0;  ///< late in the mean
    double sd = 0.0;    ///< of them
    bool stator = false;
};

/// The same logs with the currents from before the filter; those of a stretch's first row as the next has them.
std::vector<Log> before_filter(const std::vector<Log>& logs, double pole_pairs, const FirmwareFilter& filter);

struct FilterFit {
    FirmwareFilter filter;
    double nats_each = 0.0;  ///< log-likelihood of a row's currents as logged, the mean
    double rows = 0.0;       ///< of which
    Eigen::VectorXd base;    ///< beside it
    Eigen::VectorXd moves;   ///< of the base, what one deviation of the rows moves it by
    Eigen::VectorXd frames;  ///< and what the other axes do, where nothing tells them
};

/// (E197). Log-likelihood of a row's currents as logged, the mean, beside such a filter and what a few passes fit with
/// it; of a fit that fails -inf.
double nats_each_beside(const std::vector<Log>& logs, double pole_pairs, const Point& start,
                        const FirmwareFilter& filter);

/// (E197). The filter that makes the currents as logged likeliest under the machine and effects of `start`, fitted anew
/// beside it, near `rows`, of the axes that make them likelier; nothing where they are likeliest without. Where the axes
/// make no difference, what they move everything by is in the deviations; where they do, an instant of another part of
/// the row that is a microsecond late at most is beside it, if that is likelier and `sampling` is.
/// Cost  of either axis some twenty fits, forty where hardly any noise is, and as many anew beside an instant
std::optional<FilterFit> fit_filter(const std::vector<Log>& logs, double pole_pairs, const Point& start, double rows,
                                    bool sampling);

}  // namespace dqw
#endif
