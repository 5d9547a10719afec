// Currents and energy from flux linkages, (E31): one energy, so that cross terms are reciprocal.
#ifndef DQW_SIM_FLUX_H
#define DQW_SIM_FLUX_H

#include <stdbool.h>

#include "sim_map.h"

/// The machine's magnetics, constant over one period. Either the quartic law or a map.
///
/// Law, with x = psi_d - psi_m, per unit of 1.5 (amplitude-invariant):
///     W = x^2 / (2 L_d0) + psi_q^2 / (2 L_q0)
///       + a_dd/4 (psi_d^4 - 4 psi_m^3 psi_d + 3 psi_m^4) + a_qq/4 psi_q^4 + a_dq/2 psi_d^2 psi_q^2
///     i_d = dW/dpsi_d,   i_q = dW/dpsi_q,   i = 0 at (psi_m, 0).
/// The magnet's flux saturates the iron too: negative i_d desaturates, as in a real machine. L_d0, L_q0 are such that
/// the differential inductances at zero current stay L_d, L_q whatever the coefficients. W is convex, and i(psi) one to
/// one, while
/// 1/L_d0, 1/L_q0 > 0, a_dd, a_qq >= 0 and 0 <= a_dq <= 3 sqrt(a_dd a_qq).
typedef struct dqw_sim_flux {
    double ld0_inv, lq0_inv, a_dd, a_qq, a_dq;
    dqw_sim_map *map;     ///< NULL: the law
    double map_psi_m_Wb;  ///< the map's own magnet flux: a weaker magnet shifts the map along psi_d
} dqw_sim_flux;

/// Sets the law's coefficients. Ld, Lq, psi: the healthy machine's. Returns false where W is not convex.
bool dqw_sim_flux_init(dqw_sim_flux *f, double Ld_H, double Lq_H, double psi_Wb, double a_dd, double a_qq, double a_dq);

/// Currents at these fluxes. Returns false where a map cannot be inverted there.
bool dqw_sim_flux_currents(const dqw_sim_flux *f, double psi_m_Wb, double psi_d_Wb, double psi_q_Wb, double *i_d_A,
                           double *i_q_A);

/// Energy W without the factor 1.5, and its derivative to psi_m. Returns false where a map cannot be inverted there.
bool dqw_sim_flux_energy(const dqw_sim_flux *f, double psi_m_Wb, double psi_d_Wb, double psi_q_Wb, double *W,
                         double *dW_dpsi_m);

/// Fluxes at zero current.
void dqw_sim_flux_at_rest(const dqw_sim_flux *f, double psi_m_Wb, double *psi_d_Wb, double *psi_q_Wb);

#endif
