// Two flux maps of one machine: where they differ, and by how many deviations.
#ifndef DQW_APP_REPORT_COMPARE_MAPS_HPP
#define DQW_APP_REPORT_COMPARE_MAPS_HPP

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "ref/effect/plane.hpp"

namespace dqw {

/// Second less first, on one axis, at the first's nodes that both saw.
struct AxisDifference {
    double mean_Wb = 0, rms_percent = 0;               ///< of the largest flux of the first
    double beyond_two = 0, beyond_three = 0;           ///< parts of the nodes
    double most_deviations = 0, i_d_A = 0, i_q_A = 0;  ///< where it is most
};

/// What turns shorted in one machine and not so in the other draw.
struct ShortDifference {
    double change_S = 0, deviations = 0;  ///< as vectors of twice the phase's angle; 0: none in either
    ShortedTurns first, second;
};

struct MapComparison {
    std::size_t nodes = 0;               ///< seen by both
    bool deviations = false;             ///< known of either
    double flux_Wb = 0;                  ///< the largest of the first
    std::array<AxisDifference, 2> axis;  ///< d, q
    ShortDifference shorted;             ///< iron is the same beside shorted turns
    bool shorts() const { return shorted.deviations > 3; }
    /// More nodes are apart than chance makes: a tenth of an axis' beyond three deviations.
    bool bends_apart() const { return deviations && (axis[0].beyond_three > 0.1 || axis[1].beyond_three > 0.1); }
    bool differ() const { return bends_apart() || shorts(); }
};

MapComparison compare_maps(const FluxMap& first, const FluxMap& second);

/// Schema dqwatch.compare_map/1.
nlohmann::ordered_json compare_maps_json(const MapComparison& c);
std::string compare_maps_text(const MapComparison& c);
/// Its sentence; its table, the first row of which names the columns.
std::string compare_maps_sentence(const MapComparison& c);
std::vector<std::vector<std::string>> compare_maps_rows(const MapComparison& c);

}  // namespace dqw
#endif
