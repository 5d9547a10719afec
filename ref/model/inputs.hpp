// The columns that effects add to a sweep.
#ifndef DQW_REF_MODEL_INPUTS_HPP
#define DQW_REF_MODEL_INPUTS_HPP

#include <vector>

#include "ref/effect/columns.hpp"
#include "ref/model/model.hpp"

namespace dqw {

/// What one unit of each weight of a law takes; made once for many rows.
struct Units {
    Vector2 f[kMostWeights], g[kMostWeights];
};

/// R and psi as the winding and the magnet are at row k: what else there is meets those. (E182)
inline void put_state(const std::vector<Term>& terms, const TraceColumns& c, std::size_t k, Moment& m)
{
    for (const Term& t : terms) {
        if (t.input.law == Law::skin_effect) m.R += t.weights[0] * m.w_e * m.w_e;
        if (t.input.law == Law::winding_temperature) m.R += t.weights[0] * state_at(c, t.input, k);
        if (t.input.law == Law::magnet_temperature) m.warm_Wb += t.weights[0] * state_at(c, t.input, k);
        if (t.input.law == Law::voltage_scale) m.source_W = state_at(c, t.input, k);
    }
    m.psi += m.warm_Wb;
    if (m.settled) m.warm_Wb = 0.0;
}

/// What of the voltage the terms take before it reaches the machine. It turns along with the rotor: of what stands still
/// it is the jumps as well. (E182)
inline void put_lost(const std::vector<Term>& terms, Moment& m)
{
    Vector2 f, g;
    m.state = m.source_W;
    for (const Term& t : terms)
        if (loses_voltage(t.input.law)) evaluate_sum(t.input, t.weights.data(), m, f, g);
    m.lost = f;
    if (m.settled) return;
    const Angle back(-m.w_e * m.period_s);
    Vector2 now = f;
    for (int n = 0; n < m.past; ++n) {
        Vector2& change = m.change[n];
        const Vector2 before = back.on(now);
        change.d -= now.d - before.d, change.q -= now.q - before.q;
        now = before;
    }
}

inline bool loses_what_flows(const Input& input) { return is_dead_time(input.law) && !input.averaged; }
inline bool asks_what_flows(const Input& input) { return loses_what_flows(input) || bends(input.law); }

/// What dead times take of the voltage at the currents here, as laws of the current; and what at the edges of the period
/// that starts here. (E182)
inline Vector2 lost_in_legs(const std::vector<Term>& terms, const Moment& at, bool at_edges)
{
    Vector2 f, g;
    Moment m = at;
    m.starts = at_edges, m.ends = false;
    for (const Term& t : terms)
        if (loses_what_flows(t.input) && (t.input.loss == LossLaw::edges) == at_edges)
            evaluate_sum(t.input, t.weights.data(), m, f, g);
    // The mean of a period counts at its start alone, and there twice.
    return at_edges ? Vector2{0.5 * f.d, 0.5 * f.q} : f;
}

/// What currents a sensor tells more, of the flux that takes it back.
inline Vector2 told_more(const Moment& m, Vector2 g)
{
    const Vector2 of = m.ahead.on(g);
    return m.ahead.back({-of.d / m.Ld, -of.q / m.Lq});
}

/// The currents that sensors tell more than flows. (E195)
inline void put_told(const std::vector<Term>& terms, const TraceColumns& c, std::size_t k, Moment& m)
{
    Vector2 f, g;
    for (const Term& t : terms) {
        if (!tells_other_currents(t.input)) continue;
        m.state = state_at(c, t.input, k);
        evaluate_sum(t.input, t.weights.data(), m, f, g);
    }
    m.told_more = told_more(m, g);
}

/// What there is more for one unit of a sensor's weight, whose flux is g: of flux by the iron's bend, of what dead times
/// lose by difference.
inline void add_by_sensor(const std::vector<Term>& terms, const Moment& at, Vector2& f, Vector2& g)
{
    const Vector2 more = told_more(at, g), in_iron = at.ahead.on(more),
                  bent = at.ahead.back({at.bend_dd_H * in_iron.d + at.bend_dq_H * in_iron.q,
                                        at.bend_dq_H * in_iron.d + at.bend_qq_H * in_iron.q});
    g.d -= bent.d, g.q -= bent.q;
    const double size = std::hypot(more.d, more.q);
    for (const Term& t : terms) {
        if (!loses_what_flows(t.input) || !(size > 0.0)) continue;
        // Of a width: a difference bends by as much, and rounds to 1e-13.
        constexpr double kStep = 1e-3;
        const double step = kStep * t.input.shape[0] / size;
        Moment moved = at;
        moved.told_more.d += step * more.d, moved.told_more.q += step * more.q;
        // As much at the start, as seen from the stator.
        moved.past_more_alpha += step * (at.cos_e * more.d - at.sin_e * more.q);
        moved.past_more_beta += step * (at.sin_e * more.d + at.cos_e * more.q);
        Vector2 f0, f1, of_g;
        evaluate_sum(t.input, t.weights.data(), at, f0, of_g);
        evaluate_sum(t.input, t.weights.data(), moved, f1, of_g);
        f.d += (f1.d - f0.d) / step, f.q += (f1.q - f0.q) / step;
    }
}

/// Hands put(f, g) the voltage f and the flux g that one unit of each weight and free shape of the terms, and of each
/// weight of the candidates, takes at row k, in the order of a sweep's columns. A shape's by difference. Sets the
/// moment's state.
template <typename Put>
void put_inputs(const std::vector<Term>& terms, const std::vector<Input>& candidates, const TraceColumns& c,
                std::size_t k, Moment& m, Units& units, Put&& put)
{
    Vector2 *const f = units.f, *const g = units.g;
    for (const Term& t : terms) {
        m.state = state_at(c, t.input, k);
        evaluate(t.input, m, f, g, t.weights.data());
        const int weights = weights_of(t.input.law), shapes = free_shapes_of(t.input);
        for (int w = 0; w < weights; ++w) {
            if (tells_other_currents(t.input)) add_by_sensor(terms, m, f[w], g[w]);
            put(f[w], g[w]);
        }
        if (shapes == 0) continue;
        Vector2 f0, g0;
        if (is_dead_time(t.input.law)) {
            for (int w = 0; w < weights; ++w) {
                const double by = t.weights[static_cast<std::size_t>(w)];
                f0.d += by * f[w].d, f0.q += by * f[w].q;
            }
        } else {
            evaluate_sum(t.input, t.weights.data(), m, f0, g0);
        }
        for (int s = 0; s < shapes; ++s) {
            Input moved = t.input;
            // Of a width, or in rad: a difference bends by as much, and rounds to 1e-13.
            constexpr double kStep = 1e-3;
            const std::size_t at = free_shape_of(t.input, s);
            const double step = is_angle(t.input, at) ? kStep : kStep * t.input.shape[at];
            moved.shape[at] += step;
            Vector2 f1, g1;
            evaluate_sum(moved, t.weights.data(), m, f1, g1);
            put({(f1.d - f0.d) / step, (f1.q - f0.q) / step}, {(g1.d - g0.d) / step, (g1.q - g0.q) / step});
        }
    }
    for (const Input& input : candidates) {
        m.state = state_at(c, input, k);
        evaluate(input, m, f, g);
        const int weights = weights_of(input.law);
        for (int w = 0; w < weights; ++w) {
            if (tells_other_currents(input)) add_by_sensor(terms, m, f[w], g[w]);
            put(f[w], g[w]);
        }
    }
}

}  // namespace dqw
#endif
