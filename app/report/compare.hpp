// One log estimated three ways: what float, fixed point and the reference fit say, and how far they are apart.
#ifndef DQW_APP_REPORT_COMPARE_HPP
#define DQW_APP_REPORT_COMPARE_HPP

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/page/page.hpp"
#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// A parameter of which units and blocks tell, and its symbol.
struct Compared {
    const char *name, *symbol;
};

/// R, L_d, L_q, psi; of a mechanical log J and B. In the order of units and blocks.
const std::vector<Compared>& compared_parameters(Regime regime);

/// They after a block.
struct BlockPoint {
    double t_s;
    std::array<double, 4> value;
};

struct Comparison {
    std::string log;
    Machine nominal;
    Result reference, single, fixed;    ///< `single`: in float
    std::array<double, 4> unit{};       ///< of compared_parameters(): what 1 stands for in fixed point
    std::vector<BlockPoint> blocks[2];  ///< float's, Q15's
    std::vector<std::string> notes;
};

/// The three, and how they are called.
struct NamedResult {
    const char* who;
    const Result* result;
};
std::array<NamedResult, 3> estimates_of(const Comparison& c);

/// 100 (first - second) / second, where both know the parameter.
std::optional<double> difference_percent(const Result& first, const Result& second, const std::string& parameter);

/// Warnings: parameters on which two estimates are apart by more than three of their deviations and by a percent.
std::vector<std::string> disagreements(const std::vector<Estimate>& first, const std::string& who,
                                       const std::vector<Estimate>& second, const std::string& other);

/// The object of schema dqwatch.compare/1.
nlohmann::ordered_json compare_json(const Comparison& c);

/// The table, and what was not identifiable to whom.
std::string compare_text(const Comparison& c);

/// compare.html. Every string that may come from a file is escaped.
std::string compare_page(const Comparison& c, Extent extent = Extent::whole);

}  // namespace dqw
#endif
