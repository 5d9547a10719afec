#include "app/paper/figures.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "app/base/output.hpp"

namespace dqw {
namespace {

void send(std::FILE* to, const std::string& text) { std::fwrite(text.data(), 1, text.size(), to); }

// gnuplot's single-quoted strings double the quote.
std::string quoted(const std::string& text)
{
    std::string out = "'";
    for (char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
    return out + "'";
}

void draw(std::FILE* gnuplot, const Figure& f, const std::filesystem::path& path)
{
    send(gnuplot, fmt::format("set terminal svg size 760,{} font 'sans,13' background rgb 'white'\nset output {}\n",
                              170 * f.panels.size() + 40, quoted(path.string())));
    send(gnuplot, fmt::format("set multiplot layout {},1 title {}\nset grid\nset lmargin 12\n", f.panels.size(),
                              quoted(f.title)));
    for (std::size_t i = 0; i < f.panels.size(); i++) {
        const Panel& p = f.panels[i];
        send(gnuplot, fmt::format("set ylabel {}\nset xlabel '{}'\n$p << EOD\n", quoted(p.label),
                                  i + 1 == f.panels.size() ? "iteration" : ""));
        for (std::size_t k = 0; k < p.trace.size(); k++)
            if (std::isfinite(p.trace[k])) send(gnuplot, fmt::format("{} {:.6g}\n", k + 1, p.trace[k]));
        send(gnuplot, "EOD\n");
        // The first iterations of one over a weight are off any scale; the axis shows the truth and the last four
        // fifths.
        double low = p.truth;
        double high = p.truth;
        for (std::size_t k = p.trace.size() / 50; k < p.trace.size(); k++) {
            low = std::fmin(low, p.trace[k]);
            high = std::fmax(high, p.trace[k]);
        }
        // At least two per cent of room: closer, nothing but rounding would be seen.
        const double room = std::fmax(0.1 * (high - low), 2e-2 * std::fabs(p.truth) + 1e-9);
        send(gnuplot, fmt::format("plot [1:{}] [{:.6g}:{:.6g}] {:.9g} title 'truth' lw 1 lc rgb '#888888', $p with "
                                  "lines title 'learned' lw 2 lc rgb '#1f5fa8'\n",
                                  p.trace.size(), low - room, high + room, p.truth));
    }
    send(gnuplot, "unset multiplot\nunset output\n");
}

}  // namespace

std::string draw_figures(const std::vector<Figure>& figures, const std::string& out_dir)
{
    make_directory(out_dir);
    if (std::system("command -v gnuplot >/dev/null 2>&1") != 0) return "Figures not drawn: gnuplot is not installed.";
    std::FILE* gnuplot = popen("gnuplot >/dev/null 2>&1", "w");
    if (gnuplot == nullptr) throw std::runtime_error("gnuplot cannot be started");
    for (const Figure& f : figures) draw(gnuplot, f, std::filesystem::path(out_dir) / f.name);
    const bool done = pclose(gnuplot) == 0;
    std::string names;
    for (const Figure& f : figures) {
        const auto path = std::filesystem::path(out_dir) / f.name;
        if (!done || !std::filesystem::exists(path)) throw std::runtime_error(path.string() + ": cannot be written");
        names += (names.empty() ? "" : ", ") + path.string();
    }
    return "Figures: " + names;
}

}  // namespace dqw
