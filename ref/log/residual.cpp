#include "ref/log/residual.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ref/log/piece.hpp"
#include "ref/log/wanted.hpp"

namespace dqw {
namespace {

double known(double x) { return std::isnan(x) ? 0.0 : x; }

PlainModel without_unknowns(const PlainModel& m)
{
    PlainModel k;
    k.pole_pairs = std::isnan(m.pole_pairs) ? 1.0 : m.pole_pairs;
    k.R_ohm = known(m.R_ohm), k.Ld_H = known(m.Ld_H), k.Lq_H = known(m.Lq_H), k.psi_Wb = known(m.psi_Wb);
    k.J_kgm2 = known(m.J_kgm2), k.B_Nms_rad = known(m.B_Nms_rad);
    k.torque_constant_Nm_A = known(m.torque_constant_Nm_A);
    return k;
}

/// Squares of one axis: of its block residuals and of what they are a percentage of.
struct Axis {
    const char* name;
    double residual2 = 0.0, signal2 = 0.0;
    std::size_t blocks = 0, rows = 0;

    void block(double residual) { residual2 += residual * residual, ++blocks; }
    void row(double signal) { signal2 += signal * signal, ++rows; }
};

double column_or_zero(const std::vector<double>& column, std::size_t k) { return column.empty() ? 0.0 : column[k]; }

void add_static(const Log& log, const PlainModel& m, Axis& d, Axis& q)
{
    for (std::size_t k = 0; k < log.rows(); ++k) {
        const double w = log.regime == Regime::standstill ? 0.0 : m.pole_pairs * column_or_zero(log.w_m_rad_s, k);
        const double i_d = column_or_zero(log.i_d_A, k), i_q = column_or_zero(log.i_q_A, k);
        const double v_d = column_or_zero(log.v_d_V, k), v_q = column_or_zero(log.v_q_V, k);
        d.row(v_d), q.row(v_q);
        d.block(v_d - (m.R_ohm * i_d - w * m.Lq_H * i_q));
        q.block(v_q - (m.R_ohm * i_q + w * (m.Ld_H * i_d + m.psi_Wb)));
    }
}

void add_dynamic(const Log& log, const Piece& piece, const PlainModel& m, Axis& d, Axis& q)
{
    const std::size_t n = block_rows(log);
    for (std::size_t k = piece.begin; k + n < piece.end; k += n) {
        ask_at(k, n);
        double e_d = 0.0, e_q = 0.0;
        const double time_s = span_s(piece, k, n);
        for (std::size_t r = k; r < k + n; ++r) {
            add_period(log, m, r, piece.period_s(r), e_d, e_q);
            d.row(log.v_d_V[r]), q.row(log.v_q_V[r]);
        }
        d.block((e_d - m.Ld_H * (log.i_d_A[k + n] - log.i_d_A[k])) / time_s);
        q.block((e_q - m.Lq_H * (log.i_q_A[k + n] - log.i_q_A[k])) / time_s);
    }
}

void add_mechanical(const Log& log, const Piece& piece, const std::vector<double>& torque, const PlainModel& m,
                    Axis& axis)
{
    const std::size_t n = block_rows(log);
    const auto& w = log.w_m_rad_s;
    for (std::size_t k = piece.begin; k + n < piece.end; k += n) {
        double e = 0.0;
        const double time_s = span_s(piece, k, n);
        for (std::size_t r = k; r < k + n; ++r) {
            const double dt = piece.period_s(r);
            e += 0.5 * (torque[r] + torque[r + 1] - m.B_Nms_rad * (w[r] + w[r + 1])) * dt;
            axis.row(torque[r]);
        }
        axis.block((e - m.J_kgm2 * (w[k + n] - w[k])) / time_s);
    }
}

void report(const std::vector<Axis>& axes, const char* unit, Result& result)
{
    double sum = 0.0;
    std::size_t blocks = 0;
    result.axes.clear();
    for (const Axis& a : axes) {
        const double rms = a.blocks > 0 ? std::sqrt(a.residual2 / static_cast<double>(a.blocks)) : 0.0;
        const double signal = a.rows > 0 ? std::sqrt(a.signal2 / static_cast<double>(a.rows)) : 0.0;
        result.axes.push_back({a.name, rms, signal > 0.0 ? 100.0 * rms / signal : 0.0});
        sum += a.residual2;
        blocks += a.blocks;
    }
    result.residual_rms = blocks > 0 ? std::sqrt(sum / static_cast<double>(blocks)) : 0.0;
    result.residual_unit = unit;
}

}  // namespace

/// While the rotor turns under a voltage that stands still, the flux linkage bends, and it does by what its own change
/// makes of the voltage that is left: its mean over dt is that of its two ends plus dt/12 (dt w_e J v + (R + w_e J L)
/// di). (E16)
void add_period(const Log& log, const PlainModel& m, std::size_t k, double dt_s, double& d, double& q)
{
    const double w0 = m.pole_pairs * log.w_m_rad_s[k], w1 = m.pole_pairs * log.w_m_rad_s[k + 1], w = 0.5 * (w0 + w1);
    const double turn = m.rotor_held ? 0.0 : dt_s * w, by_d = log.i_d_A[k + 1] - log.i_d_A[k],
                 by_q = log.i_q_A[k + 1] - log.i_q_A[k],
                 bend_d = dt_s / 12.0 * (m.R_ohm * by_d - w * m.Lq_H * by_q - turn * log.v_q_V[k]),
                 bend_q = dt_s / 12.0 * (m.R_ohm * by_q + w * m.Ld_H * by_d + turn * log.v_d_V[k]);
    const double i_d = 0.5 * (log.i_d_A[k] + log.i_d_A[k + 1]) + (m.Ld_H > 0.0 ? bend_d / m.Ld_H : 0.0);
    const double i_q = 0.5 * (log.i_q_A[k] + log.i_q_A[k + 1]) + (m.Lq_H > 0.0 ? bend_q / m.Lq_H : 0.0);
    const double psi_d0 = m.Ld_H * log.i_d_A[k] + m.psi_Wb, psi_d1 = m.Ld_H * log.i_d_A[k + 1] + m.psi_Wb;
    const double psi_q0 = m.Lq_H * log.i_q_A[k], psi_q1 = m.Lq_H * log.i_q_A[k + 1];
    d += (log.v_d_V[k] - m.R_ohm * i_d + 0.5 * (w0 * psi_q0 + w1 * psi_q1) + w * bend_q) * dt_s;
    q += (log.v_q_V[k] - m.R_ohm * i_q - 0.5 * (w0 * psi_d0 + w1 * psi_d1) - w * bend_d) * dt_s;
}

std::vector<double> torque_of(const Log& log, double torque_constant_Nm_A, std::string& source)
{
    if (!log.torque_Nm.empty()) {
        source = "torque_Nm";
        return log.torque_Nm;
    }
    if (!log.i_q_A.empty() && torque_constant_Nm_A != 0.0 && !std::isnan(torque_constant_Nm_A)) {
        source = "torque_constant_Nm_A * i_q_A";
        std::vector<double> torque = log.i_q_A;
        for (double& x : torque) x *= torque_constant_Nm_A;
        return torque;
    }
    source = log.torque_cmd_Nm.empty() ? "" : "torque_cmd_Nm";
    return log.torque_cmd_Nm;
}

void report_residual(const std::vector<Log>& logs, const PlainModel& model, Result& result)
{
    const PlainModel m = without_unknowns(model);
    if (!logs.empty() && logs.front().regime == Regime::mechanical) {
        std::vector<Axis> axes(1);
        axes[0].name = "torque";
        std::string source;
        for (const Log& log : logs) {
            const std::vector<double> torque = torque_of(log, m.torque_constant_Nm_A, source);
            if (torque.empty()) continue;
            for (const Piece& piece : pieces_of(log, 2)) add_mechanical(log, piece, torque, m, axes[0]);
        }
        report(axes, "Nm", result);
        return;
    }
    std::vector<Axis> axes(2);
    axes[0].name = "d";
    axes[1].name = "q";
    for (const Log& log : logs) {
        if (log.regime != Regime::dynamic) {
            add_static(log, m, axes[0], axes[1]);
            continue;
        }
        for (const Piece& piece : pieces_of(log, 2)) add_dynamic(log, piece, m, axes[0], axes[1]);
    }
    report(axes, "V", result);
}

}  // namespace dqw
