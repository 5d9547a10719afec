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
    const std::string& data() const { return data_; }

private:
    std::string data_;
};

/// The whole page around `body`, which is HTML from <header> to </main>. It asks for nothing from outside, and says so
/// in a content security policy.
std::string page_around(const std::string& title, const std::string& body, const PagePlots& plots);

/// 1 000 000 with narrow spaces.
std::string grouped(std::size_t n);

/// An HTML list of lines.
std::string html_list(const std::vector<std::string>& lines);

/// File names without their folders, escaped by nobody yet.
std::string names_of_files(const std::vector<std::string>& paths);

}  // namespace dqw
#endif
