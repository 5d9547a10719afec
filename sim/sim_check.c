#include "sim_check.h"

#include <math.h>
#include <stdio.h>

#include "sim_keys.h"
#include "sim_polled.h"

static const char *broken(double x, enum dqw_sim_rule rule)
{
    if (!isfinite(x)) return "must be finite";
    if (rule == DQW_SIM_ABOVE_0 && !(x > 0)) return "must be above 0";
    if (rule == DQW_SIM_FROM_0 && !(x >= 0)) return "must not be negative";
    if (rule == DQW_SIM_BELOW_1 && !(x >= 0 && x < 1)) return "must be from 0 to below 1";
    if (rule == DQW_SIM_TO_1 && !(x >= 0 && x <= 1)) return "must be from 0 to 1";
    if (rule == DQW_SIM_TO_2 && !(x >= 0 && x <= 2)) return "must be from 0 to 2";
    if (rule == DQW_SIM_A_GAIN && !(x > -1)) return "must be above -1";
    return NULL;
}

static int refuse(char *message, size_t size, const char *what, const char *why)
{
    snprintf(message, size, "%s %s", what, why);
    return DQW_SIM_ERR_SCENARIO;
}

static int check_signal(const dqw_sim_signal *g, const char *name, double dt_s, char *message, size_t size)
{
    if (g->wave != 0 && !(g->wave_period_s > 0))
        return refuse(message, size, name, "has a wave whose wave_period_s is not above 0");
    if (g->wave != 0 && g->shape == DQW_SIM_SHAPE_STAIRS && g->levels < 2)
        return refuse(message, size, name, "has stairs with fewer than 2 levels");
    if (g->random != 0 && !(g->random_hold_s >= 0.5 * dt_s))
        return refuse(message, size, name, "has a random_hold_s shorter than a period");
    if (g->binary != 0 && !(g->binary_hold_s >= 0.5 * dt_s))
        return refuse(message, size, name, "has a binary_hold_s shorter than a period");
    return 0;
}

static int check_nonideal(const dqw_sim_scenario *s, char *message, size_t size)
{
    const dqw_sim_machine *m = &s->machine;
    const dqw_sim_nonideal *x = &s->nonideal;
    const bool law = x->saturation_dd_A_Wb3.value != 0 || x->saturation_qq_A_Wb3.value != 0 ||
                     x->saturation_dq_A_Wb3.value != 0;
    if ((m->coulomb_Nm > 0 || x->bearing_Nm.value > 0 || x->stribeck_Nm.value > 0) && !(m->coulomb_width_rad_s > 0))
        return refuse(message, size, "machine.coulomb_width_rad_s", "must be above 0 where there is dry friction");
    if (x->stribeck_Nm.value > 0 && !(x->stribeck_width_rad_s > 0))
        return refuse(message, size, "nonideal.stribeck_width_rad_s",
                      "must be above 0 where there is Stribeck friction");
    if (fabs(x->friction_asymmetry_Nm.value) > m->coulomb_Nm)
        return refuse(message, size, "nonideal.friction_asymmetry_Nm",
                      "must be machine.coulomb_Nm at most: friction does not drive");
    if (x->cogging_Nm.value > 0 && x->cogging_order < 1)
        return refuse(message, size, "nonideal.cogging_order", "must be 1 or more where there is cogging");
    if (x->dead_time_V.value > 0 && !(x->dead_time_width_A > 0))
        return refuse(message, size, "nonideal.dead_time_width_A", "must be above 0 where there is dead time");
    if (x->dead_time_V.value > 0 && x->inverter_curve[0])
        return refuse(message, size, "nonideal.dead_time_V", "and nonideal.inverter_curve exclude each other");
    if (m->flux_map[0] && law)
        return refuse(message, size, "nonideal.saturation_*", "and machine.flux_map exclude each other");
    if (!(m->R_ohm + x->phase_resistance_a_ohm.value > 0 && m->R_ohm + x->phase_resistance_b_ohm.value > 0))
        return refuse(message, size, "nonideal.phase_resistance_*_ohm", "must leave some of machine.R_ohm");
    if (x->turn_short.value > 0 && x->phase_resistance_b_ohm.value != 0)
        return refuse(message, size, "nonideal.turn_short", "and nonideal.phase_resistance_b_ohm exclude each other");
    return 0;
}

