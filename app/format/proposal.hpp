// What the columns of a header that is no known format's may be, by the names that people give them: a proposal for
// [columns] of the machine file. Nothing is read by it.
#ifndef DQW_APP_FORMAT_PROPOSAL_HPP
#define DQW_APP_FORMAT_PROPOSAL_HPP

#include <string>
#include <vector>

#include "app/base/columns.hpp"
#include "app/format/head.hpp"

namespace dqw {

struct ProposedColumn {
    std::string name;   ///< of [columns]: t_s, i_dq_A
    std::string toml;   ///< its value
    std::string doubt;  ///< why its unit is a guess, SI or what the name says; empty: the header says it
    std::string needs;  ///< a column that it needs and that nothing is proposed for
};

/// Of the columns that are not there already, in the order of the log format.
std::vector<ProposedColumn> proposed_columns(const Head& head, const ColumnSet& has);

/// Whether a field of this name alone would be proposed for.
bool is_common_name(const std::string& field);

}  // namespace dqw
#endif
