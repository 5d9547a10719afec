// The inputs of the effects, (E50) to (E55), (E116) to (E121): what each adds to the voltage and to the flux linkage
// for one unit of each weight.
#ifndef DQW_REF_EFFECT_INPUT_HPP
#define DQW_REF_EFFECT_INPUT_HPP

#include <array>
#include <cmath>

#include "ref/effect/effect.hpp"
#include "ref/effect/flux_map.hpp"
#include "ref/effect/inverter.hpp"

namespace dqw {

constexpr int kMostWeights = kCrossWeights;
/// Of iron_loss, in the place of the periods by which its current follows, and of turn_short: what turning induces alone
/// drives it. (E52), (E120)
constexpr double kTurningAlone = -1.0;
/// The same, of settled points: a loss that goes with the 1.5th power of the voltage, and with the voltage itself; its
/// current then is that of the conductance where the voltage behind R is shape[1]. (E175)
constexpr double kExcessLoss = -2.0, kHysteresis = -3.0;
/// Voltages that are looked back at: of a lag of one period and a half e^-10 has not come through; without one as many
/// as a delay may be of.
constexpr int kPast = 16, kFewPast = 6;

/// A law with its shape; the weights are what is fitted. `heat` names the heating state of a temperature law: 0 is the
/// log's own temperature, -1 the winding's for a magnet, n the n-th state that the model prepared. Of a link behind a
/// resistance it names the capacitor's: 0 is none.
struct Input {
    Law law;
    std::array<double, 4> shape{};
    int heat = 0;
    bool free_angle = false;       ///< the log has no angle: that at the first row is shape[1], and fitted
    LossLaw loss = LossLaw::tanh;  ///< of a dead time
    Modulation modulation = Modulation::centred;  ///< the same
    bool averaged = false;                        ///< the same: a settled row is a mean over turns
};

/// Entries of the shape that are fitted along with the weights, and where in it the n-th of them is; whether that is an
/// angle, else it is above zero.
int free_shapes_of(const Input& input);
std::size_t free_shape_of(const Input& input, int n);
inline bool is_angle(const Input& input, std::size_t shape) { return shape == 1 && input.free_angle; }

/// Whether it is a filter that the currents pass, whose time constant is its weight.
bool filters_currents(const Input& input);

/// Whether currents are told that do not flow at the row.
bool tells_other_currents(const Input& input);
bool shifts_currents(const Input& input);

/// Whether the angle is told at another instant than the rest.
bool shifts_angle(const Input& input);

/// The inputs of a dead time with this modulation.
Input dead_time_input(Modulation modulation, double width_A, double start_angle_rad, bool free_angle);

/// Of currents told between the pulses of this modulation; `link_V` 0: the link's column.
Input pulsed_input(Law law, Modulation modulation, double link_V, double start_angle_rad, bool free_angle);

struct Vector2 {
    double d = 0, q = 0;
};
Vector2 turned_by(double angle, Vector2 x);

/// An angle, whose cosine and sine cost more than what is turned by it.
struct Angle {
    double rad = 0, cos = 1, sin = 0;
    Angle() = default;
    explicit Angle(double angle) : rad(angle), cos(std::cos(angle)), sin(std::sin(angle)) {}
    Angle(double angle, double its_cos, double its_sin) : rad(angle), cos(its_cos), sin(its_sin) {}
    Vector2 on(Vector2 x) const { return {cos * x.d - sin * x.q, sin * x.d + cos * x.q}; }
    Vector2 back(Vector2 x) const { return {cos * x.d + sin * x.q, cos * x.q - sin * x.d}; }
};

/// What a sample holds for an input. Voltages: v of the period, v_end as the rotor sees it at this sample, change[0]: v
/// less the last row's stationary voltage as seen in this period, change[1]: that less the one before ...
struct Moment {
    double i_d = 0, i_q = 0, w_e = 0, cos_e = 1, sin_e = 0;
    double v_end_d = 0, v_end_q = 0;
    Vector2 v_next;       ///< the voltage that begins at this sample, as the rotor sees it then
    Vector2 v_now;        ///< that of the period whose end this is, as the rotor sees it at this sample
    int past = kFewPast;  ///< changes that are known
    Vector2 change[kPast];
    Vector2 turned[kFewPast];                ///< the same changes of voltages that were turned along with the rotor
    double cos_m = 1, sin_m = 0, w_dot = 0;  ///< of the shaft's angle; the electrical speed's slope, rad/s^2
    double v_dc = 0;
    double period_s = 0;
    double lag_s = 0;      ///< of a filter that all of the line's current passes
    Angle ahead;           ///< of the rotor, what the angle is in whose frame all of this is seen
    bool later = false;    ///< currents are told under the voltage that begins here
    bool settled = false;  ///< a point that lasts: its voltage has not just stepped
    Vector2 lost;          ///< of the voltage, before it reaches the machine
    double state = 0;      ///< of the law that is asked: heat, K or a part, or the power that a link's source gives, W
    double source_W = 0;   ///< the latter, of the term among those that are there
    double R = 0, Ld = 0, Lq = 0, psi = 0;
    double warm_Wb =
        0;  ///< of psi, the part that is a law of its own, of the rotor's frame: an angle turns that already
    /// Incremental inductance less Ld, Lq, along the rotor's axes, and its slopes by i_d and by i_q; what the flux has
    /// beside it where the tangent meets no current.
    double bend_dd_H = 0, bend_dq_H = 0, bend_qq_H = 0;
    Vector2 bent_Wb;
    double by_d_H_A[3] = {}, by_q_H_A[3] = {};
    /// Of a sampling period: what jumps within one is taken as its mean there, at its end, and counts nothing at its
    /// start.
    bool starts = false, ends = false;
    double past_alpha = 0, past_beta = 0;      ///< stationary currents at its start, for its end
    double before_alpha = 0, before_beta = 0;  ///< the same as measured a row before that
    double bow_alpha = 0, bow_beta = 0;        ///< how far its current lies, half-way, from the line between its ends
    double bow_d = 0;  ///< the same on average, in the rotor's frame: the magnet turns while the voltage is held
    double held_alpha = 0, held_beta = 0;  ///< the voltage of its middle, stationary
    double mean_of_held = 1.0;             ///< what a constant rotor-frame f keeps of itself as a mean over it
    const Input* pulses = nullptr;         ///< the legs' pulses in which the voltage comes, where they are in the model
    Vector2 lost_in_legs;                  ///< of the voltage, by dead times as laws of the current; it stands still
    Vector2 lost_at_edges;                 ///< the same, of a period whose legs lose it at their edges alone
    Vector2 told_more;                     ///< of the currents, by sensors, than flows
    double past_more_alpha = 0, past_more_beta = 0;  ///< the same of the stationary ones at the start, for the end
};

/// f and g of one unit of each weight, as many as the law has, (E51) to (E53); of a delay, and of iron that turning
/// alone heats, the slope at `weights`, where given. clipped_current: three sensors that stop at shape[0] A; where one
/// does, the true phase current is beyond it by three times what the measured one, less the three's mean, is.
void evaluate(const Input& input, const Moment& at, Vector2 f[], Vector2 g[], const double weights[] = nullptr);

/// Sum over the weights; turned vectors, delays, shifts and lags exactly instead of to first order.
void evaluate_sum(const Input& input, const double weights[], const Moment& at, Vector2& f, Vector2& g);

/// Derivatives by the currents of the same sums, [dd dq qd qq]; zero for what hardly depends on them.
void evaluate_slope(const Input& input, const double weights[], const Moment& at, double f_slope[4], double g_slope[4]);

/// evaluate_sum() and evaluate_slope() at once.
void evaluate_with_slope(const Input& input, const double weights[], const Moment& at, Vector2& f, Vector2& g,
                         double f_slope[4], double g_slope[4]);

/// Whether a law is of voltage that does not reach the machine, by as much all through a period; whether one asks for it.
bool loses_voltage(Law law);
bool asks_for_lost(const Input& input);
bool asks_for_lost_in_legs(const Input& input);

/// (E54): torque of one unit of each weight, at speed w_m and shaft angle theta_m.
void evaluate_torque(const Input& input, double w_m, double theta_m, double torque[kMostWeights]);

}  // namespace dqw
#endif
