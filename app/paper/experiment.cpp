#include "app/paper/experiment.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "dqw_paper.h"

namespace dqw {
namespace {

constexpr std::array<double, 3> kLevels = {0.0, 0.1, 0.2};  // noise
constexpr int kOrdinalEpochs = 30;
constexpr float kStep = 1.0F;
constexpr float kTolerance = 0.01F;

// The Random Learners of one axis with their reservoirs.
class Tapped {
public:
    Tapped(const Axis& axis, std::uint32_t draws, std::uint32_t seed)
    {
        const std::size_t taps = axis.input.size();
        const std::size_t n = axis.input[0].size();
        dqw_tapped_config config{};
        config.taps = static_cast<int>(taps);
        config.step_size = kStep;
        config.capacity = static_cast<std::uint32_t>(n);
        config.draws = draws;
        config.seed = 3 * seed + 1;
        config.tolerance = kTolerance;
        reservoir_.assign(taps, std::vector<dqw_random_sample>(n));
        for (std::size_t i = 0; i < taps; i++) {
            config.x_base[i] = static_cast<float>(rms(axis.input[i]));
            config.y_base[i] = static_cast<float>(rms(axis.target[i]));
            config.reservoir[i] = reservoir_[i].data();
        }
        if (dqw_tapped_init(&learners, &config) != DQW_OK)
            throw std::runtime_error("the tapped Learners refuse the paper's data");
        for (std::size_t k = 0; k < n; k++) {
            float x[DQW_TAPS];
            float y[DQW_TAPS];
            for (std::size_t i = 0; i < taps; i++) {
                x[i] = static_cast<float>(axis.input[i][k]);
                y[i] = static_cast<float>(axis.target[i][k]);
            }
            dqw_tapped_put(&learners, x, y);
        }
    }
    dqw_tapped learners{};

private:
    std::vector<std::vector<dqw_random_sample>> reservoir_;
};

Table1Row learn_row(const PaperData& clean, double noise, std::uint64_t seed)
{
    const Axis axis_d = with_noise(clean.d, noise, 2 * seed);
    const Axis axis_q = with_noise(clean.q, noise, 2 * seed + 1);
    Tapped d(axis_d, kPaperDraws, static_cast<std::uint32_t>(seed));
    Tapped q(axis_q, kPaperDraws, static_cast<std::uint32_t>(seed) + 1000);
    for (int n = 0; n < kPaperIterations; n++) {
        dqw_tapped_iterate(&d.learners);
        dqw_tapped_iterate(&q.learners);
    }
    const double L_q = dqw_tapped_L_H(&q.learners);
    const double p_q = dqw_tapped_pole_pairs(&q.learners);
    const double weight = dqw_tapped_flux_weight(&q.learners);
    return {100 * noise,
            1e3 * dqw_tapped_L_H(&d.learners),
            1e3 * L_q,
            dqw_tapped_pole_pairs(&d.learners),
            p_q,
            weight,
            weight * L_q / p_q};
}

void widen(Worst& worst, const Table1Row& r, const PaperMachine& m)
{
    const auto off = [](double value, double truth) { return 100 * std::abs(value / truth - 1); };
    worst.L = std::max({worst.L, off(r.Ld_mH, 1e3 * m.L_H), off(r.Lq_mH, 1e3 * m.L_H)});
    worst.p = std::max({worst.p, off(r.p_d, m.pole_pairs), off(r.p_q, m.pole_pairs)});
    worst.psi = std::max(worst.psi, off(r.psi_Wb, m.psi_Wb));
}

dqw_ordinal make_ordinal(const Axis& axis, const PaperMachine& m, dqw_ordinal_form form,
                         dqw_ordinal_discretisation discretisation)
{
    dqw_ordinal_config config{};
    config.dt_s = static_cast<float>(m.dt_s);
    config.x_base = static_cast<float>(rms(axis.x_V));
    config.y_base = static_cast<float>(rms(axis.y_A));
    // Far from the truth on purpose: R twice, L half of it.
    config.R_ohm = static_cast<float>(2.0 * m.R_ohm);
    config.L_H = static_cast<float>(0.5 * m.L_H);
    config.form = form;
    config.discretisation = discretisation;
    dqw_ordinal o;
    if (dqw_ordinal_init(&o, &config) != DQW_OK)
        throw std::runtime_error("the Ordinal Learner refuses the paper's data");
    return o;
}

struct Ordinal {
    double R_x, R_y;
    std::uint32_t samples;
};

Ordinal learn_ordinal(const Axis& axis, const PaperMachine& m, std::size_t n, dqw_ordinal_form form,
                      dqw_ordinal_discretisation discretisation, double L_H)
{
    dqw_ordinal o = make_ordinal(axis, m, form, discretisation);
    for (int epoch = 0; epoch < kOrdinalEpochs && !o.converged; epoch++) {
        for (std::size_t k = 0; k < n; k++)
            dqw_ordinal_step(&o, static_cast<float>(axis.x_V[k]), static_cast<float>(axis.y_A[k]));
        dqw_ordinal_end_epoch(&o);
    }
    const auto L = static_cast<float>(L_H);
    return {dqw_ordinal_R_from_x(&o, L), dqw_ordinal_R_from_y(&o, L), o.learned};
}

// First iteration after which a trace stays within 1 % of where it ends.
int settled_at(const std::vector<double>& trace)
{
    int at = static_cast<int>(trace.size());
    while (at > 0 && std::abs(trace[static_cast<std::size_t>(at) - 1] / trace.back() - 1) <= 0.01) at--;
    return at + 1;
}

Figure trace_random(const Axis& axis, const PaperMachine& m, bool q_axis)
{
    Tapped t(axis, kPaperDraws, 1);
    Figure f;
    f.panels = {{q_axis ? "L_q, mH" : "L_d, mH", {}, 1e3 * m.L_H}, {"pole pairs", {}, m.pole_pairs}};
    if (q_axis) f.panels.push_back({"flux, Wb", {}, m.psi_Wb});
    f.panels.push_back({"indicator W_o", {}, 0.0});
    for (int n = 0; n < kPaperIterations; n++) {
        dqw_tapped_iterate(&t.learners);
        const double L = dqw_tapped_L_H(&t.learners);
        const double p = dqw_tapped_pole_pairs(&t.learners);
        f.panels[0].trace.push_back(1e3 * L);
        f.panels[1].trace.push_back(p);
        if (q_axis) f.panels[2].trace.push_back(dqw_tapped_flux_weight(&t.learners) * L / p);
        f.panels.back().trace.push_back(t.learners.learner[DQW_TAP_V].w_o);
    }
    return f;
}

Figure trace_ordinal(const Axis& axis, const PaperMachine& m)
{
    dqw_ordinal o = make_ordinal(axis, m, DQW_ORDINAL_OUTPUT_ERROR, DQW_ORDINAL_EXACT);
    const auto L = static_cast<float>(m.L_H);
    Figure f;
    f.panels = {{"R from x, ohm", {}, m.R_ohm}, {"R from z^{-1}x, ohm", {}, m.R_ohm}, {"indicator W_o", {}, 0.0}};
    for (int epoch = 0; epoch < 5; epoch++) {
        for (std::size_t k = 0; k < kPaperOrdinalSamples; k++) {
            dqw_ordinal_step(&o, static_cast<float>(axis.x_V[k]), static_cast<float>(axis.y_A[k]));
            f.panels[0].trace.push_back(dqw_ordinal_R_from_x(&o, L));
            f.panels[1].trace.push_back(dqw_ordinal_R_from_y(&o, L));
            f.panels[2].trace.push_back(o.w_o);
        }
        dqw_ordinal_end_epoch(&o);
    }
    return f;
}

// Cost of learning an axis' Random Learners until all converge: iterations, and seconds of many repetitions.
struct Cost {
    double iterations = 0, seconds = 0;
};

Cost learning_cost(const Axis& axis, std::uint32_t draws)
{
    constexpr int kRepeat = 2000;
    Cost cost;
    for (int r = 0; r < kRepeat; r++) {
        Tapped t(axis, draws, static_cast<std::uint32_t>(r) + 1);
        const auto start = std::chrono::steady_clock::now();
        int n = 1;
        while (!dqw_tapped_iterate(&t.learners) && n < 100000) n++;
        cost.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        cost.iterations += static_cast<double>(n) / kRepeat;
    }
    return cost;
}

// Table 1 and the worst errors over all seeds.
void random_learners(const PaperData& data, PaperResults& out)
{
    std::uint64_t seed = 0;
    for (const Table1Row& r : kPaperTable1) {
        seed = out.table1.empty() || out.table1.back().noise_percent != r.noise_percent ? 1 : seed + 1;
        out.table1.push_back(learn_row(data, r.noise_percent / 100, seed));
    }
    for (std::size_t i = 0; i < 3; i++) {
        out.paper_worst[i].noise_percent = out.our_worst[i].noise_percent = 100 * kLevels[i];
        for (const Table1Row& r : kPaperTable1)
            if (std::abs(r.noise_percent - 100 * kLevels[i]) < 1e-9) widen(out.paper_worst[i], r, data.machine);
        for (int s = 1; s <= kPaperSeeds; s++)
            widen(out.our_worst[i], learn_row(data, kLevels[i], static_cast<std::uint64_t>(s)), data.machine);
    }
}

// Readings of both axes from one noisy data set. L, where it is needed, is the Random Learner's from the same seed.
std::array<double, 4> readings(const PaperData& data, double noise, std::uint64_t seed, std::size_t n,
                               dqw_ordinal_form form, std::uint32_t& iterations)
{
    const Axis d = with_noise(data.d, noise, 2 * seed);
    const Axis q = with_noise(data.q, noise, 2 * seed + 1);
    const Table1Row rl = learn_row(data, noise, seed);
    const Ordinal od = learn_ordinal(d, data.machine, n, form, DQW_ORDINAL_EXACT, 1e-3 * rl.Ld_mH);
    const Ordinal oq = learn_ordinal(q, data.machine, n, form, DQW_ORDINAL_EXACT, 1e-3 * rl.Lq_mH);
    iterations = std::max(od.samples, oq.samples);
    return {od.R_x, od.R_y, oq.R_x, oq.R_y};
}

OrdinalRow ordinal_learners(const PaperData& data, double noise, PaperResults& out)
{
    const double R = data.machine.R_ohm;
    const auto off = [R](double value) { return 100 * std::abs(value / R - 1); };
    OrdinalRow row;
    row.noise_percent = 100 * noise;
    row.samples = noise > 0 ? data.d.y_A.size() : kPaperOrdinalSamples;
    const int seeds = noise > 0 ? kPaperSeeds : 1;
    for (int s = 1; s <= seeds; s++) {
        const auto seed = static_cast<std::uint64_t>(s);
        std::uint32_t iterations = 0;
        const auto r = readings(data, noise, seed, row.samples, DQW_ORDINAL_OUTPUT_ERROR, iterations);
        const double both = 0.5 * (r[0] + r[2]);
        if (s == 1) row.reading = r, row.R = both;
        if (noise == 0) out.ordinal_iterations = iterations;
        row.worst = std::max(row.worst, off(both));
        row.worst_x = std::max({row.worst_x, off(r[0]), off(r[2])});
        row.worst_z = std::max({row.worst_z, off(r[1]), off(r[3])});
        const auto pairs = readings(data, noise, seed, row.samples, DQW_ORDINAL_PAIRS, iterations);
        for (std::size_t i = 0; i < 4; i++) row.pair_bias[i] += 100 * (pairs[i] / R - 1) / seeds;
    }
    return row;
}

void figures(const PaperData& data, PaperResults& out)
{
    const PaperMachine& m = data.machine;
    out.figures = {trace_random(data.d, m, false), trace_random(data.q, m, true), trace_ordinal(data.d, m),
                   trace_ordinal(data.q, m)};
    const char* const titles[] = {"Random Learners, d-axis", "Random Learners, q-axis", "Ordinal Learner, d-axis",
                                  "Ordinal Learner, q-axis"};
    for (std::size_t i = 0; i < 4; i++) {
        Figure& f = out.figures[i];
        f.title = titles[i];
        f.name = "fig" + std::to_string(6 + i) + ".svg";
        for (std::size_t k = 0; k + 1 < f.panels.size(); k++)
            out.settled[i] = std::max(out.settled[i], settled_at(f.panels[k].trace));
    }
}

}  // namespace

PaperResults paper_results()
{
    const PaperData data = paper_data();
    PaperResults out;
    out.machine = data.machine;
    out.samples = data.d.y_A.size();
    random_learners(data, out);
    for (std::size_t i = 0; i < 3; i++) out.ordinal[i] = ordinal_learners(data, kLevels[i], out);
    out.backward_R_ohm = learn_ordinal(data.d, data.machine, kPaperOrdinalSamples, DQW_ORDINAL_PAIRS,
                                       DQW_ORDINAL_BACKWARD, data.machine.L_H)
                             .R_y;
    figures(data, out);

    const auto everything = static_cast<std::uint32_t>(out.samples);
    const Cost subset_d = learning_cost(data.d, kPaperDraws);
    const Cost subset_q = learning_cost(data.q, kPaperDraws);
    const Cost whole_d = learning_cost(data.d, everything);
    const Cost whole_q = learning_cost(data.q, everything);
    out.whole_over_subset_iterations = (whole_d.iterations + whole_q.iterations) /
                                       (subset_d.iterations + subset_q.iterations);
    out.whole_over_subset_time = (whole_d.seconds + whole_q.seconds) / (subset_d.seconds + subset_q.seconds);
    return out;
}

}  // namespace dqw
