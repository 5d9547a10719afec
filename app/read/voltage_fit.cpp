#include "app/read/voltage_fit.hpp"

#include <algorithm>

#include "app/base/least_squares.hpp"

namespace dqw {
namespace {

struct Signed {
    const double* values;
    double sign;
    double operator[](std::size_t k) const { return sign * values[k]; }
};

/// Of a polled row the mean speed is near that of the instants at its ends.
double speed(const SpeedProbe& p, std::size_t k)
{
    const double* w = p.column[col_w_m];
    return p.regime != Regime::polled || k == 0 || !p.column[col_t] || gap_before(p, k) ? w[k]
                                                                                        : 0.5 * (w[k] + w[k - 1]);
}

VoltageFit solved(const LeastSquares<unknown_count>& fit, std::size_t equations)
{
    VoltageFit result;
    fit.solve(result.value, result.sd);
    result.left = fit.left(result.value);
    for (std::size_t u = 0; u < unknown_count; ++u) result.share[u] = fit.share(u, result.value[u]);
    result.equations = equations;
    return result;
}

/// (E150) of half a log: a size's direction is found anew until it stays.
VoltageFit fit_half(const SpeedProbe& p, const Axes& axes, std::size_t rows)
{
    const double *v = p.column[col_v_q], *i = p.column[col_i_q];
    VoltageFit found = {};
    for (int round = 0; round < (p.v_q_is_size ? 8 : 1); ++round) {
        LeastSquares<unknown_count> fit;
        for (std::size_t k = 0; k < rows; ++k) {
            const double w = speed(p, k), i_q = axes.i_q * i[k];
            const double d = -found.value[pLq] * w * i_q, q = found.value[R] * i_q + found.value[ppsi] * w;
            const double size = q < 0 ? -std::hypot(d, q) : std::hypot(d, q);
            const double n_d = size != 0 ? d / size : 0.0, n_q = size != 0 ? q / size : 1.0;
            fit.add({n_q * i_q, 0, 0, 0, -n_d * w * i_q, n_q * w}, axes.v_q * v[k]);
        }
        found = solved(fit, rows);
        // The first direction is q's, where L does not show; a tenth of the flux at the mean current is a start.
        if (p.v_q_is_size && round == 0) found.value[pLq] = 0.1 * found.value[ppsi] / (1e-12 + rms(i, rows));
    }
    return found;
}

}  // namespace

double rms(const double* x, std::size_t rows)
{
    double sum = 0;
    for (std::size_t k = 0; x && k < rows; ++k) sum += x[k] * x[k];
    return rows ? std::sqrt(sum / static_cast<double>(rows)) : 0.0;
}

bool gap_before(const SpeedProbe& p, std::size_t k)
{
    return p.column[col_t][k] - p.column[col_t][k - 1] > 1.5 * p.median_dt_s;
}

VoltageFit fit_voltages(const SpeedProbe& p, const Axes& axes, std::size_t most_rows)
{
    if (p.is_half()) return fit_half(p, axes, std::min(p.rows, most_rows));
    const bool x = axes.exchanged;
    const Signed v_d{p.column[x ? col_v_q : col_v_d], axes.v_d}, v_q{p.column[x ? col_v_d : col_v_q], axes.v_q},
        i_d{p.column[x ? col_i_q : col_i_d], axes.i_d}, i_q{p.column[x ? col_i_d : col_i_q], axes.i_q};
    const double* w = p.column[col_w_m];
    const std::size_t rows = std::min(p.rows, most_rows);
    LeastSquares<unknown_count> fit;
    std::size_t equations = 0;
    if (p.regime != Regime::dynamic) {
        for (std::size_t k = 0; k < rows; ++k) {
            const double w_k = speed(p, k);
            fit.add({i_d[k], 0, 0, 0, -w_k * i_q[k], 0}, v_d[k]);
            fit.add({i_q[k], 0, 0, w_k * i_d[k], 0, w_k}, v_q[k]);
            equations += 2;
        }
    } else {
        constexpr std::size_t block = 20;
        const double* t = p.column[col_t];
        for (std::size_t first = 0; first + block < rows; first += block) {
            double s_vd = 0, s_vq = 0, s_id = 0, s_iq = 0, s_w = 0, s_wid = 0, s_wiq = 0;
            bool whole = true;
            for (std::size_t k = first; k < first + block; ++k) {
                whole = whole && !gap_before(p, k + 1);
                const double dt = t[k + 1] - t[k], wm = 0.5 * (w[k] + w[k + 1]);
                const double d = 0.5 * (i_d[k] + i_d[k + 1]), q = 0.5 * (i_q[k] + i_q[k + 1]);
                s_vd += v_d[k] * dt, s_vq += v_q[k] * dt, s_id += d * dt, s_iq += q * dt, s_w += wm * dt,
                    s_wid += wm * d * dt, s_wiq += wm * q * dt;
            }
            if (!whole) continue;
            fit.add({s_id, i_d[first + block] - i_d[first], 0, 0, -s_wiq, 0}, s_vd);
            fit.add({s_iq, 0, i_q[first + block] - i_q[first], s_wid, 0, s_w}, s_vq);
            equations += 2;
        }
    }
    return solved(fit, equations);
}

}  // namespace dqw
