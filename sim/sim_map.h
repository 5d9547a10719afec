// A measured flux map, made reciprocal: one co-energy as a smooth spline over the currents, and its inverse.
#ifndef DQW_SIM_MAP_H
#define DQW_SIM_MAP_H

#include <stdbool.h>
#include <stddef.h>

enum { DQW_SIM_MAP_CELLS = 16, DQW_SIM_MAP_COEFS = DQW_SIM_MAP_CELLS + 4 };

/// One axis of the spline: uniform quartic B-splines on `cells` cells of width `step_A` from `low_A`.
typedef struct dqw_sim_map_axis {
    double low_A, step_A;
    int cells;
    double reach_low_A, reach_high_A;  ///< the map is invertible, and used, from here to here
} dqw_sim_map_axis;

/// Co-energy W'(i) = sum c_jk B_j(i_d) B_k(i_q) per unit of 1.5; psi = grad W', so that dpsi_d/di_q = dpsi_q/di_d
/// exactly.
/// Beyond the measured edge each B continues with its value, slope and curvature there: psi goes on with the edge's
/// differential inductance, and stays reciprocal.
typedef struct dqw_sim_map {
    dqw_sim_map_axis d, q;
    double coef[DQW_SIM_MAP_COEFS][DQW_SIM_MAP_COEFS];
    double rms_Wb, max_Wb;  ///< measured minus projected, both components together
    double curl;            ///< RMS of (dpsi_d/di_q - dpsi_q/di_d) over RMS of their mean, by differences on the grid
    double last_d_A, last_q_A;  ///< where the last inversion ended: the next one starts there
} dqw_sim_map;

/// A map as read: a full grid, row-major in i_d.
typedef struct dqw_sim_grid {
    size_t n_d, n_q;
    double *i_d_A, *i_q_A;        ///< n_d, n_q values, ascending
    double *psi_d_Wb, *psi_q_Wb;  ///< n_d * n_q values
} dqw_sim_grid;

/// Reads CSV with the columns i_d_A, i_q_A, psi_d_Wb, psi_q_Wb in any order. Returns 0 or a negative dqw_sim_status
/// with
/// "FILE:LINE: what is wrong" in message. On success the caller frees with dqw_sim_grid_free.
int dqw_sim_grid_read(const char *path, dqw_sim_grid *grid, char *message, size_t size);
void dqw_sim_grid_free(dqw_sim_grid *grid);

/// Least-squares projection of the grid on one co-energy. Returns 0, DQW_SIM_ERR_MEMORY, or DQW_SIM_ERR_MAP where the
/// result is not convex over the measured currents. Cost: about 10 ms.
int dqw_sim_map_fit(const dqw_sim_grid *grid, dqw_sim_map *map, char *message, size_t size);

/// Fluxes and differential inductances L = {dd, dq, qq} at any currents.
void dqw_sim_map_flux(const dqw_sim_map *map, double i_d_A, double i_q_A, double *psi_d_Wb, double *psi_q_Wb,
                      double L[3]);

/// Co-energy without the factor 1.5; zero at zero current.
double dqw_sim_map_coenergy(const dqw_sim_map *map, double i_d_A, double i_q_A);

/// Currents at these fluxes, by Newton. Returns false outside the reach.
bool dqw_sim_map_invert(dqw_sim_map *map, double psi_d_Wb, double psi_q_Wb, double *i_d_A, double *i_q_A);

#endif
