// Fewer points for the eye: what is drawn is thinned, what is computed never.
#ifndef DQW_APP_PAGE_THIN_HPP
#define DQW_APP_PAGE_THIN_HPP

#include <cstddef>
#include <vector>

namespace dqw {

/// Columns of equal length; the first is x. A NaN is a point that is not there.
using Columns = std::vector<std::vector<double>>;

/// At most `most` rows that keep each column's extremes: two rows for each bucket of neighbours, in the order in which
/// its columns' extremes come. x increases.
Columns extremes(const Columns& columns, std::size_t most);

/// At most `most` rows drawn at random without regard to order, the same each time, then sorted by x. Even steps would
/// beat with what repeats.
Columns sampled(const Columns& columns, std::size_t most);

/// Means over `bins` equal parts of the range of x; bins of fewer than `least` rows are left out.
Columns bin_means(const Columns& columns, std::size_t bins, std::size_t least);

}  // namespace dqw
#endif
