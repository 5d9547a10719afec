// The machine's differential equations, (E30), (E33), (E99), over one control period, during which voltage, load and
// faults are constant.
#ifndef DQW_SIM_PLANT_H
#define DQW_SIM_PLANT_H

#include "dqw_sim.h"
#include "sim_curve.h"
#include "sim_flux.h"
#include "sim_inverter.h"

/// Energies that are integrated beside the states.
enum {
    DQW_SIM_E_ELECTRICAL,
    DQW_SIM_E_COPPER,
    DQW_SIM_E_IRON,
    DQW_SIM_E_MECHANICAL,
    DQW_SIM_E_MAGNET,
    DQW_SIM_E_FRICTION,
    DQW_SIM_E_LOAD,
    DQW_SIM_E_AMBIENT,
    DQW_SIM_ENERGIES
};

enum { DQW_SIM_STATES_MAX = 16 + DQW_SIM_ENERGIES };

/// Parameters of one period. Fluxes are integrated in the frame in which the inverter holds its voltage, so that the
/// rotation costs the integrator nothing: the rotor's frame at t_k standing still (hold = abc), or turning with it
/// (hold = dq).
/// At t_k, and for dq always, the states are psi_d, psi_q themselves.
typedef struct dqw_sim_plant {
    dqw_sim_nonideal now;  ///< each ramp's value as it is in this period
    double p, R_ref_ohm, psi_ref_Wb, temp_ref_C;
    dqw_sim_flux flux;
    double extra_a_ohm, extra_b_ohm;  ///< in series with phases a, b
    double dead_time_width_inv;
    const dqw_sim_curve *curve;  ///< NULL: dead time's law
    const dqw_sim_legs *legs;    ///< NULL: the voltage is held, nothing switches
    double v_source_V, source_ohm_inv, link_F_inv, ripple_V, ripple_rad_s;
    double iron_tau_inv, iron_corner_rad_s;
    double disturbance_rad_s;
    double J_inv, B_Nms_rad, coulomb_Nm, coulomb_width_inv, stribeck_width_inv;
    double winding_heat_inv, magnet_heat_inv, housing_heat_inv, winding_magnet_W_K, winding_ambient_W_K,
        magnet_ambient_W_K, winding_housing_W_K, magnet_housing_W_K, housing_ambient_W_K, temp_ambient_C;
    bool turning_frame, harmonic;  ///< harmonic: the magnet's flux has any
    // This period.
    double v_x_V, v_y_V;                   ///< held voltage in that frame
    double t_s, theta_e_rad, theta_m_rad;  ///< t_k, and the angles there
    double cos_frame, sin_frame;           ///< of theta_e
    double load_Nm;
    double w_m_rad_s, accel_rad_s2;        ///< where the shaft is imposed: speed at t_k, and its slope
    double temp_winding_C, temp_magnet_C;  ///< where there are no heat capacities
    // Where in the state vector; -1: absent. Stationary (alpha, beta) what has no frame of its own.
    int at_w, at_temp, at_housing;
    int at_link, at_node;   ///< link's voltage; three outputs, where they float
    int at_iron, at_short;  ///< currents of the eddies, and of the shorted turns
    int at_energy, states;
} dqw_sim_plant;

/// What the states say at one instant.
typedef struct dqw_sim_point {
    double psi_d_Wb, psi_q_Wb, i_d_A, i_q_A;  ///< i: terminal currents, with those of iron loss and short
    double v_x_V, v_y_V, e_x_V, e_y_V;        ///< at the terminals, and induced
    double i_x_A, i_y_A;
    double i_alpha_A, i_beta_A, e_alpha_V, e_beta_V;  ///< where something switches or has a branch of its own
    double v_link_V, i_link_A, iron_S, R_ohm;
    double turn_rad;  ///< electrical angle since t_k
    double w_m_rad_s, psi_m_Wb, torque_Nm, copper_W, iron_W, temp_winding_C, temp_magnet_C, temp_housing_C;
    double friction_Nm, against_Nm;  ///< against: load and cogging
} dqw_sim_point;

/// Harmonics of the magnet's flux at an angle, and their slopes to the electrical angle.
typedef struct dqw_sim_harmonic {
    double d_Wb, q_Wb, d_slope_Wb, q_slope_Wb;
} dqw_sim_harmonic;

/// Lays out the state vector and takes what does not change during a run.
void dqw_sim_plant_init(dqw_sim_plant *p, const dqw_sim_scenario *s, dqw_sim_map *map, const dqw_sim_curve *curve,
                        const dqw_sim_legs *legs);

/// Takes what ramps, as it is at t_s. Returns false where the saturation law is not convex.
bool dqw_sim_plant_ramp(dqw_sim_plant *p, const dqw_sim_scenario *s, double t_s);

/// Evaluates the algebra at local time tau_s since t_k. Returns false where a flux map cannot be inverted.
bool dqw_sim_plant_point(const dqw_sim_plant *p, double tau_s, const double *y, dqw_sim_point *out);

/// dy/dt at local time tau_s, where the algebra is evaluated already. Returns false where a flux map has no energy.
bool dqw_sim_plant_slopes(const dqw_sim_plant *p, double tau_s, const double *y, const dqw_sim_point *o, double *dy);

/// The margins of legs within their dead time, by 2 leg + rail; see dqw_sim_leg_margin.
void dqw_sim_plant_margins(const dqw_sim_plant *p, const double *y, const dqw_sim_point *o, double margin[6]);

/// (E36), (E99).
dqw_sim_harmonic dqw_sim_plant_harmonic(const dqw_sim_plant *p, double theta_e_rad);

/// Magnetic energy in joule of the plant at this angle and flux.
bool dqw_sim_plant_energy(const dqw_sim_plant *p, double theta_e_rad, double psi_m_Wb, double psi_d_Wb, double psi_q_Wb,
                          double *joule);

/// Voltage of the link's source at local time tau_s.
double dqw_sim_plant_source(const dqw_sim_plant *p, double tau_s);

/// Magnet flux at a magnet temperature.
double dqw_sim_plant_magnet(const dqw_sim_plant *p, double temp_magnet_C);

#endif
