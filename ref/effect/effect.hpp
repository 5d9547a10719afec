// The catalogue: physical effects that the plain model lacks, a row each. Plain data: no Ceres, no file format.
#ifndef DQW_REF_EFFECT_EFFECT_HPP
#define DQW_REF_EFFECT_EFFECT_HPP

#include <initializer_list>
#include <string>
#include <vector>

#include "ref/effect/found.hpp"
#include "ref/log/residual.hpp"

namespace dqw {

enum class Law {
    dead_time,
    saturation,
    cross_saturation,
    winding_temperature,
    magnet_temperature,
    iron_loss,
    flux_harmonics,
    current_offset,
    current_gain_mismatch,
    angle_offset,
    delay,
    sample_shift,
    sensor_lag,
    voltage_scale,
    skin_effect,
    phase_resistance_imbalance,
    turn_short,
    encoder_eccentricity,
    magnet_asymmetry,
    voltage_offset,
    coulomb_friction,
    direction_asymmetry,
    stribeck_friction,
    cogging_torque,
    load_torque,
    clipped_current,  ///< no effect of the catalogue: a fault of the record, tried so that nothing else is named for it
    dead_clamped,     ///< dead_time where a leg rests: with a part that does not ask which way the current flows
    dead_given_back,  ///< the same, beside what a controller gives back by the currents of the row before
    flux_map,         ///< one that was there before the log: learned by firmware, not sought
    own_map,          ///< saturation, bending cell by cell: where a polynomial is not enough
    cross_map,        ///< cross_saturation, the same
    pulsed_shift,     ///< sample_shift of currents between the legs' pulses: not under their mean voltage
    pulsed_lag,       ///< sensor_lag, the same
    pulses            ///< no effect: what the legs' pulses bend the currents by within a period; has no weight
};

/// What a law takes for given, in the order of TraceInput::shape.
enum class Shape {
    none,
    seconds,        ///< nothing; of settled rows a mark that the weight is in seconds
    current_width,  ///< a current, A, that is fitted too, and the angle at the first row
    two_widths,     ///< the same; the link, V, that is fitted too, or 0: its column; a second width, fitted too
    limit,          ///< a current, A, that is fitted too
    current_unit,   ///< of a polynomial, A
    current_cells,  ///< least and largest i_d, largest |i_q|, A; how stiff its weights are, 1/Wb^2
    flux_cells,     ///< largest flux of a table, Wb; its cells of i_d and i_q, A
    heat,           ///< T_0, degC; time constant, s; current that heats by 1, A
    R_L,            ///< R, L_d, L_q
    L_psi,          ///< L_d, L_q, psi
    order,          ///< of the electrical angle
    instant,        ///< which of `Instant` is late; R, L_d, L_q, psi
    channel,        ///< which of `Channel` lags; R, L_d, L_q, psi
    pulses,         ///< the link, V, that is fitted too, or 0: its column; the angle at the first row
    link,           ///< which of `Sag`; the link's voltage without load, V (0: unknown); largest power, W
    shaft_order,    ///< of the shaft's angle; 1 where the speed is that of the same encoder, else 0
    speed_width,    ///< a speed, rad/s, that is fitted too
    speed_widths,   ///< two of them
    periods_a_turn  ///< of the shaft
};

/// What is of another instant than the rest of its row.
enum class Instant {
    currents_before,  ///< the currents, seen while the last voltage acts
    currents_after,   ///< the same, while the row's own voltage acts
    angle,            ///< the angle in whose frame currents and voltage are written
    voltage_turned,   ///< the voltage, turned along with the rotor to when it acts
    voltage_frame     ///< the angle in whose frame the voltage alone is written
};

/// What a sensor's filter delays.
enum class Channel { currents, speed };

/// What tells how far the link has fallen, where the log takes its nominal voltage.
enum class Sag { behind_a_resistance, by_its_column };

/// What a weight is made of, in full scales.
enum class Unit { one, V, A, Wb, ohm, S, ohm_s2, s, per_W };

/// Bits: what a log must have for an effect to be tested on it.
enum Asks : unsigned {
    asks_turns = 1,     ///< the machine turns
    asks_sweep = 2,     ///< its angle covers a turn
    asks_currents = 4,  ///< the currents change
    asks_points = 8,    ///< they or the speed do
    asks_speeds = 16,   ///< the speed does
    asks_shaft = 32,    ///< the shaft makes a turn, and its angle is known
    asks_axes = 64      ///< its angle covers a turn; or it rests at a known angle, and both axes' currents change
};

/// Bits: what else is to be known of an effect.
enum Is : unsigned {
    is_mechanical = 1,     ///< of a mechanical log; else of an electrical one
    is_like_turning_v = 2  ///< looks like a voltage that is held in the rotor's frame
};

/// One physical parameter of an effect and the range outside which it is not believed.
struct EffectParameter {
    const char* name;  ///< with its SI suffix
    double least, most;
};

/// An input's weights and its shape with their deviations, to be told as physical parameters.
struct FittedInput;
using Physical = void (*)(const FittedInput& input, std::vector<Estimate>& out);

/// What a log must have, dynamic or settled: bits of `Asks`.
struct AsksOf {
    unsigned moving, settled;
    constexpr AsksOf(unsigned both) : AsksOf(both, both) {}
    constexpr AsksOf(unsigned if_moving, unsigned if_settled) : moving(if_moving), settled(if_settled) {}
};

/// An effect's input.
struct EffectInput {
    Law id;
    const char* name;
    int weights;
    Shape shape;
    Unit unit;  ///< of the weights
    AsksOf asks;
    unsigned is = 0;     ///< bits of `Is`
    double order = 0.0;  ///< times the electrical angle with which it comes and goes on the axes; -1: its shape says
};

/// What is known of an effect before a log is seen. The law is (E50) to (E55) in docs/EQUATIONS.md.
struct Effect : EffectInput {
    const char* law = "";       ///< one line, for people
    const char* separate = "";  ///< the experiment that tells it from its look-alikes
    const char* show = "";      ///< what `dqwatch sim` takes to simulate a log that tells it
    std::initializer_list<EffectParameter> parameters = {};
    /// {name} stands for that parameter with its deviation and unit; the first that finds its parameters is said
    std::initializer_list<const char*> sentences = {};
    Physical physical = nullptr;   ///< null: the parameters are the weights, then the shape
    const char* not_learned = "";  ///< why firmware's learners have no law of it; empty: they have

