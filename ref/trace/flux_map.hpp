// From a trace that found saturation to a flux map: which law, how smooth, and what it says over the plane.
#ifndef DQW_REF_TRACE_FLUX_MAP_HPP
#define DQW_REF_TRACE_FLUX_MAP_HPP

#include "ref/effect/plane.hpp"
#include "ref/trace/setup.hpp"

namespace dqw {

/// The law of `own_map` or `cross_map` over a log's currents, hardly stiff.
Input map_input(const TraceSetup& setup, Law law);

/// A point whose saturation, or none, is a map of both kinds, as smooth as the log allows, (E142).
Refined with_map(const TraceSetup& setup, const Model& model, const Point& at);

/// The weights of the polynomial of a map's name that comes closest to it at the log's currents: what firmware begins
/// with. `sd`, one each of the map's weights, becomes those of the polynomial.
Term polynomial_of(const TraceSetup& setup, const Term& map, std::vector<double>* sd = nullptr);

/// The map beside a point whose saturation is polynomials; not ok of others, and where a moving log saw one current.
Refined map_beside(const TraceSetup& setup, const Point& at);

/// By how much a map with other cells in place of a map, or `map` in place of polynomials (not ok: none), moves the
/// machine's parameters, (E142); zero of iron that does not bend.
Eigen::VectorXd spread_over_iron(const TraceSetup& setup, const Refined& best, const Refined& map);

/// Whether nine of ten currents lie within a tenth of the largest of one, which is `one`, A; false of none.
bool saw_one_current(const std::vector<double>& i_d_A, const std::vector<double>& i_q_A, Vector2& one);

/// The flux linkage over the currents of the logs, fitted to all rows, (E143): by a map where the rows held out confirm
/// that polynomials are not enough. Empty where the point does not bend, where the magnet's flux is not known, or where
/// a moving log saw one current: on its way there it passes others too quickly to tell.
/// `beside_polynomial`: map_beside() of the point. `unnamed`: a point that does not bend has one too where the rows held
/// out confirm it.
FluxMap flux_map_of(const TraceSetup& setup, const Refined& best, const Refined& beside_polynomial, bool unnamed);

/// Where a flux would hardly rise with its own current, which no iron does, it is made to, by a twentieth of the
/// inductance at rest, (E143).
void make_monotone(FluxMap& map);

/// The map's table in place of the polynomials that stood for it, where the point has a map.
void put_table(const Point& at, const FluxMap& map, std::vector<TraceInput>& inputs);

}  // namespace dqw
#endif
