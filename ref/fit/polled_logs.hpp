// Polled logs of one machine, solved together: their rows, the slow link's lag, the form that the rows can tell.
#ifndef DQW_REF_FIT_POLLED_LOGS_HPP
#define DQW_REF_FIT_POLLED_LOGS_HPP

#include <vector>

#include "ref/fit/polled_solve.hpp"
#include "ref/log/log.hpp"

namespace dqw {

struct PolledLogs {
    std::vector<PolledRow> rows;   ///< electrical
    std::vector<std::size_t> log;  ///< of each row
    std::vector<int> lag;          ///< of each log
    double noise_rad_s = 0.0;
    PolledForm form;
    PolledSolution solution;
    PolledVector sd_of_rows = PolledVector::Zero();  ///< before the inverter is allowed for
    double least_A = 0.0;                            ///< rows of less current are left out
    double inverter_V = 0.0;
};

/// (E153): noise of the speed takes that part of psi over into R, so that neither is known.
constexpr double kFollows = 0.02;

/// Whether the rows tell this weight: its deviation is small against it.
bool tells(const PolledSolution& s, int weight);

/// (E150) to (E154). Throws std::invalid_argument where rows are too few.
PolledLogs solve_logs(const std::vector<Log>& logs, double pole_pairs);

/// A log's rows under what another stretch of it gave.
PolledLogs under(const PolledLogs& of, const Log& log, double pole_pairs);

/// The settled rows of polled logs, as logs of settled points: mean speed, L di/dt taken off, channels of one instant.
/// Other logs as they are. Throws as solve_logs().
std::vector<Log> settled_logs(const std::vector<Log>& logs);

}  // namespace dqw
#endif
