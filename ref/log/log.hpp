// A measured or simulated log in memory, in SI units. Plain data: no Ceres, no file format.
#ifndef DQW_REF_LOG_LOG_HPP
#define DQW_REF_LOG_LOG_HPP

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace dqw {

/// polled: currents and voltages are means over the interval before their row, the speed is an instant.
enum class Regime { dynamic, steady, standstill, mechanical, polled };

/// What the machine file says. Nominal values are starting points and bases, never a prior.
struct Machine {
    std::string name;
    std::string flux_map;  ///< file; empty: nothing is said
    std::optional<double> pole_pairs, R_ohm, Ld_H, Lq_H, psi_Wb, J_kgm2, B_Nms_rad, torque_constant_Nm_A;
    /// Phase voltage and current, peak, and the highest speed: what stands on the nameplate.
    std::optional<double> v_rated_V, i_rated_A, w_max_rad_s;
};

/// One machine's log. A column that the file lacks is empty; every other has rows() entries, all finite. A polled log
/// may lack i_d, which is then taken as zero, and v_d: then v_q is alone, or the whole voltage.
/// Row k: currents, speed and angle at t_k; v_d, v_q are the rotating-frame means from t_k to t_{k+1}
/// (the reader has already turned `voltage_interval = "previous"` round).
struct Log {
    std::string path;
    Regime regime = Regime::dynamic;
    Machine machine;
    std::vector<double> t_s, v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s;
    std::vector<double> theta_e_rad, theta_m_rad, v_dc_V, temp_winding_C, temp_magnet_C, torque_Nm, torque_cmd_Nm;
    /// First row of each stretch without a gap in time; {0} for a log without gaps or without time.
    std::vector<std::size_t> segments{0};
    /// Which legs of the inverter switch, as the machine file names it; empty: nothing is said, and all do.
    std::string modulation;
    bool observed = false;         ///< the angle is an observer's
    bool v_q_is_size = false;      ///< of the voltage's vector, without v_d
    bool previous = false;         ///< the file's voltages were those until a row
    bool of_polled = false;        ///< settled points that were rows of a polled log
    std::string doubt;             ///< of a column's unit or sign, in words; empty: none
    double voltage_error_V = 0.0;  ///< by how much the voltage may be off, unseen
    double voltage_scale = 0.0;    ///< deviation of the scale that it is given in, as a part
    double speed_lag_s = 0.0;      ///< by which the speed was late, and has been brought forward
    /// Of R, L_d, L_q, psi: deviations of the polled rows behind settled points, which do not show them; 0: none.
    std::array<double, 4> rows_sd{};
    /// Median sampling period; 0 without t_s.
    double dt_s = 0.0;

    std::size_t rows() const
    {
        for (const auto* c : {&w_m_rad_s, &i_q_A, &i_d_A, &v_q_V, &v_d_V, &t_s})
            if (!c->empty()) return c->size();
        return 0;
    }
};

}  // namespace dqw
#endif
