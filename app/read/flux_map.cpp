#include "app/read/flux_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <vector>

#include "app/base/input_error.hpp"
#include "app/read/csv.hpp"
#include "app/read/line_source.hpp"

namespace dqw {
namespace {

constexpr std::array<const char*, 10> kNames = {"i_d_A",   "i_q_A", "psi_d_Wb", "psi_q_Wb",   "sd_d_Wb",
                                                "sd_q_Wb", "seen",  "short_S",  "sd_short_S", "short_axis_rad"};
constexpr std::size_t kNeeded = 4, kLeastPoints = 3, kMostPoints = 1000000;

struct Point {
    std::array<double, kNames.size()> value{0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
    std::size_t line = 0;
};

std::vector<Point> points_of(const std::string& path)
{
    if (std::error_code error; !std::filesystem::is_regular_file(path, error))
        throw InputError(path, 0, "cannot be opened; expected a flux map (CSV)");
    LineSource source(path);
    std::string_view line;
    if (!source.next(line)) throw InputError(path, 1, "empty; a flux map has i_d_A,i_q_A,psi_d_Wb,psi_q_Wb");
    const char separator = separator_of(line);
    const std::vector<std::string> header = split(line, separator);
    std::array<std::size_t, kNames.size()> at{};
    for (std::size_t c = 0; c < kNames.size(); ++c) {
        at[c] = static_cast<std::size_t>(std::find(header.begin(), header.end(), kNames[c]) - header.begin());
        if (at[c] == header.size() && c < kNeeded)
            throw InputError(path, 1,
                             fmt::format("no column {}; a flux map has i_d_A,i_q_A,psi_d_Wb,psi_q_Wb", kNames[c]));
    }
    std::vector<Point> points;
    while (source.next(line)) {
        const std::vector<std::string> field = split(line, separator);
        if (field.size() == 1 && field.front().empty()) continue;
        Point p;
        p.line = source.line_number();
        for (std::size_t c = 0; c < kNames.size(); ++c) {
            if (at[c] == header.size()) continue;
            if (at[c] >= field.size() || parse_number(field[at[c]], p.value[c]) != NumberError::none)
                throw InputError(path, p.line,
                                 fmt::format("{} is '{}', not a finite number", kNames[c],
                                             at[c] < field.size() ? field[at[c]].substr(0, 40) : ""));
        }
        if (points.size() == kMostPoints) throw InputError(path, p.line, "more than a million points");
        points.push_back(p);
    }
    if (points.empty()) throw InputError(path, source.line_number(), "no points");
    return points;
}

/// In the order of a grid, row-major in i_d.
void check_grid(const std::string& path, const std::vector<Point>& points, const FluxMap& map)
{
    const std::size_t n_q = map.i_q_A.size();
    for (std::size_t k = 0; k < points.size(); ++k) {
        const auto& v = points[k].value;
        if (k > 0 && v[0] == points[k - 1].value[0] && v[1] == points[k - 1].value[1])
            throw InputError(
                path, points[k].line,
                fmt::format("i_d_A = {}, i_q_A = {} is there twice (line {})", v[0], v[1], points[k - 1].line));
        if (k / n_q >= map.i_d_A.size() || v[0] != map.i_d_A[k / n_q] || v[1] != map.i_q_A[k % n_q])
            throw InputError(path, points[k].line,
                             fmt::format("not a full grid: each i_d_A needs each i_q_A; it breaks at i_d_A = {}, i_q_A "
                                         "= {}",
                                         v[0], v[1]));
    }
    if (points.size() != map.i_d_A.size() * n_q)
        throw InputError(path, points.back().line, "not a full grid: points are missing after this one");
    if (map.i_d_A.size() < kLeastPoints || n_q < kLeastPoints)
        throw InputError(
            path, points.back().line,
            fmt::format("a grid of {} by {} points is too coarse; 3 by 3 are needed", map.i_d_A.size(), n_q));
    if (map.i_d_A.front() > 0 || map.i_d_A.back() < 0 || map.i_q_A.front() > 0 || map.i_q_A.back() < 0)
        throw InputError(path, points.front().line, "zero current lies outside of the map");
    for (std::size_t k = 0; k < points.size(); ++k) {
        const auto rises = [&](std::size_t before, std::size_t psi, const char* with) {
            if (!(points[k].value[psi] > points[before].value[psi]))
                throw InputError(path, points[k].line,
                                 fmt::format("not monotone: {} does not rise with {} from line {} on", kNames[psi],
                                             with, points[before].line));
        };
        if (k >= n_q) rises(k - n_q, 2, kNames[0]);
        if (k % n_q > 0) rises(k - 1, 3, kNames[1]);
    }
}

/// Slope at k of values that are `stride` apart, by the line between its neighbours.
template <typename Value> double slope(const std::vector<double>& axis, std::size_t k, Value&& value)
{
    const std::size_t from = k > 0 ? k - 1 : 0, to = std::min(k + 1, axis.size() - 1);
    return (value(to) - value(from)) / (axis[to] - axis[from]);
}

}  // namespace

FluxMap read_flux_map(const std::string& path)
{
    std::vector<Point> points = points_of(path);
    std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) {
        return a.value[0] != b.value[0] ? a.value[0] < b.value[0] : a.value[1] < b.value[1];
    });
    FluxMap map;
    for (const Point& p : points) {
        if (map.i_d_A.empty() || p.value[0] != map.i_d_A.back()) map.i_d_A.push_back(p.value[0]);
        if (p.value[0] == points.front().value[0] && (map.i_q_A.empty() || p.value[1] != map.i_q_A.back()))
            map.i_q_A.push_back(p.value[1]);
        map.nodes.push_back({p.value[2], p.value[3], p.value[4], p.value[5], 0, 0, 0, p.value[6] != 0});
    }
    check_grid(path, points, map);
    const auto& first = points.front().value;
    map.shorted = {first[7], first[8], first[9]};
    for (std::size_t d = 0; d < map.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < map.i_q_A.size(); ++q) {
            FluxNode& node = map.nodes[d * map.i_q_A.size() + q];
            node.L_dd_H = slope(map.i_d_A, d, [&](std::size_t n) { return map.at(n, q).psi_d_Wb; });
            node.L_qq_H = slope(map.i_q_A, q, [&](std::size_t n) { return map.at(d, n).psi_q_Wb; });
            node.L_dq_H = 0.5 * (slope(map.i_d_A, d, [&](std::size_t n) { return map.at(n, q).psi_q_Wb; }) +
                                 slope(map.i_q_A, q, [&](std::size_t n) { return map.at(d, n).psi_d_Wb; }));
        }
    return map;
}

}  // namespace dqw
