/* What a user of the installed float library does first: prints its version and learns a motor. 0: learned. */
#include "learn.h"

#include "dqw.h"
#include "motor.h"

int learn(void (*say)(const char *what, float value, float truth))
{
    const dqw_nameplate plate = {DT_S, 14.0f, 10.0f, 110.0f, PAIRS};
    static dqw_estimator_config config; /* stays in use as long as the estimator */
    static dqw_estimator estimator;
    motor m = {0.0f, 0.0f, 0.0f, 0.0f, 1u};
    config = dqw_estimator_config_default(&plate);
    say(DQW_VERSION, 0.0f, 0.0f);
    const enum dqw_status status = dqw_estimator_init(&estimator, &config);
    if (status != DQW_OK) {
        say(dqw_status_text(status), 0.0f, 0.0f);
        return 1;
    }
    for (int k = 0; k < PERIODS; k++) {
        float v_d_V, v_q_V;
        motor_decide(&m, k, &v_d_V, &v_q_V);
        const dqw_sample s = dqw_sample_from_dq(v_d_V, v_q_V, m.i_d_A, m.i_q_A, m.w_m_rad_s, m.theta_e_rad);
        (void)dqw_estimator_sample(&estimator, &s, false);
        (void)dqw_estimator_background(&estimator);
        motor_turn(&m, v_d_V, v_q_V);
    }
    static const enum dqw_parameter asked[] = {DQW_R, DQW_LD, DQW_LQ, DQW_PSI};
    static const char *const name[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    const float truth[] = {R_OHM, LD_H, LQ_H, PSI_WB};
    int wrong = 0;
    for (int i = 0; i < 4; i++) {
        const dqw_reading r = dqw_estimator_read(&estimator, asked[i]);
        say(name[i], r.value, truth[i]);
        if (!r.usable || fabsf(r.value - truth[i]) > 0.005f * truth[i]) wrong = 1;
    }
    return wrong;
}
