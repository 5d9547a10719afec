// Columns that are in another unit, of another sign or another convention than they say, as far as physics shows it.
#ifndef DQW_APP_READ_COLUMN_DOUBTS_HPP
#define DQW_APP_READ_COLUMN_DOUBTS_HPP

#include <string>
#include <vector>

#include "app/read/voltage_fit.hpp"

namespace dqw {

struct Doubt {
    std::vector<Column> columns;
    std::string looks_like;  ///< "mA", "the electrical speed in rad/s", "the sign of i_q turned"
    std::string evidence;
    std::string correction;  ///< behind `from = "…", `: `unit = "mA"`; empty: said by looks_like
    bool of_time_or_speed() const;
};

/// (E135). What is not in doubt, and what cannot be told, is not in the list; a speed in rpm is evidence_of_rpm's.
std::vector<Doubt> column_doubts(const SpeedProbe& probe, const Machine& machine);

}  // namespace dqw
#endif
