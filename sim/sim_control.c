#include "sim_control.h"

#include <math.h>

#include "sim_signal.h"

static double clamp(double x, double limit) { return x > limit ? limit : x < -limit ? -limit : x; }

// What a limit cut off, fed to an integrator of gain ki dt beside a proportional gain kp: never more than all of it.
static double back(double cut, double ki_dt, double kp) { return cut * (ki_dt < kp ? ki_dt / kp : 1); }

static double speed_loop(dqw_sim_controller *c, const dqw_sim_scenario *s, const dqw_sim_measured *m, double limit_A)
{
    const double kt = 1.5 * s->machine.pole_pairs * c->psi_Wb;
    const double kp = s->drive.speed_bandwidth_rad_s * s->machine.J_kgm2 / kt;
    const double ki_dt = kp * 0.25 * s->drive.speed_bandwidth_rad_s * s->drive.dt_s;
    const double error = dqw_sim_signal_at(&s->profile.speed_rad_s, m->t_s, s->seed, DQW_SIM_STREAM_SPEED) -
                         m->w_m_rad_s;
    const double wanted = kp * error + c->integral_speed_A, given = clamp(wanted, limit_A);
    c->integral_speed_A += ki_dt * error + back(given - wanted, ki_dt, kp);
    return given;
}

void dqw_sim_limit(const dqw_sim_drive *drive, double v_dc_V, double *v_d_V, double *v_q_V)
{
    const double limit = drive->overmodulation ? v_dc_V * (2.0 / 3) : v_dc_V / 1.7320508075688772,
                 size = hypot(*v_d_V, *v_q_V);
    const double k = size > limit ? limit / size : 1;
    *v_d_V *= k, *v_q_V *= k;
}

void dqw_sim_controller_step(dqw_sim_controller *c, const dqw_sim_scenario *s, const dqw_sim_measured *m,
                             double t_apply_s, double *v_d_V, double *v_q_V)
{
    const dqw_sim_drive *drive = &s->drive;
    double v_d = dqw_sim_signal_at(&s->profile.v_d_V, t_apply_s, s->seed, DQW_SIM_STREAM_V_D);
    double v_q = dqw_sim_signal_at(&s->profile.v_q_V, t_apply_s, s->seed, DQW_SIM_STREAM_V_Q);
    const bool loops = s->profile.control != DQW_SIM_CONTROL_VOLTAGE;
    const double kp_d = drive->current_bandwidth_rad_s * c->Ld_H, kp_q = drive->current_bandwidth_rad_s * c->Lq_H;
    const double ki_dt = drive->current_bandwidth_rad_s * s->machine.R_ohm * drive->dt_s;
    double error_d = 0, error_q = 0;
    if (loops) {
        const double i_d = clamp(dqw_sim_signal_at(&s->profile.i_d_A, m->t_s, s->seed, DQW_SIM_STREAM_I_D),
                                 drive->i_max_A);
        const double limit = sqrt(drive->i_max_A * drive->i_max_A - i_d * i_d);
        double i_q = dqw_sim_signal_at(&s->profile.i_q_A, m->t_s, s->seed, DQW_SIM_STREAM_I_Q);
        if (s->profile.control == DQW_SIM_CONTROL_SPEED) i_q += speed_loop(c, s, m, limit);
        i_q = clamp(i_q, limit);
        const double w_e = s->machine.pole_pairs * m->w_m_rad_s;
        error_d = i_d - m->i_d_A, error_q = i_q - m->i_q_A;
        v_d += kp_d * error_d + c->integral_d_V - w_e * c->Lq_H * i_q;
        v_q += kp_q * error_q + c->integral_q_V + w_e * (c->Ld_H * i_d + c->psi_Wb);
    }
    *v_d_V = v_d, *v_q_V = v_q;
    dqw_sim_limit(drive, m->v_dc_V, v_d_V, v_q_V);
    if (!loops) return;
    c->integral_d_V += ki_dt * error_d + back(*v_d_V - v_d, ki_dt, kp_d);
    c->integral_q_V += ki_dt * error_q + back(*v_q_V - v_q, ki_dt, kp_q);
}
