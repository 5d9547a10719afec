// What examples/vesc takes from VESC's firmware and ChibiOS, with the signatures of their headers; no behaviour.
#ifndef VESC_STUB_H
#define VESC_STUB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// datatypes.h: of mc_configuration the fields that are read.
typedef enum { MC_STATE_OFF = 0, MC_STATE_DETECTING, MC_STATE_RUNNING, MC_STATE_FULL_BRAKE } mc_state;
typedef struct {
    float l_current_max;
    float l_max_erpm;
    float l_max_duty;
    float foc_motor_l;
    float foc_motor_ld_lq_diff;
    float foc_motor_r;
    float foc_motor_flux_linkage;
    uint8_t si_motor_poles;
} mc_configuration;
typedef struct app_configuration app_configuration;

// motor/mc_interface.h
const volatile mc_configuration *mc_interface_get_configuration(void);
void mc_interface_set_pwm_callback(void (*p_func)(void));
mc_state mc_interface_get_state(void);

// motor/mcpwm_foc.h
float mcpwm_foc_get_sampling_frequency_now(void);
float mcpwm_foc_get_duty_cycle_now(void);
float mcpwm_foc_get_rpm_faster(void);
float mcpwm_foc_get_id(void);
float mcpwm_foc_get_iq(void);
float mcpwm_foc_get_phase(void);
float mcpwm_foc_get_mod_alpha_raw(void);
float mcpwm_foc_get_mod_beta_raw(void);
bool mcpwm_foc_is_using_encoder(void);

// applications/app.h, comm/commands.h, terminal.h, util/utils_math.h
void app_custom_start(void);
void app_custom_stop(void);
void app_custom_configure(app_configuration *conf);
int commands_printf(const char *format, ...);
void terminal_register_command_callback(const char *command, const char *help, const char *arg_names,
                                        void (*cbf)(int argc, const char **argv));
void terminal_unregister_callback(void (*cbf)(int argc, const char **argv));
void utils_fast_sincos_better(float angle, float *sin, float *cos);

// A board's hw.h: from the ADC.
float board_input_voltage(void);
#define GET_INPUT_VOLTAGE() board_input_voltage()

// ChibiOS
typedef struct thread thread_t;
#define THD_FUNCTION(tname, arg) void tname(void *arg)
#define THD_WORKING_AREA(s, n) uint64_t s[(n) / 8]
#define NORMALPRIO 128
typedef void (*tfunc_t)(void *p);
thread_t *chThdCreateStatic(void *wsp, size_t size, unsigned prio, tfunc_t pf, void *arg);
void chRegSetThreadName(const char *name);
void chThdSleepMilliseconds(unsigned msecs);
void chThdSleepMicroseconds(unsigned usecs);

#endif
