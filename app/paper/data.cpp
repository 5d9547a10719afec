#include "app/paper/data.hpp"

#include <cmath>
#include <random>
#include <stdexcept>

#include "dqw_sim.h"

namespace dqw {

const std::vector<Table1Row> kPaperTable1 = {
    {0, 0.326, 0.326, 4, 4, 245.400, 0.0200},          {10, 0.319, 0.312, 3.978, 4.128, 231.248, 0.0175},
    {10, 0.326, 0.336, 4.073, 4.415, 256.350, 0.0195}, {10, 0.330, 0.330, 4.086, 3.955, 258.500, 0.0216},
    {20, 0.326, 0.338, 3.918, 4.645, 269.093, 0.0196}, {20, 0.336, 0.349, 4.068, 3.797, 263.751, 0.0242},
    {20, 0.323, 0.395, 4.007, 3.458, 246.805, 0.0282},
};

double rms(const std::vector<double>& x)
{
    double sum = 0.0;
    for (double v : x) sum += v * v;
    return std::sqrt(sum / static_cast<double>(x.size()));
}

PaperData paper_data()
{
    const dqw_sim_scenario* s = dqw_sim_scenario_find("paper_step");
    if (s == nullptr) throw std::runtime_error("scenario paper_step is missing");
    std::vector<dqw_sim_row> rows(dqw_sim_rows(s));
    dqw_sim_report report;
    if (dqw_sim_run(s, rows.data(), rows.size(), &report, nullptr, nullptr) != DQW_SIM_OK)
        throw std::runtime_error(report.message);

    const dqw_sim_machine& m = s->machine;
    const double p = m.pole_pairs;
    PaperData data{{m.R_ohm, m.Ld_H, p, m.psi_Wb, s->drive.dt_s}, {}, {}};
    data.d.input.resize(2);
    data.q.input.resize(3);
    data.d.target.resize(2);
    data.q.target.resize(3);
    const auto tap = [](Axis& axis, std::size_t i, double input, double target) {
        axis.input[i].push_back(input);
        axis.target[i].push_back(target);
    };
    for (std::size_t k = 0; k < rows.size(); k++) {
        const dqw_sim_row& r = rows[k];
        const dqw_sim_row& n = rows[k + 1 < rows.size() ? k + 1 : k];
        const double wi_d = r.w_m_rad_s * r.i_d_A;
        const double wi_q = r.w_m_rad_s * r.i_q_A;
        tap(data.d, 0, r.v_d_V, r.v_d_V / m.Ld_H);
        tap(data.d, 1, wi_q, p * m.Lq_H / m.Ld_H * wi_q);
        tap(data.q, 0, r.v_q_V, r.v_q_V / m.Lq_H);
        tap(data.q, 1, wi_d, p * m.Ld_H / m.Lq_H * wi_d);
        tap(data.q, 2, r.w_m_rad_s, p * m.psi_Wb / m.Lq_H * r.w_m_rad_s);
        const double w = 0.5 * (r.w_m_rad_s + n.w_m_rad_s);
        data.d.x_V.push_back(r.v_d_V + 0.5 * p * m.Lq_H * (wi_q + n.w_m_rad_s * n.i_q_A));
        data.d.y_A.push_back(r.i_d_A);
        data.q.x_V.push_back(r.v_q_V - 0.5 * p * m.Ld_H * (wi_d + n.w_m_rad_s * n.i_d_A) - p * m.psi_Wb * w);
        data.q.y_A.push_back(r.i_q_A);
    }
    return data;
}

Axis with_noise(const Axis& clean, double fraction, std::uint64_t seed)
{
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    Axis noisy = clean;
    const auto add = [&](std::vector<double>& x) {
        const double sigma = fraction * rms(x);
        for (double& v : x) v += sigma * normal(generator);
    };
    for (auto& x : noisy.input) add(x);
    for (auto& x : noisy.target) add(x);
    add(noisy.x_V);
    add(noisy.y_A);
    return noisy;
}

}  // namespace dqw
