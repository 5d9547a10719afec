// The condition monitor in a motor controller: one call in the PWM interrupt, the slow part in the main loop.
// docs/INTEGRATION.md says what each signal must be, and what to do on each event.
#include "foc_monitor.h"

#include "dqw_sample.h"
#include "dqw_text.h"
#include "foc_board.h"
#include "foc_config.h"
#if DQW_EFFECT_WEIGHTS > 0
#include "dqw_model_config.h"
#endif

static dqw_monitor monitor;

bool foc_monitor_start(void)
{
    const enum dqw_status status = dqw_monitor_init(&monitor, &CONFIG);
    if (status != DQW_OK) {
        board_say("monitor refused", dqw_status_text(status), 0, 0);
        return false;
    }
    // What was healthy before the power went.
    dqw_monitor_stored stored;
    if (!board_flash_read(&stored, sizeof stored)) return true;
    const enum dqw_status restored = dqw_monitor_restore(&monitor, &stored);
    if (restored != DQW_OK) board_say("learns anew", dqw_status_text(restored), 0, 0);
    return true;
}

void foc_pwm_interrupt(void)
{
    board_signals now;
    if (!board_sample(&now)) {
        dqw_monitor_missing(&monitor, 1);
        return;
    }
    const dqw_sample s = dqw_sample_from_alphabeta(now.v_alpha_V, now.v_beta_V, now.i_alpha_A, now.i_beta_A,
                                                   now.w_m_rad_s, now.cosine, now.sine);
    (void)dqw_monitor_sample(&monitor, &s, now.limited);
}

// Stage 1 again. What the model lacked dqwatch trace finds in a log of the machine, and writes as dqw_model_config.h.
// Without it, the same once more.
static void define_anew(void)
{
#if DQW_EFFECT_WEIGHTS > 0
    static dqw_monitor_config traced;
#endif
    board_say("way back", dqw_why_text(dqw_monitor_why(&monitor)), 0, 0);
    board_interrupt(false);
#if DQW_EFFECT_WEIGHTS > 0
    traced = CONFIG;
    dqw_model_config_apply_monitor(&traced);
    const enum dqw_status status = dqw_monitor_define(&monitor, &traced);
#else
    const enum dqw_status status = dqw_monitor_define(&monitor, &CONFIG);
#endif
    board_interrupt(true);
    if (status != DQW_OK) board_say("monitor refused", dqw_status_text(status), 0, 0);
}

void foc_background(void)
{
    dqw_monitor_change change;
    if (dqw_monitor_background(&monitor) && dqw_monitor_event(&monitor, &change))
        board_say(dqw_fault_text(change.fault.name), dqw_parameter_text(change.parameter), change.value,
                  change.healthy);
    if (dqw_monitor_stage(&monitor) == DQW_STAGE_DOMAIN) define_anew();
}

dqw_reading foc_parameter(enum dqw_monitor_channel which) { return dqw_monitor_read(&monitor, which); }

enum dqw_why foc_why(void) { return dqw_monitor_why(&monitor); }

void foc_store(void)
{
    dqw_monitor_stored stored;
    if (dqw_monitor_store(&monitor, &stored)) board_flash_write(&stored, sizeof stored);
}