// What only an inverter that switches has.
static int check_switches(const dqw_sim_scenario *s, char *message, size_t size)
{
    const dqw_sim_inverter *v = &s->inverter;
    const dqw_sim_nonideal *x = &s->nonideal;
    if (v->modulation == DQW_SIM_MODULATION_MEAN) {
        const struct {
            bool given;
            const char *key;
        } keys[] = {{v->carriers != 0, "inverter.carriers"},
                    {v->compare_counts != 0, "inverter.compare_counts"},
                    {v->dead_time_s > 0, "inverter.dead_time_s"},
                    {v->node_F > 0, "inverter.node_F"},
                    {v->switch_V > 0 || v->switch_ohm > 0, "inverter.switch_V, switch_ohm"},
                    {v->diode_V > 0 || v->diode_ohm > 0, "inverter.diode_V, diode_ohm"},
                    {v->source_ohm > 0 || v->link_F > 0, "inverter.source_ohm, link_F"},
                    {v->ripple_V > 0, "inverter.ripple_V"},
                    {s->drive.overmodulation, "drive.overmodulation"},
                    {s->drive.compensation > 0, "drive.compensation"}};
        for (size_t k = 0; k < sizeof keys / sizeof *keys; ++k)
            if (keys[k].given)
                return refuse(message, size, keys[k].key, "needs an inverter.modulation other than mean");
        return 0;
    }
    const double carrier_s = s->drive.dt_s / (v->carriers > 1 ? v->carriers : 1);
    if (s->drive.hold == DQW_SIM_HOLD_DQ)
        return refuse(message, size, "inverter.modulation", "needs drive.hold = abc: legs hold no rotating voltage");
    if (v->carriers < 0 || v->carriers > 10000)
        return refuse(message, size, "inverter.carriers", "must be from 0 to 10000");
    if (v->compare_counts < 0) return refuse(message, size, "inverter.compare_counts", "must not be negative");
    if (!(v->dead_time_s < 0.25 * carrier_s))
        return refuse(message, size, "inverter.dead_time_s", "must be below a quarter of the PWM period");
    if ((v->switch_V > 0 || v->diode_V > 0) && !(v->knee_A > 0))
        return refuse(message, size, "inverter.knee_A", "must be above 0 where a switch or diode drops a voltage");
    if ((v->source_ohm > 0) != (v->link_F > 0))
        return refuse(message, size, "inverter.source_ohm", "and inverter.link_F go together");
    if (!(v->ripple_V < s->drive.v_dc_V))
        return refuse(message, size, "inverter.ripple_V", "must be below drive.v_dc_V");
    if (v->ripple_V > 0 && !(v->ripple_Hz > 0))
        return refuse(message, size, "inverter.ripple_Hz", "must be above 0 where the link has a ripple");
    if (s->drive.compensation > 0 && !(v->dead_time_s > 0))
        return refuse(message, size, "drive.compensation", "needs an inverter.dead_time_s");
    if (!(s->noise.step_v_dc_V < s->drive.v_dc_V))
        return refuse(message, size, "noise.step_v_dc_V",
                      "must be below drive.v_dc_V: legs divide by what is measured");
    if (v->node_F > 0 && !(v->dead_time_s > 0))
        return refuse(message, size, "inverter.node_F", "needs an inverter.dead_time_s");
    if (s->drive.compensation > 10) return refuse(message, size, "drive.compensation", "must be 10 at most");
    if (x->dead_time_V.value > 0 || x->inverter_curve[0])
        return refuse(message, size, "nonideal.dead_time_V, inverter_curve",
                      "are of a mean voltage: legs have inverter.dead_time_s");
    if (x->delay_periods.value != floor(x->delay_periods.value) || x->delay_periods.t_end_s > 0)
        return refuse(message, size, "nonideal.delay_periods", "must be whole and steady where legs switch");
    if ((x->iron_loss_S.value > 0 || x->iron_hysteresis_S_rad_s.value > 0) && !(x->iron_loss_tau_s > 0))
        return refuse(message, size, "nonideal.iron_loss_tau_s",
                      "must be above 0 where legs switch: eddies do not follow an edge");
    if (x->turn_short_H > 0 && !(x->turn_short.value > 0))
        return refuse(message, size, "nonideal.turn_short_H", "needs a nonideal.turn_short");
    if (x->turn_short.value > 0 && !(x->turn_short_H > 0))
        return refuse(message, size, "nonideal.turn_short_H",
                      "must be above 0 where legs switch: shorted turns do not follow an edge");
    return 0;
}

