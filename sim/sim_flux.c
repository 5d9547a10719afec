#include "sim_flux.h"

#include <math.h>

bool dqw_sim_flux_init(dqw_sim_flux *f, double Ld_H, double Lq_H, double psi_Wb, double a_dd, double a_qq, double a_dq)
{
    const double psi2 = psi_Wb * psi_Wb;
    f->a_dd = a_dd, f->a_qq = a_qq, f->a_dq = a_dq;
    f->ld0_inv = 1 / Ld_H - 3 * a_dd * psi2;
    f->lq0_inv = 1 / Lq_H - a_dq * psi2;
    f->map = NULL;
    f->map_psi_m_Wb = 0;
    return f->ld0_inv > 0 && f->lq0_inv > 0 && a_dd >= 0 && a_qq >= 0 && a_dq >= 0 &&
           a_dq <= 3 * sqrt(a_dd * a_qq) * (1 + 1e-12);
}

bool dqw_sim_flux_currents(const dqw_sim_flux *f, double psi_m_Wb, double psi_d_Wb, double psi_q_Wb, double *i_d_A,
                           double *i_q_A)
{
    if (f->map) return dqw_sim_map_invert(f->map, psi_d_Wb - (psi_m_Wb - f->map_psi_m_Wb), psi_q_Wb, i_d_A, i_q_A);
    const double d2 = psi_d_Wb * psi_d_Wb, q2 = psi_q_Wb * psi_q_Wb;
    *i_d_A = (psi_d_Wb - psi_m_Wb) * f->ld0_inv + f->a_dd * (d2 * psi_d_Wb - psi_m_Wb * psi_m_Wb * psi_m_Wb) +
             f->a_dq * psi_d_Wb * q2;
    *i_q_A = psi_q_Wb * (f->lq0_inv + f->a_qq * q2 + f->a_dq * d2);
    return true;
}

bool dqw_sim_flux_energy(const dqw_sim_flux *f, double psi_m_Wb, double psi_d_Wb, double psi_q_Wb, double *W,
                         double *dW_dpsi_m)
{
    if (f->map) {
        double i_d, i_q;
        const double shifted = psi_d_Wb - (psi_m_Wb - f->map_psi_m_Wb);
        if (!dqw_sim_map_invert(f->map, shifted, psi_q_Wb, &i_d, &i_q)) return false;
        *W = i_d * shifted + i_q * psi_q_Wb - dqw_sim_map_coenergy(f->map, i_d, i_q);
        *dW_dpsi_m = -i_d;
        return true;
    }
    const double x = psi_d_Wb - psi_m_Wb, m2 = psi_m_Wb * psi_m_Wb, d2 = psi_d_Wb * psi_d_Wb, q2 = psi_q_Wb * psi_q_Wb;
    *W = 0.5 * (x * x * f->ld0_inv + q2 * f->lq0_inv) +
         0.25 * f->a_dd * (d2 * d2 - 4 * m2 * psi_m_Wb * psi_d_Wb + 3 * m2 * m2) + 0.25 * f->a_qq * q2 * q2 +
         0.5 * f->a_dq * d2 * q2;
    *dW_dpsi_m = -x * (f->ld0_inv + 3 * f->a_dd * m2);
    return true;
}

void dqw_sim_flux_at_rest(const dqw_sim_flux *f, double psi_m_Wb, double *psi_d_Wb, double *psi_q_Wb)
{
    *psi_d_Wb = psi_m_Wb, *psi_q_Wb = 0;
    if (!f->map) return;
    double L[3];
    dqw_sim_map_flux(f->map, 0, 0, psi_d_Wb, psi_q_Wb, L);
    *psi_d_Wb += psi_m_Wb - f->map_psi_m_Wb;
}
