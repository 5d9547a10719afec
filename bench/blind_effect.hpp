// What a seed may put into a blind log, how large it may be, and how much of it can be seen.
#ifndef DQW_BENCH_BLIND_EFFECT_HPP
#define DQW_BENCH_BLIND_EFFECT_HPP

#include "blind.hpp"
#include "blind_setup.hpp"

namespace blind {

/// Names that may be drawn for a setup, effects of the catalogue or faults outside it.
std::vector<std::string> effects_for(const Setup& setup);
std::vector<std::string> faults_for(const Setup& setup);

/// Whether two effects may stand in one log.
bool may_join(const std::string& one, const std::string& other);

/// Largest size that is still a machine, in the law's unit.
double most_of(const std::string& name, const Setup& setup);

/// Puts an effect of this size into the scenario.
void apply(const std::string& name, double size, const Setup& setup, dqw_sim_scenario& scenario);

/// What an inverter loses, into the scenario: on its switches a dead time, else a law of the current; both signs.
void apply_dead_time(double size, const Setup& setup, dqw_sim_scenario& scenario);

/// Takes away what apply_dead_time wrote in this process.
void remove_curves();

/// v less the model's v, averaged over blocks of so many rows (0: as reported), L di from their ends: d, then q.
std::vector<double> residuals(const dqw::Log& log, const dqw::PlainModel& model, std::size_t rows = 0);

/// Base parameters that a log of this regime teaches.
std::vector<double dqw::PlainModel::*> fields_of(dqw::Regime regime);

/// Block residuals (E43) of the plain model fitted to the log itself by least squares, one axis after the other,
/// starting at the truth.
std::vector<double> best_rest(const dqw::Log& log, const dqw::PlainModel& truth);

double rms(const std::vector<double>& x);

/// Sizes each effect so that it leaves its strength over the noise floor, the second one beyond what the first one
/// explains.
/// False where one of them cannot be seen, or is too much like the other.
bool calibrate(const Setup& setup, double noise_floor, std::vector<Drawn>& effects);

}  // namespace blind
#endif
