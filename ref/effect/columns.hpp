// Columns of a log that effects need: angle, temperatures, heating states.
#ifndef DQW_REF_EFFECT_COLUMNS_HPP
#define DQW_REF_EFFECT_COLUMNS_HPP

#include <vector>

#include "ref/effect/input.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// Columns that a log brings for effects, or what stands in for them.
struct TraceColumns {
    std::vector<double> cos_e, sin_e;          ///< of the angle: measured, or integrated from 0
    std::vector<double> cos_m, sin_m;          ///< of the shaft's angle: measured, or turns counted; empty: not known
    std::vector<double> w_dot;                 ///< slope of the electrical speed over some rows, rad/s^2
    std::vector<double> winding_K, magnet_K;   ///< above 25 degC; empty without the column
    std::vector<std::vector<float>> heat;      ///< heating states (E55), one for each time constant
    std::vector<double> part;                  ///< of the log's length that is past
    std::vector<std::vector<float>> source_W;  ///< power that a link's source gives, one for each time constant, (E118)
    std::vector<std::vector<double>>
        own_heat;  ///< of settled rows without time: where the currents leave the state, one for each memory (E170)
};

constexpr double kReferenceTemperature_C = 25.0;
/// Time constants of heating states, over the length of the log: Input::heat counts from 1 those that the currents heat,
/// then as many that one power heats all the time. (E126)
constexpr double kHeatTimes[] = {0.05, 0.07, 0.1, 0.14, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.5, 20.0};
constexpr int kHeatsOfAKind = static_cast<int>(sizeof kHeatTimes / sizeof *kHeatTimes), kHeats = 2 * kHeatsOfAKind;
/// Those that a search begins with, each way.
constexpr int kSoughtHeats[] = {1, 6, 10, 13};
/// Whether a heating state goes with time, whatever the currents are.
inline bool by_time(const Input& input) { return input.heat > kHeatsOfAKind && input.heat <= kHeats; }
/// Time constants of a link's capacitor behind its source's resistance, in periods; and those that a search begins with.
constexpr double kLinkTimes[] = {1.5,  2.0,  2.6,  3.4,  4.5,  6.0,   8.0,   10.0,  13.0,  17.0,
                                 23.0, 30.0, 40.0, 55.0, 75.0, 100.0, 160.0, 300.0, 1000.0};
constexpr int kLinks = static_cast<int>(sizeof kLinkTimes / sizeof *kLinkTimes);
constexpr int kSoughtLinks[] = {4, 9, 14, 18};

/// Time constants of settled rows without time, in rows: what a row remembers of those before. (E170)
constexpr double kOwnHeatRows[] = {0.0, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0};
constexpr int kOwnHeats = static_cast<int>(sizeof kOwnHeatRows / sizeof *kOwnHeatRows);
/// Input::heat of the first of them. As many follow for rows of a grid that were measured across the file's order.
constexpr int kOwnHeat = kHeats + 1, kOwnHeatAcross = kOwnHeat + kOwnHeats;

/// Rows of a grid of currents, as they stand in the file, in the order in which the axis that changes from row to row
/// there is the one that changes last; empty where they are none.
std::vector<std::size_t> rows_across(const Log& log, double i_base_A);

/// `pole_pairs`: 0 where they are not known; then no turn of the shaft is. `period_s`: of kLinkTimes; 0: the log's own.
TraceColumns trace_columns(const Log& log, double pole_pairs, double i_base_A, double span_s, double period_s = 0.0);

/// State of a Moment at row k, in the law's own unit: the log's temperature above 25 degC or a heating state; the power
/// that a link's source gives; 0 of a law without.
double state_at(const TraceColumns& columns, const Input& input, std::size_t k);

}  // namespace dqw
#endif
