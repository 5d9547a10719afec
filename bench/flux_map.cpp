// Flux maps from logs of iron whose map is known: two that were measured, each made one co-energy by the simulator, and
// a steep one of our own. flux_map [IRON [NOISE [SEED [PAGE.html]]]]: of one iron, at one noise, drawn by a seed, with
// its picture.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "app/base/output.hpp"
#include "app/job/simulate.hpp"
#include "app/trace/maps_page.hpp"
#include "ref/trace/trace.hpp"

extern "C" {
#include "sim_map.h"
}

namespace {

using dqw::FluxMap;
using dqw::TraceResult;

/// Columns of a log as the command's reader would have them.
dqw::Log log_of(const dqw::Simulation& simulation)
{
    dqw::Log log;
    log.path = "flux_map";
    log.machine.pole_pairs = simulation.scenario.machine.pole_pairs;
    for (const dqw_sim_row& r : simulation.rows) {
        log.t_s.push_back(r.t_s), log.v_d_V.push_back(r.v_d_V), log.v_q_V.push_back(r.v_q_V);
        log.i_d_A.push_back(r.i_d_A), log.i_q_A.push_back(r.i_q_A), log.w_m_rad_s.push_back(r.w_m_rad_s);
        log.theta_e_rad.push_back(r.theta_e_rad);
    }
    log.dt_s = simulation.scenario.drive.dt_s;
    return log;
}

struct Machine {
    const char* name;
    std::string map;  ///< file
    std::vector<std::string> settings;
};

/// W' of a leakage and of iron that is driven into its knee: steep where the currents' norm passes that of the knee.
void write_steep(const std::string& path)
{
    constexpr double kLeakage_H = 1.2e-3, kIron_Wb = 0.30, kKnee_A = 6.0, kMagnet_A = 8.0, kQ = 1.4;
    std::ofstream file(path);
    file << "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n";
    for (int d = -16; d <= 16; ++d)
        for (int q = -16; q <= 16; ++q) {
            const double x = (d + kMagnet_A) / kKnee_A, y = q / (kQ * kKnee_A), norm = std::sqrt(1 + x * x + y * y);
            file << d << "," << q << "," << kLeakage_H * d + kIron_Wb * x / norm << ","
                 << kLeakage_H * q + kIron_Wb / kQ * y / norm << "\n";
        }
}

const std::vector<std::string> kSteps = {"duration_s=4", "profile.shaft=imposed", "profile.control=current",
                                         "profile.v_d_V.binary=0", "profile.v_q_V.binary=0"};

std::vector<Machine> machines(const std::string& data, const std::string& scratch)
{
    const std::string steep = scratch + "/steep.csv";
    write_steep(steep);
    return {{"Baldor PM-SynRM",
             data + "/flux_map_baldor.csv",
             {"machine.R_ohm=0.63", "machine.pole_pairs=2", "profile.speed_rad_s.wave=40", "drive.v_dc_V=560",
              "drive.i_max_A=16", "drive.current_bandwidth_rad_s=300", "profile.i_d_A=-5", "profile.i_d_A.random=4",
              "profile.i_d_A.random_hold_s=0.05", "profile.i_q_A.random=9", "profile.i_q_A.random_hold_s=0.031"}},
            {"AM8141 servo",
             data + "/flux_map_am8141.csv",
             {"machine.R_ohm=0.51", "profile.i_d_A=-3.5", "profile.i_d_A.random=3", "profile.i_d_A.random_hold_s=0.05",
              "profile.i_q_A.random=6.5", "profile.i_q_A.random_hold_s=0.031"}},
            {"steep, of our own",
             steep,
             {"machine.R_ohm=0.8", "profile.speed_rad_s.wave=60", "drive.current_bandwidth_rad_s=300",
              "drive.i_max_A=14", "profile.i_d_A=-4", "profile.i_d_A.random=4", "profile.i_d_A.random_hold_s=0.05",
              "profile.i_q_A.random=9", "profile.i_q_A.random_hold_s=0.031"}}};
}

/// What the command line says beside the iron and the noise.
struct Asked {
    std::string seed = "1", page;  ///< page: file of the page that shows the map beside the true one
};

struct Score {
    double rms = 0, rated = 0, within = 0, sd = 0, n = 0;
};

/// Against the simulator's projection of the map, at the nodes that the log saw, or did not.
Score score_of(const FluxMap& map, const dqw_sim_map& truth, bool seen)
{
    Score s;
    std::vector<double> size;
    double out_of = 0;
    for (std::size_t d = 0; d < map.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < map.i_q_A.size(); ++q) {
            const dqw::FluxNode& node = map.at(d, q);
            double psi_d, psi_q, L[3];
            dqw_sim_map_flux(&truth, map.i_d_A[d], map.i_q_A[q], &psi_d, &psi_q, L);
            if (node.seen) size.push_back(std::hypot(psi_d, psi_q));
            if (node.seen != seen) continue;
            const double e_d = node.psi_d_Wb - psi_d, e_q = node.psi_q_Wb - psi_q;
            s.rms += e_d * e_d + e_q * e_q, ++s.n;
            s.sd += node.sd_d_Wb * node.sd_d_Wb + node.sd_q_Wb * node.sd_q_Wb;
            s.within += std::abs(e_d) <= 2 * node.sd_d_Wb, s.within += std::abs(e_q) <= 2 * node.sd_q_Wb, out_of += 2;
        }
    if (!(s.n > 0)) return s;
    std::sort(size.begin(), size.end());
    s.rated = size[static_cast<std::size_t>(0.95 * static_cast<double>(size.size() - 1))];
    s.rms = std::sqrt(s.rms / s.n) / s.rated, s.sd = std::sqrt(s.sd / s.n) / s.rated, s.within /= out_of;
    return s;
}

/// The measured map at the learned one's currents, all of which count.
FluxMap truth_of(const FluxMap& map, const dqw_sim_map& truth)
{
    FluxMap out = map;
    for (std::size_t d = 0; d < map.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < map.i_q_A.size(); ++q) {
            dqw::FluxNode& n = out.nodes[d * map.i_q_A.size() + q];
            double L[3];
            dqw_sim_map_flux(&truth, map.i_d_A[d], map.i_q_A[q], &n.psi_d_Wb, &n.psi_q_Wb, L);
            n.L_dd_H = L[0], n.L_dq_H = L[1], n.L_qq_H = L[2], n.sd_d_Wb = n.sd_q_Wb = n.sd_dd_H = n.sd_qq_H = 0;
        }
    return out;
}

void run(const Machine& m, double noise, const Asked& asked)
{
    dqw_sim_scenario s = dqw::scenario_named("servo");
    for (const std::string& setting : kSteps) dqw::set(s, setting);
    for (const std::string& setting : m.settings) dqw::set(s, setting);
    dqw::set(s, "machine.flux_map=" + m.map), dqw::set(s, "noise=" + std::to_string(noise));
    // A speed sensor has no such noise.
    dqw::set(s, "noise.w=0.0005");
    dqw::set(s, "seed=" + asked.seed);
    const dqw::Log log = log_of(dqw::simulate(s, [](double) {}));
    const std::clock_t start = std::clock();
    // Of the other candidates most is time, and nothing is said of how true a map is.
    const TraceResult r = dqw::trace({log}, {{"saturation", "cross_saturation", "angle_offset", "dead_time"}, {}});
    const double took = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    dqw_sim_grid grid;
    static dqw_sim_map truth;
    char message[300] = "";
    if (dqw_sim_grid_read(m.map.c_str(), &grid, message, sizeof message) != 0 ||
        dqw_sim_map_fit(&grid, &truth, message, sizeof message) != 0) {
        std::printf("%s\n", message);
        return;
    }
    dqw_sim_grid_free(&grid);
    const Score in = score_of(r.map, truth, true), out = score_of(r.map, truth, false);
    double R = NAN, R_sd = NAN;
    for (const dqw::Estimate& e : r.after.parameters)
        if (e.name == "R_ohm") R = e.value, R_sd = e.sd;
    std::string names;
    for (const dqw::TraceEffect& e : r.effects) names += (names.empty() ? "" : " ") + e.name;
    std::printf("| %s | %g | %.3f (%.3f) | %.0f | %.2f (%.2f) | %.0f | %.0f | %+.2f (%.2f) | %.2f | %s | %.0f |\n",
                m.name, 100 * noise, 100 * in.rms, 100 * in.sd, 100 * in.within, 100 * out.rms, 100 * out.sd,
                100 * out.within, 100 * in.n / std::max(in.n + out.n, 1.0), 100 * (R / s.machine.R_ohm - 1),
                100 * R_sd / s.machine.R_ohm, r.after.heldout_rms / r.noise_floor, (r.verdict + ": " + names).c_str(),
                took);
    std::fflush(stdout);
    if (!asked.page.empty())
        dqw::write_file(asked.page,
                        dqw::maps_page({std::string("what a log says"), m.name}, r.map, truth_of(r.map, truth)));
}

}  // namespace

