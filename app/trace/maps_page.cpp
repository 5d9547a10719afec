#include "app/trace/maps_page.hpp"

#include <fmt/format.h>

#include "app/base/text.hpp"
#include "app/page/html.hpp"
#include "app/page/page.hpp"
#include "app/trace/map_plots.hpp"

namespace dqw {

std::string maps_page(const std::array<std::string, 2>& files, const FluxMap& first, const FluxMap& second)
{
    const MapComparison c = compare_maps(first, second);
    std::string names[2] = {names_of_files({files[0]}), names_of_files({files[1]})};
    if (names[0] == names[1]) names[0] = files[0], names[1] = files[1];
    PagePlots plots;
    std::string body = page_header(
        fmt::format("{} and {} · flux maps, {} points that both saw", names[0], names[1], grouped(c.nodes)),
        c.differ() || c.nodes == 0 ? "part" : "clean", c.differ() ? "differ" : "compared", compare_maps_sentence(c));
    if (c.nodes > 0) body += card("Second less first", html_table(compare_maps_rows(c), "numbers named"));
    PlotGroup apart = difference_group(first, second), groups[2] = {map_group(first), map_group(second)};
    apart.about += " " + std::string(kPlotHint);
    body += plots.section(apart);
    for (int k = 0; k < 2; ++k) {
        groups[k].title = (k == 0 ? "First: " : "Second: ") + names[k];
        groups[k].about = "Flux linkage and incremental inductance where the log was, within two deviations.";
        body += plots.section(groups[k]);
    }
    return page_around(names[0] + " and " + names[1] + " – dqwatch compare",
                       body + lists_section("Maps", {files[0], files[1]}, {}), plots);
}

}  // namespace dqw
