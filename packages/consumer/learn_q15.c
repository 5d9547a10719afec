/* The same with the fixed-point library. */
#include "learn.h"

#include "dqw_estimator_q15.h"
#include "dqw_sample_q15.h"
#include "dqw_text.h"
#include "dqw_version.h"
#include "motor.h"

static int16_t q15(float part)
{
    return (int16_t)floorf(part * 32768.0f + 0.5f);
}

int learn(void (*say)(const char *what, float value, float truth))
{
    const dqw_nameplate_q15 plate = {50000u, 14000u, 10000u, 110000u, PAIRS};
    static dqw_estimator_q15_config config; /* stays in use as long as the estimator */
    static dqw_estimator_q15 estimator;
    motor m = {0.0f, 0.0f, 0.0f, 0.0f, 1u};
    config = dqw_estimator_config_default_q15(&plate);
    say(DQW_VERSION, 0.0f, 0.0f);
    const enum dqw_status status = dqw_estimator_init_q15(&estimator, &config);
    if (status != DQW_OK) {
        say(dqw_status_text(status), 0.0f, 0.0f);
        return 1;
    }
    const float v_V = 1e-3f * (float)config.scale.v_full_mV, i_A = 1e-3f * (float)config.scale.i_full_mA,
                w_rad_s = 1e-3f * (float)config.scale.w_full_mrad_s;
    for (int k = 0; k < PERIODS; k++) {
        float v_d_V, v_q_V;
        motor_decide(&m, k, &v_d_V, &v_q_V);
        const uint16_t turn = (uint16_t)(m.theta_e_rad * 10430.378f);
        const dqw_sample_q15 s = dqw_sample_from_dq_q15(q15(v_d_V / v_V), q15(v_q_V / v_V), q15(m.i_d_A / i_A),
                                                        q15(m.i_q_A / i_A), q15(m.w_m_rad_s / w_rad_s), turn);
        (void)dqw_estimator_sample_q15(&estimator, &s, false);
        (void)dqw_estimator_background_q15(&estimator);
        motor_turn(&m, v_d_V, v_q_V);
    }
    static const enum dqw_parameter asked[] = {DQW_R, DQW_LD, DQW_LQ, DQW_PSI};
    static const char *const name[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    static const float unit[] = {1e-6f, 1e-9f, 1e-9f, 1e-9f};
    const float truth[] = {R_OHM, LD_H, LQ_H, PSI_WB};
    int wrong = 0;
    for (int i = 0; i < 4; i++) {
        const dqw_reading_q15 r = dqw_estimator_read_q15(&estimator, asked[i]);
        const float value = (float)r.value_q40 / 1099511627776.0f * (float)dqw_estimator_unit_q15(&config, asked[i]) *
                            unit[i];
        say(name[i], value, truth[i]);
        if (!r.usable || fabsf(value - truth[i]) > 0.005f * truth[i]) wrong = 1;
    }
    return wrong;
}
