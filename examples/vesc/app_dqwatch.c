// dqwatch in VESC's firmware, as a custom application: APP_CUSTOM_TO_USE "app_dqwatch.c" in conf_general.h, lib/ beside
// it, its .c files in APPSRC and its folder in APPINC.
// The interrupt hands over a sample where VESC calls back after each control iteration; a thread learns. In VESC Tool's
// terminal `dqwatch` prints what is known.
#include <app.h>
#include <ch.h>
#include <hal.h>
#include <hw.h>

#include <commands.h>
#include <math.h>
#include <mc_interface.h>
#include <mcpwm_foc.h>
#include <terminal.h>
#include <utils_math.h>

#include "dqw.h"

static THD_FUNCTION(watch, arg);
static THD_WORKING_AREA(watch_area, 4096);  // init makes a monitor on the stack: docs/firmware.md
static volatile bool stop_now = true;
static volatile bool is_running = false;

static dqw_monitor monitor;
static dqw_monitor_config config;

// motor/mcpwm_foc.c, end of the ADC's interrupt: currents and angle of this iteration, the modulation that it decided.
static void sample(void)
{
    const volatile mc_configuration *conf = mc_interface_get_configuration();
    if (mc_interface_get_state() != MC_STATE_RUNNING) {
        dqw_monitor_missing(&monitor, 1);
        return;
    }
    // A modulation of 1 is two thirds of the link. What the timer gets, before VESC's own estimate of the dead time.
    const float volts = GET_INPUT_VOLTAGE() * (2.0f / 3.0f);
    const float v_alpha_V = mcpwm_foc_get_mod_alpha_raw() * volts, v_beta_V = mcpwm_foc_get_mod_beta_raw() * volts;
    const float theta_rad = mcpwm_foc_get_phase() * (3.14159265f / 180.0f);
    float s, c;
    utils_fast_sincos_better(theta_rad, &s, &c);
    const float i_d_A = mcpwm_foc_get_id(), i_q_A = mcpwm_foc_get_iq();
    const dqw_sample now = dqw_sample_from_alphabeta(v_alpha_V, v_beta_V, c * i_d_A - s * i_q_A, s * i_d_A + c * i_q_A,
                                                     mcpwm_foc_get_rpm_faster() * (3.14159265f / 30.0f), c, s);
    const bool limited = fabsf(mcpwm_foc_get_duty_cycle_now()) > 0.97f * conf->l_max_duty;
    (void)dqw_monitor_sample(&monitor, &now, limited);
}

static enum dqw_status start_monitor(void)
{
    const volatile mc_configuration *conf = mc_interface_get_configuration();
    const uint16_t pole_pairs = conf->si_motor_poles / 2;
    const dqw_nameplate plate = {1.0f / mcpwm_foc_get_sampling_frequency_now(), GET_INPUT_VOLTAGE() * 0.577f,
                                 conf->l_current_max, conf->l_max_erpm * (3.14159265f / 30.0f) / (float)pole_pairs,
                                 pole_pairs};
    config = dqw_monitor_config_default(&plate);
    dqw_estimator_config *e = &config.estimator;
    e->R_ohm = conf->foc_motor_r;  // where to start: VESC's own detection
    e->Ld_H = conf->foc_motor_l - 0.5f * conf->foc_motor_ld_lq_diff;
    e->Lq_H = conf->foc_motor_l + 0.5f * conf->foc_motor_ld_lq_diff;
    e->psi_Wb = conf->foc_motor_flux_linkage;
    e->voltage_next = true;      // the timer loads the duties at the period's end,
    e->voltage_held = true;      // as a vector that the inverter holds
    e->speed_electrical = true;  // erpm
    e->observed = !mcpwm_foc_is_using_encoder();
    return dqw_monitor_init(&monitor, &config);
}

static void tell(int argc, const char **argv)
{
    static const struct {
        enum dqw_monitor_channel channel;
        const char *name;
        double scale;
    } rows[] = {{DQW_WATCH_R, "R, mohm", 1e3},
                {DQW_WATCH_LD, "L_d, uH", 1e6},
                {DQW_WATCH_LQ, "L_q, uH", 1e6},
                {DQW_WATCH_PSI, "flux, mWb", 1e3}};
    (void)argc;
    (void)argv;
    for (unsigned i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const dqw_reading r = dqw_monitor_read(&monitor, rows[i].channel);
        if (r.usable)
            commands_printf("%-9s %.4g, sd %.2g", rows[i].name, (double)r.value * rows[i].scale,
                            (double)r.sd * rows[i].scale);
        else
            commands_printf("%-9s not known", rows[i].name);
    }
    commands_printf("dqwatch %s: %s\n", DQW_VERSION, dqw_why_text(dqw_monitor_why(&monitor)));
}

void app_custom_start(void)
{
    const enum dqw_status status = start_monitor();
    if (status != DQW_OK) {
        commands_printf("dqwatch: %s", dqw_status_text(status));
        return;
    }
    stop_now = false;
    chThdCreateStatic(watch_area, sizeof(watch_area), NORMALPRIO, watch, NULL);
    mc_interface_set_pwm_callback(sample);
    terminal_register_command_callback("dqwatch", "What dqwatch has learned", "", tell);
}

void app_custom_stop(void)
{
    mc_interface_set_pwm_callback(0);
    terminal_unregister_callback(tell);
    stop_now = true;
    while (is_running) chThdSleepMilliseconds(1);
}

void app_custom_configure(app_configuration *conf) { (void)conf; }

static THD_FUNCTION(watch, arg)
{
    (void)arg;
    chRegSetThreadName("dqwatch");
    is_running = true;
    while (!stop_now) {
        dqw_monitor_change change;
        if (dqw_monitor_background(&monitor) && dqw_monitor_event(&monitor, &change))
            commands_printf("dqwatch: %s, %s %.4g, was %.4g", dqw_fault_text(change.fault.name),
                            dqw_parameter_text(change.parameter), (double)change.value, (double)change.healthy);
        chThdSleepMicroseconds(500);
    }
    is_running = false;
}