static int check_sensing(const dqw_sim_scenario *s, char *message, size_t size)
{
    const dqw_sim_sensing *x = &s->sensing;
    if (s->drive.hold == DQW_SIM_HOLD_DQ && (x->filter_s > 0 || x->late_periods > 0))
        return refuse(message, size, "sensing.filter_s, late_periods", "need drive.hold = abc");
    if (s->drive.hold == DQW_SIM_HOLD_DQ && s->drive.unturned)
        return refuse(message, size, "drive.unturned", "needs drive.hold = abc: the other turns with the rotor");
    if (!(fabs(x->once_rad) <= 1)) return refuse(message, size, "sensing.once_rad", "must be 1 rad at most");
    if (!(fabs(x->twice_rad) <= 1)) return refuse(message, size, "sensing.twice_rad", "must be 1 rad at most");
    if (!(fabs(x->observer_lag_s) <= 0.01))
        return refuse(message, size, "sensing.observer_lag_s", "must be 10 ms at most");
    if (!(fabs(x->observer_load_rad_A) * s->drive.i_max_A <= 3))
        return refuse(message, size, "sensing.observer_load_rad_A", "must turn by 3 rad at drive.i_max_A at most");
    if (x->observer && !(x->speed_bandwidth_rad_s > 0))
        return refuse(message, size, "sensing.speed_bandwidth_rad_s", "must be above 0 with an observer");
    if (x->observer && x->observer_noise_rad > 0 && !(x->observer_corner_rad_s > 0 && x->observer_bandwidth_rad_s > 0))
        return refuse(message, size, "sensing.observer_corner_rad_s, observer_bandwidth_rad_s",
                      "must be above 0 where the observer is noisy");
    if (x->observer && (x->once_rad != 0 || x->twice_rad != 0 || x->angle_late_periods > 0))
        return refuse(message, size, "sensing.once_rad, twice_rad, angle_late_periods",
                      "are of an encoder, and sensing.observer has none");
    if (!x->observer && (x->observer_lag_s != 0 || x->observer_load_rad_A != 0 || x->observer_noise_rad > 0))
        return refuse(message, size, "sensing.observer_lag_s, observer_load_rad_A, observer_noise_rad",
                      "need sensing.observer");
    return 0;
}

static int check_polled(const dqw_sim_scenario *s, char *message, size_t size)
{
    const dqw_sim_polled *p = &s->polled;
    if (p->queue_rows < 0) return refuse(message, size, "polled.queue_rows", "must not be negative");
    const double given = p->queue_rows + p->jitter_s + p->lost_fraction + p->repeated_fraction + p->speed_noise_rad_s +
                         p->step_i_A + p->step_v_V + p->step_erpm + p->step_v_dc_V;
    if (!(p->rate_Hz > 0)) return given > 0 ? refuse(message, size, "polled.*", "needs a polled.rate_Hz") : 0;
    if (s->drive.log_every > 1)
        return refuse(message, size, "polled.rate_Hz", "and drive.log_every above 1 exclude each other");
    if (!(p->rate_Hz * s->drive.dt_s <= 0.5 + 1e-9))
        return refuse(message, size, "polled.rate_Hz", "must be half of 1/drive.dt_s at most");
    if (!(p->rate_Hz * s->duration_s > 1))
        return refuse(message, size, "polled.rate_Hz", "gives no row within duration_s");
    if (!(p->jitter_s * p->rate_Hz <= 10))
        return refuse(message, size, "polled.jitter_s", "must be 10/polled.rate_Hz at most");
    return 0;
}

