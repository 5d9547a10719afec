#include "app/paper/paper.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/paper/experiment.hpp"

namespace dqw {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kPaperTimeRatio = 218.0 / 70.0;

Json json_row(const Table1Row& r)
{
    return {{"noise_percent", r.noise_percent}, {"Ld_mH", r.Ld_mH},  {"Lq_mH", r.Lq_mH}, {"p_d", r.p_d}, {"p_q", r.p_q},
            {"flux_weight", r.flux_weight},     {"psi_Wb", r.psi_Wb}};
}

Json json_worst(const Worst& w)
{
    return {{"noise_percent", w.noise_percent}, {"L_percent", w.L}, {"p_percent", w.p}, {"psi_percent", w.psi}};
}

void print_json(const PaperResults& r, const std::string& drawn)
{
    Json out{{"schema", "dqwatch.paper/1"}, {"seeds", kPaperSeeds}};
    for (std::size_t i = 0; i < r.table1.size(); i++)
        out["table1"].push_back({{"paper", json_row(kPaperTable1[i])}, {"ours", json_row(r.table1[i])}});
    for (std::size_t i = 0; i < 3; i++)
        out["worst"].push_back({{"paper", json_worst(r.paper_worst[i])}, {"ours", json_worst(r.our_worst[i])}});
    for (const OrdinalRow& o : r.ordinal)
        out["ordinal"].push_back({{"noise_percent", o.noise_percent},
                                  {"samples", o.samples},
                                  {"R_ohm", o.R},
                                  {"worst_percent", o.worst},
                                  {"readings_ohm", o.reading},
                                  {"worst_from_x_percent", o.worst_x},
                                  {"worst_from_z_percent", o.worst_z},
                                  {"pair_regression_bias_percent", o.pair_bias}});
    out["backward_difference_R_ohm"] = r.backward_R_ohm;
    out["iterations_to_converge"] = {
        {"random_d", r.settled[0]}, {"random_q", r.settled[1]}, {"ordinal", r.ordinal_iterations}};
    out["whole_set_over_subset"] = {{"iterations", r.whole_over_subset_iterations},
                                    {"time", r.whole_over_subset_time},
                                    {"paper_time", kPaperTimeRatio}};
    out["figures"] = drawn;
    fmt::print("{}\n", out.dump(1));
}

void print_table1(const PaperResults& r)
{
    const PaperMachine& m = r.machine;
    fmt::print("Machine: R {:.3g} ohm, L_d = L_q {:.3f} mH, p {:.0f}, flux {:.4f} Wb; {} samples every {:.1g} ms.\n"
               "Signals tapped inside the simulation; white noise of x % of each signal's RMS on every input and every "
               "target.\n\n",
               m.R_ohm, 1e3 * m.L_H, m.pole_pairs, m.psi_Wb, r.samples, 1e3 * m.dt_s);
    fmt::print("Table 1: Random Learners, {} of {} samples an epoch, {} iterations\n(flux from the columns themselves; "
               "the paper prints ten times that)\n",
               kPaperDraws, r.samples, kPaperIterations);
    fmt::print("{:>7} {:>6} | {:>8} {:>8} {:>7} {:>7} {:>10} {:>8}\n", "noise %", "", "L_d mH", "L_q mH", "p_d", "p_q",
               "flux p/L_q", "flux Wb");
    const auto line = [](const char* whose, const Table1Row& t) {
        fmt::print("{:>7.0f} {:>6} | {:>8.3f} {:>8.3f} {:>7.3f} {:>7.3f} {:>10.3f} {:>8.4f}\n", t.noise_percent, whose,
                   t.Ld_mH, t.Lq_mH, t.p_d, t.p_q, t.flux_weight, t.psi_Wb);
    };
    for (std::size_t i = 0; i < r.table1.size(); i++) {
        line("paper", kPaperTable1[i]);
        line("ours", r.table1[i]);
    }
    fmt::print("\nWorst error, % (the paper's over its rows, ours over {} seeds)\n{:>7} | {:>7} {:>7} | {:>7} {:>7} | "
               "{:>7} {:>7}\n",
               kPaperSeeds, "noise %", "L paper", "ours", "p paper", "ours", "flux p.", "ours");
    for (std::size_t i = 0; i < 3; i++)
        fmt::print("{:>7.0f} | {:>7.2f} {:>7.2f} | {:>7.2f} {:>7.2f} | {:>7.2f} {:>7.2f}\n",
                   r.our_worst[i].noise_percent, r.paper_worst[i].L, r.our_worst[i].L, r.paper_worst[i].p,
                   r.our_worst[i].p, r.paper_worst[i].psi, r.our_worst[i].psi);
}

void print_ordinal(const PaperResults& r)
{
    fmt::print(
        "\nR by the Ordinal Learner, ohm (truth {:.3f}; paper: 100 samples, 0.370 0.368 0.328 0.377, worst 11.4 %)\n",
        r.machine.R_ohm);
    fmt::print("{:>7} {:>7} | {:>7} {:>7} {:>7} {:>7} {:>7} | worst % of {:>5} {:>6} {:>6} | {}\n", "noise %",
               "samples", "R", "d, x", "d, z^-1", "q, x", "q, z^-1", "R", "x", "z^-1",
               "plain pairs' mean error %, as the readings");
    for (const OrdinalRow& o : r.ordinal)
        fmt::print("{:>7.0f} {:>7} | {:>7.4f} {:>7.4f} {:>7.4f} {:>7.4f} {:>7.4f} | {:>16.2f} {:>6.2f} {:>6.2f} | "
                   "{:+.1f} {:+.1f} {:+.1f} {:+.1f}\n",
                   o.noise_percent, o.samples, o.R, o.reading[0], o.reading[1], o.reading[2], o.reading[3], o.worst,
                   o.worst_x, o.worst_z, o.pair_bias[0], o.pair_bias[1], o.pair_bias[2], o.pair_bias[3]);
    fmt::print(
        "R is the mean of both axes' readings from the weight of x, which need no inductance; the readings from the "
        "weight of\n"
        "z^-1 take the Random Learner's L. Worst over {} seeds. Plain pairs: regression on measured consecutive "
        "pairs.\n"
        "Read with the paper's backward difference, the same noise-free weights say R = {:.3f} ohm ({:+.1f} %).\n",
        kPaperSeeds, r.backward_R_ohm, 100 * (r.backward_R_ohm / r.machine.R_ohm - 1));
}

}  // namespace

int run_paper(const std::string& out_dir, bool json)
{
    const PaperResults r = paper_results();
    const std::string drawn = draw_figures(r.figures, out_dir);
    if (json) {
        print_json(r, drawn);
        return 0;
    }
    print_table1(r);
    print_ordinal(r);
    fmt::print("\nIterations until every weight stays within 1 % of its end, noise-free: Random Learners d {} (paper "
               "about 150),\n"
               "q {} (paper about 300); Ordinal Learner converged after {} (paper 500).\n",
               r.settled[0], r.settled[1], r.ordinal_iterations);
    fmt::print(
        "Learning from the whole set over learning from random subsets, until converged: {:.1f} times the iterations,\n"
        "{:.1f} times the time (paper {:.1f}).\n{}\n",
        r.whole_over_subset_iterations, r.whole_over_subset_time, kPaperTimeRatio, drawn);
    return 0;
}

}  // namespace dqw
