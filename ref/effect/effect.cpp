#include "ref/effect/effect.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "ref/effect/flux_map.hpp"

namespace dqw {

struct FittedInput {
    const TraceInput& input;
    const std::vector<double>& sd;
    double shape_sd;
    const PlainModel& machine;

    double w(std::size_t i) const { return input.weights[i]; }
    double shape(std::size_t i) const { return i < input.shape.size() ? input.shape[i] : 0.0; }
    Estimate scaled(const char* name, std::size_t i, double by) const
    {
        return {name, w(i) * by, sd[i] * std::abs(by), false};
    }
    Estimate given(const char* name, std::size_t i) const { return {name, shape(i), 0.0, true}; }
};

namespace {

using Out = std::vector<Estimate>;

struct Polar {
    double size, angle, size_sd, angle_sd;
    /// Of weights i and i + 1.
    Polar(const FittedInput& f, std::size_t i)
    {
        const double a = f.w(i), b = f.w(i + 1), a_sd = f.sd[i], b_sd = f.sd[i + 1];
        const double r = std::hypot(a, b), sd = std::hypot(a_sd, b_sd);
        size = 0.0, angle = 0.0, size_sd = sd, angle_sd = 0.0;
        if (!(r > 0.0)) return;
        size = r, angle = std::atan2(b, a);
        size_sd = std::hypot(a * a_sd, b * b_sd) / r, angle_sd = std::hypot(b * a_sd, a * b_sd) / (r * r);
    }
};

/// Without a thermometer the rise within the log is known, not the coefficient; of settled rows no time constant.
void heat(const FittedInput& f, Out& out, const char* coefficient, const char* rise, double percent, double base)
{
    const bool state = f.shape(1) != 0.0;
    out.push_back(state ? f.scaled(rise, 0, percent * f.input.reach / base) : f.scaled(coefficient, 0, 1.0 / base));
    if (std::isnan(f.shape(1))) return;
    out.push_back(state ? f.given("tau_s", 1) : f.given("T0_C", 0));
}
void winding(const FittedInput& f, Out& out) { heat(f, out, "alpha_per_K", "rise_percent", 100.0, f.machine.R_ohm); }
void magnet(const FittedInput& f, Out& out) { heat(f, out, "beta_per_K", "fall_percent", -100.0, f.machine.psi_Wb); }

void inverter(const FittedInput& f, Out& out)
{
    out.push_back(f.scaled("voltage_V", 0, 1.0));
    out.push_back({"width_A", f.shape(0), f.shape_sd, !(f.shape_sd > 0.0)});
    if (f.input.weights.size() > 1 && std::isfinite(f.sd[1])) out.push_back(f.scaled("constant_V", 1, 1.0));
    if (f.input.weights.size() > 2) out.push_back(f.scaled("given_back_V", 2, -1.0));
}

void across(const FittedInput& f, Out& out)
{
    out.push_back({"R_fe_ohm", 1.0 / f.w(0), f.sd[0] / (f.w(0) * f.w(0)), false});
}

void harmonics(const FittedInput& f, Out& out)
{
    const std::string order = std::to_string(static_cast<int>(f.shape(0)));
    const Polar d(f, 0), q(f, 2);
    out.push_back({"psi_" + order + "d_Wb", d.size, d.size_sd, false});
    out.push_back({"psi_" + order + "q_Wb", q.size, q.size_sd, false});
    out.push_back({"phase_" + order + "d_rad", d.angle, d.angle_sd, false});
    out.push_back({"phase_" + order + "q_rad", q.angle, q.angle_sd, false});
}

void mismatch(const FittedInput& f, Out& out)
{
    const Polar p(f, 0);
    out.push_back({"gain", p.size, p.size_sd, false});
    out.push_back({"axis_rad", 0.5 * p.angle, 0.5 * p.angle_sd, false});
}

/// A settled row has no period: there the weight is in seconds.
void late(const FittedInput& f, Out& out) { out.push_back(f.scaled(f.shape(0) > 0.0 ? "delay_s" : "periods", 0, 1.0)); }

/// The link's loss at the largest power, or at its lowest; the source's resistance where the link's voltage is known.
void scale(const FittedInput& f, Out& out)
{
    const bool column = static_cast<Sag>(static_cast<int>(f.shape(0))) == Sag::by_its_column;
    out.push_back(f.scaled("gain", 0, -f.shape(2)));
    if (!column && f.shape(1) > 0.0) out.push_back(f.scaled("source_ohm", 0, f.shape(1) * f.shape(1)));
    if (f.input.shape.size() > 3) out.push_back(f.given("tau_s", 3));
}

void short_circuit(const FittedInput& f, Out& out)
{
    const Polar p(f, 1);
    out.push_back({"R_short_ohm", 1.0 / f.w(0), f.sd[0] / (f.w(0) * f.w(0)), false});
    out.push_back(f.scaled("share", 0, f.machine.R_ohm));
    out.push_back({"axis_rad", 0.5 * p.angle, 0.5 * p.angle_sd, false});
}

void eccentric(const FittedInput& f, Out& out)
{
    const Polar p(f, 0);
    out.push_back({"amplitude_rad", p.size, p.size_sd, false});
    out.push_back({"phase_rad", p.angle, p.angle_sd, false});
    out.push_back(f.given("order", 0));
}

void asymmetric(const FittedInput& f, Out& out)
{
    const Polar p(f, 0);
    out.push_back({"psi_1_Wb", p.size, p.size_sd, false});
    out.push_back({"phase_rad", p.angle, p.angle_sd, false});
}

void skin(const FittedInput& f, Out& out) { out.push_back(f.scaled("k_s2_rad2", 0, 1.0 / f.machine.R_ohm)); }

void stribeck(const FittedInput& f, Out& out)
{
    out.push_back(f.scaled("torque_Nm", 0, 1.0));
    out.push_back(f.given("speed_rad_s", 1));
}

void cogging(const FittedInput& f, Out& out)
{
    const Polar p(f, 0);
    out.push_back({"torque_Nm", p.size, p.size_sd, false});
    out.push_back({"phase_rad", p.angle, p.angle_sd, false});
    out.push_back(f.given("order", 0));
}

constexpr auto turns = asks_turns, sweep = asks_sweep, currents = asks_currents, points = asks_points,
               speeds = asks_speeds, shaft = asks_shaft, axes = asks_axes;

constexpr const char* no_shaft_angle = "a sample has no angle of the shaft";

constexpr Effect rows[] = {
    {{Law::dead_time, "dead_time", 1, Shape::current_width, Unit::V, currents},
     "a phase that switches loses V tanh(i_x/w), or by another law of the same kind",
     "small currents: a slow sweep of i_d through zero at standstill",
     "effect_dead_time",
     {{"voltage_V", -1e3, 1e3}, {"width_A", 0.0, 1e4}, {"constant_V", -1e3, 1e3}, {"given_back_V", -1e3, 1e3}},
     {"The inverter loses {voltage_V} per phase (dead time)"},
     inverter},
    {{Law::saturation, "saturation", 5, Shape::current_unit, Unit::Wb, {currents, turns | currents}},
     "flux linkage bends with its own current",
     "larger currents on one axis at a time, at constant speed",
     "traction_ipm --set nonideal.saturation_dq_A_Wb3=0",
     {{"psi_d2_Wb", -10, 10},
      {"psi_d3_Wb", -10, 10},
      {"psi_d4_Wb", -10, 10},
      {"psi_q3_Wb", -10, 10},
      {"psi_q5_Wb", -10, 10},
      {"i_base_A", 0.0, 1e5}}},
    {{Law::cross_saturation, "cross_saturation", 3, Shape::current_unit, Unit::Wb, {currents, turns | currents}},
     "flux linkage bends with the other axis' current",
     "large currents on both axes at once",
     "traction_ipm",
     {{"psi_c12_Wb", -10, 10}, {"psi_c22_Wb", -10, 10}, {"psi_c14_Wb", -10, 10}, {"i_base_A", 0.0, 1e5}}},
    {{Law::winding_temperature, "winding_temperature", 1, Shape::heat, Unit::ohm, 0},
     "R = R_0 (1 + alpha (T - T_0))",
     "the same currents cold and hot, and a temperature column",
     "heating",
     {{"alpha_per_K", 5e-4, 1.2e-2}, {"rise_percent", 0.0, 300.0}},
     {"The winding warms up: R grows by {alpha_per_K} (winding temperature)",
      "The winding warms up: R grows by {rise_percent} within the log (winding temperature)"},
     winding},
    {{Law::magnet_temperature, "magnet_temperature", 1, Shape::heat, Unit::Wb, turns},
     "psi = psi_0 (1 + beta (T - T_0))",
     "the same speed with a cold and a hot magnet, and a temperature column",
     "heating",
     {{"beta_per_K", -8e-3, 0.0}, {"fall_percent", 0.0, 60.0}},
     {"The magnet warms up: ψ changes by {beta_per_K} (magnet temperature)",
      "The magnet warms up: ψ falls by {fall_percent} within the log (magnet temperature)"},
     magnet},
    {{Law::iron_loss, "iron_loss", 1, Shape::R_L, Unit::S, turns | currents, is_like_turning_v},
     "a resistance across the induced voltage",
     "a second speed, and both directions",
     "servo --set nonideal.iron_loss_S=0.002",
     {{"R_fe_ohm", 0.0, 1e9}},
     {"The iron loses power like a resistance of {R_fe_ohm} across the induced voltage (iron loss)"},
     across},
    {{Law::flux_harmonics, "flux_harmonics", 4, Shape::order, Unit::Wb, turns | sweep, 0, -1.0},
     "flux linkage with order 6 (12) of the electrical angle",
     "a constant speed, with an angle column",
     "servo --set nonideal.flux_harmonic_6q_Wb=0.005",
     {{"psi_6d_Wb", 0.0, 1.0}, {"psi_6q_Wb", 0.0, 1.0}, {"phase_6d_rad", -7, 7}, {"phase_6q_rad", -7, 7}},
     {"The flux ripples six times a turn by {psi_6d_Wb} in d and {psi_6q_Wb} in q (flux harmonics)",
      "The flux ripples twelve times a turn by {psi_12d_Wb} in d and {psi_12q_Wb} in q (flux harmonics)"},
     harmonics},
    {{Law::current_offset, "current_offset", 2, Shape::R_L, Unit::A, sweep, 0, 1.0},
     "the current sensors read a constant too much",
     "zero current with the inverter off",
     "servo --set nonideal.current_offset_alpha_A=0.4",
     {{"i_alpha_A", -1e4, 1e4}, {"i_beta_A", -1e4, 1e4}},
     {"The current sensors are off by {i_alpha_A} in α and {i_beta_A} in β (current offset)"}},
    {{Law::current_gain_mismatch, "current_gain_mismatch", 2, Shape::R_L, Unit::one, axes | currents, 0, 2.0},
     "the phases' current sensors differ in gain",
     "a second speed: it also follows L di/dt, a resistance does not",
     "servo --set nonideal.current_gain_a=1.03",
     {{"gain", 0.0, 0.3}, {"axis_rad", -4, 4}},
     {"The phases' current sensors differ in gain by {gain} (current gain mismatch)"},
     mismatch},
    {{Law::angle_offset, "angle_offset", 1, Shape::L_psi, Unit::one, turns | points},
     "the angle is wrong by a constant",
     "a second speed, and i_d of both signs",
     "effect_angle_offset",
     {{"angle_rad", -0.35, 0.35}},
     {"The angle is off by {angle_rad}, electrical (angle offset)"}},
    {{Law::delay, "delay", 1, Shape::seconds, Unit::one, {currents, turns | points}, is_like_turning_v},
     "the voltage comes late",
     "a voltage that changes fast: injection or steps",
     "servo --set nonideal.delay_periods=1",
     {{"periods", 0.0, 3.0}},
     {"The voltage comes {periods} periods late (delay)", "The voltage comes {delay_s} late (delay)"},
     late},
    {{Law::sample_shift, "sample_shift", 1, Shape::instant, Unit::s, {currents, turns | speeds}, is_like_turning_v},
     "currents, angle and voltage of a row are not of one instant",
     "injection at standstill and at top speed: a shift follows the change of what is late, a loss its size",
     "servo --set sensing.late_periods=0.5",
     {{"shift_s", -1.0, 1.0}},
     {"The instant of the {channel} is later by {shift_s} than that of the rest of a row (sample shift)",
      "The instant of a part of each row is later by {shift_s} than that of the rest (sample shift)"},
     nullptr,
     "the next row's voltage, which the step of a sample does not have"},
    {{Law::sensor_lag, "sensor_lag", 1, Shape::channel, Unit::s, currents},
     "a first-order filter before the sampling",
     "steps of the voltage, a few samples apart: a filter rounds what a shift only moves",
     "servo --set sensing.filter_s=1e-4",
     {{"tau_s", 1e-7, 1.0}},  // no drive's current sensor passes 1.6 MHz
     {"A filter delays the {channel} by a time constant of {tau_s} (sensor lag)",
      "A filter delays a sensor by a time constant of {tau_s} (sensor lag)"},
     nullptr,
     "its law is not linear in the time constant"},
    {{Law::voltage_scale, "voltage_scale", 1, Shape::link, Unit::per_W, currents},
     "the log's voltage takes the link as constant, which sags",
     "the same speed without load and at full power, and a column v_dc_V",
     "servo --modulation centred --set inverter.source_ohm=2 --set inverter.link_F=1e-3 --set "
     "drive.link=nominal",
     {{"gain", -0.6, 0.6}, {"source_ohm", 0.0, 1e3}},
     {"The link sags behind {source_ohm}, and the log's voltage does not: at most {gain} of it are missing (voltage "
      "scale)",
      "The link's voltage changes, and the log's voltage does not: at most {gain} of it are missing (voltage scale)"},
     scale,
     "a product of three columns, which a block of sums does not hold"},
    {{Law::skin_effect, "skin_effect", 1, Shape::none, Unit::ohm_s2, turns | currents | speeds},
     "R = R_0 (1 + k w_e^2)",
     "the same currents at standstill and at top speed",
     "servo --set nonideal.skin_effect_s2_rad2=4e-7",
     {{"k_s2_rad2", 0.0, 1.0}},
     {"R grows with the square of the speed, by {k_s2_rad2} (skin effect)"},
     skin},
    {{Law::phase_resistance_imbalance, "phase_resistance_imbalance", 2, Shape::none, Unit::ohm, axes | currents, 0,
      2.0},
     "one or two phases' resistance differs",
     "a current vector turned slowly at standstill",
     "servo --set nonideal.phase_resistance_a_ohm=0.3",
     {{"dR_a_ohm", -1e3, 1e3}, {"dR_b_ohm", -1e3, 1e3}},
     {"The phases differ in resistance: a by {dR_a_ohm} and b by {dR_b_ohm} from c (phase resistance imbalance)"}},
    {{Law::turn_short, "turn_short", 3, Shape::R_L, Unit::S, {turns | sweep, turns | sweep}, 0, 2.0},
     "turns of one phase are shorted",
     "two speeds without load: the short's current grows with the induced voltage, a resistance' with the current",
     "servo --set nonideal.turn_short=0.05",
     {{"R_short_ohm", 0.0, 1e9}, {"share", 0.0, 1.0}},
     {"Turns of one phase are shorted, as if by {R_short_ohm} across all of them (turn short)"},
     short_circuit,
     "the monitor has its pattern"},
    {{Law::encoder_eccentricity, "encoder_eccentricity", 2, Shape::shaft_order, Unit::one, turns | shaft},
     "the angle is wrong by a sine of the shaft's own",
     "a second speed: the error stays, while a magnet's ripple of the induced voltage is on the other axis",
     "servo --set sensing.once_rad=0.03",
     {{"amplitude_rad", 0.0, 0.2}, {"order", 1, 2}},
     {"The encoder is eccentric: its angle errs by {amplitude_rad}, {order} times a turn of the shaft (encoder "
      "eccentricity)"},
     eccentric,
     no_shaft_angle},
    {{Law::magnet_asymmetry, "magnet_asymmetry", 2, Shape::shaft_order, Unit::Wb, turns | shaft},
     "one magnet is unlike the others",
     "a constant speed without current: the induced voltage itself, over a turn of the shaft",
     "servo --set nonideal.magnet_asymmetry_Wb=0.005",
     {{"psi_1_Wb", 0.0, 10.0}},
     {"The magnet's flux changes by {psi_1_Wb} once a turn of the shaft (magnet asymmetry)"},
     asymmetric,
     no_shaft_angle},
    {{Law::voltage_offset, "voltage_offset", 2, Shape::none, Unit::V, currents, is_like_turning_v},
     "a constant is added to v_d, v_q",
     "zero speed and zero current",
     "servo --set nonideal.voltage_offset_d_V=2",
     {{"v_d_V", -1e3, 1e3}, {"v_q_V", -1e3, 1e3}},
     {"A constant voltage is in the log: {v_d_V} in d, {v_q_V} in q (voltage offset)"}},
    {{Law::coulomb_friction, "coulomb_friction", 1, Shape::speed_width, Unit::one, 0, is_mechanical},
     "a constant torque against the motion",
     "motion both ways, or coasting to rest",
     "coast_friction",
     {{"torque_Nm", 0.0, 1e6}},
     {"Dry friction takes {torque_Nm} (Coulomb friction)"}},
    {{Law::direction_asymmetry, "direction_asymmetry", 1, Shape::speed_width, Unit::one, 0, is_mechanical},
     "friction differs with the direction",
     "motion both ways, and a rest between them",
     "",
     {{"torque_Nm", -1e6, 1e6}},
     {"Friction differs with the direction: {torque_Nm} more one way, less the other (direction asymmetry)"}},
    {{Law::stribeck_friction, "stribeck_friction", 1, Shape::speed_widths, Unit::one, 0, is_mechanical},
     "friction falls as motion begins",
     "slow motion through zero speed",
     "effect_friction --set profile.speed_start_rad_s=0 --set profile.i_q_A.wave=0.3 --set "
     "profile.i_q_A.random=0.2 --set nonideal.friction_asymmetry_Nm=0 --set nonideal.cogging_Nm=0 "
     "--set noise=0.002",
     {{"torque_Nm", 0.0, 1e6}, {"speed_rad_s", 0.0, 1e6}},
     {"Friction rises by {torque_Nm} near standstill (Stribeck friction)"},
     stribeck},
    {{Law::cogging_torque, "cogging_torque", 2, Shape::periods_a_turn, Unit::one, 0, is_mechanical},
     "a torque periodic in the shaft angle",
     "slow motion, with an angle column",
     "effect_friction --set profile.speed_start_rad_s=0 --set profile.i_q_A.wave=0.3 --set "
     "profile.i_q_A.random=0.2 --set nonideal.friction_asymmetry_Nm=0 --set nonideal.stribeck_Nm=0 "
     "--set noise=0.002",
     {{"torque_Nm", 0.0, 1e6}, {"order", 1, 1e4}},
     {"The torque ripples by {torque_Nm}, {order} times a turn (cogging torque)"},
     cogging},
    {{Law::load_torque, "load_torque", 1, Shape::none, Unit::one, 0, is_mechanical},
     "a constant torque",
     "motion both ways",
     "",
     {{"torque_Nm", -1e6, 1e6}},
     {"A constant load takes {torque_Nm} (load torque)"}},
    // Not sought.
    {{Law::flux_map, "flux_map", 2, Shape::flux_cells, Unit::one, {currents, turns | currents}},
     "flux linkage bends as a map says",
     "currents on both axes as large as the map's",
     "",
     {{"weight_d", 0, 10}, {"weight_q", 0, 10}}},
    // No effects of their own.
    {{Law::clipped_current, "clipped_current", 1, Shape::limit, Unit::one, 0}},
    {{Law::dead_clamped, "dead_time", 2, Shape::current_width, Unit::V, currents}},
    {{Law::dead_given_back, "dead_time", 3, Shape::two_widths, Unit::V, currents}},
    {{Law::own_map, "saturation", kOwnWeights, Shape::current_cells, Unit::Wb, currents}},
    {{Law::cross_map, "cross_saturation", kCrossWeights, Shape::current_cells, Unit::Wb, currents}},
    {{Law::pulsed_shift, "sample_shift", 1, Shape::pulses, Unit::s, currents}},
    {{Law::pulsed_lag, "sensor_lag", 1, Shape::pulses, Unit::s, currents}},
    {{Law::pulses, "pulses", 0, Shape::pulses, Unit::one, 0}},
};

/// Where a law's row is.
struct Places {
    std::size_t of[std::size(rows)] = {}, found = 0;
    constexpr Places()
    {
        for (std::size_t law = 0; law < std::size(rows); ++law)
            for (std::size_t k = 0; k < std::size(rows); ++k)
                if (rows[k].id == static_cast<Law>(law)) of[law] = k, ++found;
    }
};
constexpr Places places;
static_assert(places.found == std::size(rows) && std::size(rows) == static_cast<std::size_t>(Law::pulses) + 1,
              "an effect lacks its row");

}  // namespace

const std::vector<Effect>& effects()
{
    static const std::vector<Effect> catalogue(std::begin(rows), std::end(rows) - 9);
    return catalogue;
}

const Effect& effect_of(Law law) { return rows[places.of[static_cast<std::size_t>(law)]]; }

const Effect* find_effect(const std::string& name)
{
    const auto* const end = std::end(rows) - 8;
    const auto* const found = std::find_if(std::begin(rows), end, [&](const Effect& e) { return name == e.name; });
    return found != end ? found : nullptr;
}

int numbers_of(Shape shape)
{
    switch (shape) {
    case Shape::none:
    case Shape::seconds:
    case Shape::limit:
    case Shape::current_cells:
    case Shape::instant:
    case Shape::channel:
    case Shape::pulses:
    case Shape::link:
    case Shape::shaft_order: return 0;
    case Shape::speed_widths: return 2;
    case Shape::flux_cells:
    case Shape::heat:
    case Shape::R_L:
    case Shape::L_psi: return 3;
    default: return 1;
    }
}

int free_of(Shape shape)
{
    if (shape == Shape::speed_widths) return 2;
    return shape == Shape::current_width || shape == Shape::two_widths || shape == Shape::limit ||
                   shape == Shape::speed_width
               ? 1
               : 0;
}

std::string channel_of(const TraceInput& input)
{
    const Effect* effect = find_effect(input.effect);
    if (effect == nullptr || input.shape.empty()) return "";
    const int which = static_cast<int>(input.shape[0]);
    if (effect->shape == Shape::channel) return static_cast<Channel>(which) == Channel::speed ? "speed" : "currents";
    if (effect->shape != Shape::instant) return "";
    switch (static_cast<Instant>(which)) {
    case Instant::currents_before:
    case Instant::currents_after: return "currents";
    case Instant::angle: return "angle";
    case Instant::voltage_turned: return "voltage";
    default: return "voltage's frame";
    }
}

bool is_turned(const TraceInput& input)
{
    const Effect* effect = find_effect(input.effect);
    return effect != nullptr && effect->shape == Shape::instant && !input.shape.empty() &&
           static_cast<Instant>(static_cast<int>(input.shape[0])) == Instant::voltage_turned;
}

std::vector<Estimate> physical(const std::vector<TraceInput>& inputs, const std::vector<std::vector<double>>& sd,
                               const std::vector<double>& shape_sd, const PlainModel& model)
{
    std::vector<Estimate> out;
    for (std::size_t n = 0; n < inputs.size(); ++n) {
        const Effect& effect = *find_effect(inputs[n].effect);
        const FittedInput fitted{inputs[n], sd[n], shape_sd[n], model};
        if (effect.physical != nullptr) {
            effect.physical(fitted, out);
            continue;
        }
        std::size_t i = 0;
        for (const EffectParameter& p : effect.parameters) {
            if (i < static_cast<std::size_t>(effect.weights))
                out.push_back(fitted.scaled(p.name, i, 1.0));
            else
                out.push_back({p.name, fitted.shape(0), fitted.shape_sd, !(fitted.shape_sd > 0.0)});
            ++i;
        }
    }
    return out;
}

}  // namespace dqw
