// A flux map as numbers over a grid of currents: plain data, and the least current for a torque.
#ifndef DQW_REF_EFFECT_PLANE_HPP
#define DQW_REF_EFFECT_PLANE_HPP

#include <cstddef>
#include <vector>

namespace dqw {

struct FluxNode {
    double psi_d_Wb = 0, psi_q_Wb = 0, sd_d_Wb = 0, sd_q_Wb = 0;
    double L_dd_H = 0, L_dq_H = 0, L_qq_H = 0;  ///< incremental
    bool seen = false;                          ///< the log was here
    double sd_dd_H = 0, sd_qq_H = 0;            ///< of L_dd, L_qq
};

/// Turns of one phase that are shorted beside the iron, as a conductance across all of them, (E120); 0: none are known
/// of.
struct ShortedTurns {
    double conductance_S = 0, sd_S = 0, axis_rad = 0;
};

/// Empty: there is none.
struct FluxMap {
    std::vector<double> i_d_A, i_q_A;  ///< ascending, zero among each
    std::vector<FluxNode> nodes;       ///< row-major in i_d
    ShortedTurns shorted;              ///< what they draw is not in the fluxes

    bool empty() const { return nodes.empty(); }
    const FluxNode& at(std::size_t d, std::size_t q) const { return nodes[d * i_q_A.size() + q]; }
};

/// Flux linkages between four nodes, exact where they are quadratic, (E144); seen where all four are. Beyond the grid
/// it is that of the nearest cell, not seen.
FluxNode between(const FluxMap& map, double i_d_A, double i_q_A);

/// Torque at least current, (E145).
struct LeastCurrent {
    double torque_Nm = 0, i_d_A = 0, i_q_A = 0, i_A = 0;
};

/// Positive torques, ascending, as far as the least current lies where the log was; empty where it nowhere does.
std::vector<LeastCurrent> mtpa(const FluxMap& map, double pole_pairs);

/// The current on the q axis alone that makes this torque; NaN where the map does not have it where the log was.
double current_without_d(const FluxMap& map, double pole_pairs, double torque_Nm);

}  // namespace dqw
#endif