    bool mechanical() const { return (is & is_mechanical) != 0; }
};

/// Every effect, electrical ones first, the more common first: of two alike the earlier is taken.
const std::vector<Effect>& effects();

/// Of the record's faults too.
const Effect& effect_of(Law law);

/// nullptr where there is none of this name.
const Effect* find_effect(const std::string& name);

/// Any of the three.
inline bool is_dead_time(Law law)
{
    return law == Law::dead_time || law == Law::dead_clamped || law == Law::dead_given_back;
}
/// Either of a flux map's two.
inline bool is_map(Law law) { return law == Law::own_map || law == Law::cross_map; }
inline bool bends(Law law) { return law == Law::saturation || law == Law::cross_saturation || is_map(law); }
inline int weights_of(Law law) { return effect_of(law).weights; }
inline const char* name_of(Law law) { return effect_of(law).name; }
/// Does `a` stand before `b` in the catalogue?
inline bool stands_before(Law a, Law b) { return &effect_of(a) < &effect_of(b); }
/// Numbers of a shape that firmware's law reads.
int numbers_of(Shape shape);
/// Of a shape, how many of its first numbers are fitted along with the weights.
int free_of(Shape shape);

/// Which of its channels an effect is of: "currents", "angle", "voltage", "voltage's frame", "speed"; empty where it
/// has but one.
std::string channel_of(const TraceInput& input);
/// Whether a late voltage was turned along with the rotor.
bool is_turned(const TraceInput& input);

/// Parameters of all inputs of one effect, as effects() names them, with their deviations; shapes that were assumed are
/// `given`.
/// `sd` belongs to the weights, input by input. Of a shape that was fitted, `shape_sd[i]` is the deviation of input i's
/// first entry; else 0.
std::vector<Estimate> physical(const std::vector<TraceInput>& inputs, const std::vector<std::vector<double>>& sd,
                               const std::vector<double>& shape_sd, const PlainModel& model);

}  // namespace dqw
#endif