static int check_together(const dqw_sim_scenario *s, char *message, size_t size)
{
    const dqw_sim_machine *m = &s->machine;
    const dqw_sim_drive *d = &s->drive;
    const bool loops = s->profile.control != DQW_SIM_CONTROL_VOLTAGE;
    if (m->pole_pairs < 1 || m->pole_pairs > 1000)
        return refuse(message, size, "machine.pole_pairs", "must be from 1 to 1000");
    if (s->profile.shaft == DQW_SIM_SHAFT_FREE && !(m->J_kgm2 > 0))
        return refuse(message, size, "machine.J_kgm2", "must be above 0 where the shaft is free");
    if ((m->winding_heat_J_K > 0) != (m->magnet_heat_J_K > 0))
        return refuse(message, size, "machine", "needs both heat capacities or neither");
    if (!(m->housing_heat_J_K > 0) &&
        (m->winding_housing_W_K > 0 || m->magnet_housing_W_K > 0 || m->housing_ambient_W_K > 0))
        return refuse(message, size, "machine.housing_heat_J_K", "must be above 0 where heat goes to a housing");
    if (m->housing_heat_J_K > 0 && !(m->winding_heat_J_K > 0))
        return refuse(message, size, "machine.housing_heat_J_K", "needs the winding's and the magnet's");
    if (s->nonideal.iron_hysteresis_S_rad_s.value > 0 && !(s->nonideal.iron_hysteresis_corner_rad_s > 0))
        return refuse(message, size, "nonideal.iron_hysteresis_corner_rad_s", "must be above 0 where there is a loss");
    if (loops && !(d->current_bandwidth_rad_s > 0))
        return refuse(message, size, "drive.current_bandwidth_rad_s", "must be above 0 where currents are controlled");
    if (s->profile.control == DQW_SIM_CONTROL_SPEED &&
        !(d->speed_bandwidth_rad_s > 0 && m->psi_Wb > 0 && s->profile.shaft == DQW_SIM_SHAFT_FREE))
        return refuse(message, size, "profile.control = speed", "needs a speed bandwidth, a magnet and a free shaft");
    if (d->log_every < 0 || d->log_window < 0 || d->log_window > (d->log_every > 1 ? d->log_every : 1))
        return refuse(message, size, "drive.log_window", "must be from 0 to drive.log_every");
    if (!(s->duration_s / d->dt_s < 1e9)) return refuse(message, size, "duration_s", "is over 1e9 periods");
    if (!(s->rtol <= 0.01)) return refuse(message, size, "rtol", "must be 0.01 at most");
    return 0;
}

int dqw_sim_check(const dqw_sim_scenario *s, char *message, size_t size)
{
    for (size_t i = 0; i < dqw_sim_field_count(); ++i) {
        const dqw_sim_field *f = dqw_sim_field_at(i);
        if (f->kind != DQW_SIM_FIELD_DOUBLE && f->kind != DQW_SIM_FIELD_RAMP) continue;
        const char *why = broken(*(const double *)(const void *)((const char *)s + f->offset), f->rule);
        if (why) return refuse(message, size, f->key, why);
    }
    const struct {
        const dqw_sim_signal *signal;
        const char *name;
    } signals[] = {{&s->profile.speed_rad_s, "profile.speed_rad_s"},
                   {&s->profile.i_d_A, "profile.i_d_A"},
                   {&s->profile.i_q_A, "profile.i_q_A"},
                   {&s->profile.v_d_V, "profile.v_d_V"},
                   {&s->profile.v_q_V, "profile.v_q_V"},
                   {&s->profile.load_Nm, "profile.load_Nm"}};
    for (size_t i = 0; i < sizeof signals / sizeof *signals; ++i) {
        const int status = check_signal(signals[i].signal, signals[i].name, s->drive.dt_s, message, size);
        if (status) return status;
    }
    int status = check_nonideal(s, message, size);
    if (status == 0) status = check_switches(s, message, size);
    if (status == 0) status = check_sensing(s, message, size);
    if (status == 0) status = check_together(s, message, size);
    return status ? status : check_polled(s, message, size);
}

long dqw_sim_periods(const dqw_sim_scenario *s)
{
    const long every = s->drive.log_every > 1 ? s->drive.log_every : 1;
    return (long)floor(s->duration_s / (s->drive.dt_s * (double)every) + 0.5) * every;
}

size_t dqw_sim_drive_rows(const dqw_sim_scenario *s)
{
    return (size_t)(dqw_sim_periods(s) / (s->drive.log_every > 1 ? s->drive.log_every : 1));
}

size_t dqw_sim_rows(const dqw_sim_scenario *s)
{
    char unused[320];
    if (!s || dqw_sim_check(s, unused, sizeof unused)) return 0;
    const size_t rows = dqw_sim_drive_rows(s);
    return s->polled.rate_Hz > 0 ? dqw_sim_polled_rows(s, rows) : rows;
}

const char *dqw_sim_status_text(int status)
{
    switch (status) {
    case DQW_SIM_OK: return "done";
    case DQW_SIM_ERR_KEY: return "no such key";
    case DQW_SIM_ERR_VALUE: return "not a value of this key's kind";
    case DQW_SIM_ERR_SCENARIO: return "unphysical or contradictory scenario";
    case DQW_SIM_ERR_CAPACITY: return "too few rows offered";
    case DQW_SIM_ERR_MAP: return "flux map cannot be used";
    case DQW_SIM_ERR_SOLVER: return "the integration failed";
    case DQW_SIM_ERR_MEMORY: return "out of memory";
    case DQW_SIM_ERR_ABORTED: return "stopped by the caller";
    default: return "unknown status";
    }
}
