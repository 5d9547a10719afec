#include "app/page/page.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "app/base/text.hpp"
#include "app/page/assets.hpp"
#include "app/page/html.hpp"

namespace dqw {
namespace {

const char* name_of(Plot::Kind kind)
{
    switch (kind) {
    case Plot::Kind::lines: return "lines";
    case Plot::Kind::points: return "points";
    case Plot::Kind::bars: return "bars";
    case Plot::Kind::bands: return "bands";
    case Plot::Kind::band: break;
    }
    return "band";
}

std::string plot_data(const Plot& plot)
{
    std::string out = fmt::format("{{\"kind\":\"{}\",\"x\":{},\"y\":{},\"log\":{},\"series\":[", name_of(plot.kind),
                                  script_string(plot.x_label), script_string(plot.y_label), plot.log_y);
    for (std::size_t i = 0; i < plot.series.size(); ++i) out += (i ? "," : "") + script_string(plot.series[i]);
    Columns shaded(2);
    for (const auto& [from, to] : plot.shaded) {
        shaded[0].push_back(from);
        shaded[1].push_back(to);
    }
    out += "],\"rows\":" + script_rows(plot.columns) + ",\"means\":" + script_rows(plot.means) +
           ",\"shaded\":" + script_rows(shaded) + ",\"marks\":[";
    for (const auto& [at, text] : plot.marks)
        out += fmt::format("{}[{:.8g},{}]", &at == &plot.marks.front().first ? "" : ",", at, script_string(text));
    out += "]";
    if (plot.y_range[1] > plot.y_range[0])
        out += fmt::format(",\"range\":[{:.6g},{:.6g}]", plot.y_range[0], plot.y_range[1]);
    return out + "}";
}

std::string html_list(const std::vector<std::string>& lines)
{
    std::string out = "<ul>\n";
    for (const std::string& line : lines) out += "<li>" + escaped(line) + "</li>\n";
    return out + "</ul>\n";
}

}  // namespace

std::string PagePlots::figure(const Plot& plot, const char* css)
{
    data_ += (data_.empty() ? "" : ",\n") + plot_data(plot);
    return fmt::format("<figure class=\"{0}\"><figcaption>{1}<span class=\"key\"></span></figcaption>"
                       "<div class=\"plot\" role=\"img\" aria-label=\"{1}: {2} over {3}\"></div></figure>\n",
                       css, escaped(plot.title), escaped(plot.y_label), escaped(plot.x_label));
}

std::string PagePlots::section(const PlotGroup& group)
{
    if (group.plots.empty()) return "";
    std::string out = fmt::format("<section><h2>{}</h2>{}<div class=\"plots\">\n", escaped(group.title),
                                  group.about.empty() ? "" : "<p>" + escaped(group.about) + "</p>");
    for (const Plot& plot : group.plots) out += figure(plot, "card");
    return out + "</div></section>\n";
}

std::string page_header(const std::string& about, const std::string& badge_css, const std::string& badge,
                        const std::string& verdict, const std::string& remark)
{
    return fmt::format("<header><p class=\"log\">{}</p>\n<p id=\"verdict\"><span class=\"badge {}\">{}</span> "
                       "{}</p>{}</header>\n<main>\n",
                       escaped(about), escaped(badge_css), escaped(badge), unbroken(verdict),
                       remark.empty() ? "" : "<p class=\"remark\">" + remark + "</p>");
}

std::string section(const std::string& title, const std::string& body)
{
    return "<section><h2>" + title + "</h2>\n" + body + "</section>\n";
}

std::string card(const std::string& title, const std::string& body)
{
    return "<section class=\"card\"><h2>" + title + "</h2>\n" + body + "</section>\n";
}

std::string lists_section(const std::string& title, const std::vector<std::string>& logs,
                          const std::vector<std::string>& notes)
{
    return section(title, html_list(logs) + (notes.empty() ? "" : html_list(notes)));
}

std::string page_around(const std::string& title, const std::string& body, const PagePlots& plots)
{
    std::string page = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                       "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src "
                       "'unsafe-inline'; style-src 'unsafe-inline'; "
                       "base-uri 'none'; form-action 'none'\">\n"
                       "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta "
                       "name=\"color-scheme\" content=\"light dark\">\n";
    page += "<title>" + escaped(title) + "</title>\n<style>\n";
    page.append(dygraphs_css()).append("\n").append(report_css()).append("</style>\n</head>\n<body>\n");
    page += body + "</main>\n<footer><details><summary>Plots by dygraphs</summary><pre>" + escaped(dygraphs_licence()) +
            "</pre></details></footer>\n";
    page += "<script type=\"application/json\" id=\"plots\">[" + plots.data() + "]</script>\n<script>\n";
    page.append(dygraphs_js())
        .append("\n</script>\n<script>\n")
        .append(report_js())
        .append("</script>\n</body>\n</html>\n");
    return page;
}

std::string grouped(std::size_t n)
{
    std::string out = std::to_string(n);
    for (std::size_t at = out.size(); at > 3;) out.insert(at -= 3, "\u202f");
    return out;
}

std::string names_of_files(const std::vector<std::string>& paths)
{
    std::vector<std::string> names;
    for (const std::string& path : paths) names.push_back(std::filesystem::path(path).filename().string());
    return list(names, 4);
}

}  // namespace dqw
