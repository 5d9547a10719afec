// A plot as data: what the pages of trace and monitor draw.
#ifndef DQW_APP_PAGE_PLOT_HPP
#define DQW_APP_PAGE_PLOT_HPP

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "app/page/thin.hpp"

namespace dqw {

/// One plot; every label carries its unit. A series' name is also that of its colour in page.css.
struct Plot {
    enum class Kind { lines, points, bars, band, bands };
    Kind kind = Kind::lines;
    std::string title, x_label, y_label;
    std::vector<std::string> series;  ///< of columns[1] and those after it
    Columns
        columns;    ///< at most 2000 rows; of a band: x, value, its lower and upper bound, and a second line; of bands:
                    ///< each series' value, lower and upper bound
    Columns means;  ///< of the points: means along x, from all blocks
    std::vector<std::array<double, 2>> shaded;          ///< stretches of x: rows that no fit saw, or out of service
    std::vector<std::pair<double, std::string>> marks;  ///< upright lines
    std::array<double, 2> y_range{};                    ///< what is shown at first; empty: all
    bool log_y = false;
};

/// What is shown at first of values from `low` to `high`: at least `least` of them, and some room; empty for none.
std::array<double, 2> range_around(double low, double high, double least);

/// Puts all columns but x, and the range, in the prefix that the range has; returns the parameter's unit.
std::string scale(Columns& columns, std::array<double, 2>& range, const char* parameter);

struct PlotGroup {
    std::string title, about;
    std::vector<Plot> plots;
};

}  // namespace dqw
#endif
