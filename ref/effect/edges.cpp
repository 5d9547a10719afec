#include "ref/effect/edges.hpp"

#include <algorithm>
#include <cmath>

#include "ref/effect/pulses.hpp"

namespace dqw {
namespace {

constexpr int kLegs = 3;
constexpr int kMostEdges = 2 * kLegs + 2;
/// Losses at edges of one dead time decide each other's: the second pass meets them.
constexpr int kPasses = 2;

struct Edge {
    int leg;
    bool rises;
    double at;   ///< of the period
    double i_A;  ///< at the end of its dead time, without any loss
    double lost = 0.0, slope = 0.0;
};

double product(const double (&row)[kLegs], const double (&x)[kLegs])
{
    return row[0] * x[0] + row[1] * x[1] + row[2] * x[2];
}

}  // namespace

EdgeLoss lost_at_edges(const Pulsed& p, double loss_V, double width_A)
{
    EdgeLoss out;
    if (!(p.link_V > 0.0)) return out;
    // Where more is given back than lost, edges are early by as much.
    const double dead = loss_V / p.link_V, window = std::max(std::abs(dead), 1e-9), flux_Vs = loss_V * p.period_s;
    Edge edges[kMostEdges];
    int count = 0;
    const auto put = [&](int leg, bool rises, double at) {
        const double end = at + std::abs(dead);
        double beyond_Vs[kLegs];
        for (int n = 0; n < kLegs; ++n)
            beyond_Vs[n] = p.link_V * pulse_beyond_mean(p.duty[n], end * p.period_s, p.period_s);
        edges[count++] = {leg, rises, at,
                          p.i_A[leg] + end * (p.slope_A[leg] + end * p.bend_A[leg]) + product(p.per_H[leg], beyond_Vs)};
    };
    if (p.rises >= 0) put(p.rises, true, 0.0);
    if (p.falls >= 0) put(p.falls, false, 0.0);
    for (int leg = 0; leg < kLegs; ++leg) {
        if (!(p.duty[leg] > 0.0 && p.duty[leg] < 1.0)) continue;
        put(leg, true, 0.5 * (1.0 - p.duty[leg])), put(leg, false, 0.5 * (1.0 + p.duty[leg]));
    }
    // Of each edge's loss, what of the others' has come by the end of its dead time, as a current.
    double by_other_A[kMostEdges][kMostEdges];
    const double by_window = 1.0 / window;
    for (int k = 0; k < count; ++k)
        for (int n = 0; n < count; ++n)
            by_other_A[k][n] = n == k ? 0.0
                                      : std::clamp((edges[k].at + std::abs(dead) - edges[n].at) * by_window, 0.0, 1.0) *
                                            flux_Vs * p.per_H[edges[k].leg][edges[n].leg];
    for (int pass = 0; pass < kPasses; ++pass)
        for (int k = 0; k < count; ++k) {
            Edge& e = edges[k];
            // A start that is off by one is off by less at an edge once the leg's other one has taken its part.
            double i_A = e.i_A, by_start = 1.0;
            for (int n = 0; n < count; ++n) {
                i_A -= by_other_A[k][n] * edges[n].lost;
                if (edges[n].leg == e.leg) by_start -= by_other_A[k][n] * edges[n].slope;
            }
            const double half_A = 0.5 * std::abs(flux_Vs) * p.per_H[e.leg][e.leg], wide_A = half_A + width_A;
            const double x = (i_A + (e.rises ? -half_A : half_A)) / wide_A, sign = std::clamp(x, -1.0, 1.0);
            e.lost = 0.5 * (e.rises ? sign + 1.0 : sign - 1.0);
            e.slope = std::abs(x) < 1.0 ? 0.5 / wide_A * by_start : 0.0;
        }
    for (int k = 0; k < count; ++k)
        out.mean[edges[k].leg] += edges[k].lost, out.by_start[edges[k].leg] += edges[k].slope;
    // A pulse or a gap that is shorter than the dead time is lost as a whole, and no more.
    for (int leg = 0; leg < kLegs && dead > 0.0; ++leg) {
        if (!(p.duty[leg] > 0.0 && p.duty[leg] < 1.0)) continue;
        const double within = std::clamp(out.mean[leg], (p.duty[leg] - 1.0) / dead, p.duty[leg] / dead);
        if (within != out.mean[leg]) out.mean[leg] = within, out.by_start[leg] = 0.0;
    }
    return out;
}

}  // namespace dqw