int main(int argc, char** argv)
{
    const char* folder = std::getenv("DATA");
    const std::string data = folder != nullptr && *folder != '\0' ? folder : "../shared/data";
    const std::string scratch = (std::filesystem::temp_directory_path() / "dqwatch_flux_map").string();
    std::filesystem::create_directories(scratch);
    const std::string only = argc > 1 ? argv[1] : "";
    std::vector<double> levels = {0.003, 0.01, 0.03};
    if (argc > 2) levels = {std::atof(argv[2])};
    std::printf(
        "Flux maps from 4 s of steps at 10 kHz; errors in %% of the flux at the largest currents (stated), part of "
        "the flux within two deviations, %%\n\n"
        "| iron | noise, %% | where the log was | within | elsewhere | within | seen | R (stated) | over the floor | "
        "found | CPU s "
        "|\n| --- | --: | --: | --: | --: | --: | --: | --: | --: | --- | --: |\n");
    Asked asked;
    if (argc > 3) asked.seed = argv[3];
    if (argc > 4) asked.page = argv[4];
    for (const Machine& m : machines(data, scratch)) {
        if (!only.empty() && std::string(m.name).find(only) == std::string::npos) continue;
        if (!std::ifstream(m.map)) {
            std::printf("| %s | skipped: no %s |\n", m.name, m.map.c_str());
            continue;
        }
        for (const double noise : levels) run(m, noise, asked);
    }
    std::filesystem::remove_all(scratch);
    return 0;
}
