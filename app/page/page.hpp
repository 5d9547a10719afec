// What every page has: one file that opens offline, with the library that draws its plots.
#ifndef DQW_APP_PAGE_PAGE_HPP
#define DQW_APP_PAGE_PAGE_HPP

#include <string>
#include <vector>

#include "app/page/plot.hpp"

namespace dqw {

/// Collects the plots' data while the body is written.
class PagePlots {
public:
    /// A place for a plot; the page's script draws it. `css` is the figure's class.
    std::string figure(const Plot& plot, const char* css);
    /// A section of plots, each in a card, under its heading; empty without plots.
    std::string section(const PlotGroup& group);
    const std::string& data() const { return data_; }

private:
    std::string data_;
};

/// How much of a page: all, or what comes first in it, which is a page too.
enum class Extent { whole, first_screen };

/// How plots are handled.
constexpr const char* kPlotHint =
    "Drag over a plot to zoom in, double-click to see all of it again; point at it for its values.";

/// The page's head up to <main>: a line about the log, the verdict behind its badge, and HTML below it.
std::string page_header(const std::string& about, const std::string& badge_css, const std::string& badge,
                        const std::string& verdict, const std::string& remark = "");

/// A part of the page under its heading: `body` is HTML.
std::string section(const std::string& title, const std::string& body);
/// The same in a frame.
std::string card(const std::string& title, const std::string& body);

/// The page's last section: logs, and notes where there are any.
std::string lists_section(const std::string& title, const std::vector<std::string>& logs,
                          const std::vector<std::string>& notes);

/// The whole page around `body`, which is HTML of page_header() and what follows up to </main>. It asks for nothing
/// from outside, and says so in a content security policy.
std::string page_around(const std::string& title, const std::string& body, const PagePlots& plots);

/// 1 000 000 with narrow spaces.
std::string grouped(std::size_t n);

/// File names without their folders, escaped by nobody yet.
std::string names_of_files(const std::vector<std::string>& paths);

}  // namespace dqw
#endif
