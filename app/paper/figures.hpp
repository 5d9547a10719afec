// Figs 6 to 9 as SVG, drawn by gnuplot.
#ifndef DQW_APP_PAPER_FIGURES_HPP
#define DQW_APP_PAPER_FIGURES_HPP

#include <string>
#include <vector>

namespace dqw {

struct Panel {
    std::string label;
    std::vector<double> trace;  ///< one value an iteration
    double truth;
};

struct Figure {
    std::string title, name;
    std::vector<Panel> panels;
};

/// Writes each figure to out_dir/name. Returns one line that says what was written, or that gnuplot is missing.
/// Throws std::runtime_error where a file cannot be written.
std::string draw_figures(const std::vector<Figure>& figures, const std::string& out_dir);

}  // namespace dqw
#endif
