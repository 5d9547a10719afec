// Drives over the whole plane of currents of iron that bends on each axis by itself, so that either bend may change
// alone; and logs in which it does.
#ifndef DQW_TESTS_MAPPED_DRIVE_HPP
#define DQW_TESTS_MAPPED_DRIVE_HPP

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "command.hpp"
#include "unity.h"

namespace mapped_drive {

/// Flux is a leakage's and that of iron with a knee; `bend`: how often what is not its tangent at zero current counts,
/// `all`: how often the whole.
struct Iron {
    double bend_d = 1, bend_q = 1, all_q = 1;

    static double bent(double x) { return x / std::sqrt(1 + x * x); }
    std::string csv() const
    {
        constexpr double kLeakage_H = 1.2e-3, kIron_Wb = 0.3, kKnee_A = 6, kMagnet_A = 8, kQ_Wb = 0.2, kQ_A = 9;
        const double at = kMagnet_A / kKnee_A, slope_H = kIron_Wb / kKnee_A / std::pow(1 + at * at, 1.5);
        std::string out = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n";
        for (int d = -16; d <= 16; ++d)
            for (int q = -16; q <= 16; ++q) {
                const double line_d = kIron_Wb * bent(at) + slope_H * d, line_q = kQ_Wb / kQ_A * q;
                const double psi_d = kLeakage_H * d + line_d +
                                     bend_d * (kIron_Wb * bent((d + kMagnet_A) / kKnee_A) - line_d);
                const double psi_q = kLeakage_H * q + line_q + bend_q * (kQ_Wb * bent(q / kQ_A) - line_q);
                char line[120];
                std::snprintf(line, sizeof line, "%d,%d,%.12g,%.12g\n", d, q, psi_d, all_q * psi_q);
                out += line;
            }
        return out;
    }
};

/// One drive's log, at 10 kHz with 1 % of noise.
inline std::string log_of(const command::Folder& folder, const Iron& iron, int seed, double seconds)
{
    std::vector<std::string> args = {"sim", "servo", "--out", folder / ""};
    for (const std::string& set :
         {"machine.flux_map=" + folder.write("drawn.csv", iron.csv()), std::string("noise=0.01"),
          std::string("noise.w=0.0005"), "duration_s=" + std::to_string(seconds), "seed=" + std::to_string(seed),
          std::string("machine.R_ohm=0.8"), std::string("profile.shaft=imposed"),
          std::string("profile.control=current"), std::string("profile.v_d_V.binary=0"),
          std::string("profile.v_q_V.binary=0"), std::string("profile.speed_rad_s.wave=60"),
          std::string("drive.current_bandwidth_rad_s=300"), std::string("drive.i_max_A=14"),
          std::string("profile.i_d_A=-4"), std::string("profile.i_d_A.random=4"),
          std::string("profile.i_d_A.random_hold_s=0.05"), std::string("profile.i_q_A.random=9"),
          std::string("profile.i_q_A.random_hold_s=0.031")})
        args.insert(args.end(), {"--set", set});
    const command::Outcome run = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    return command::read_file(folder / "servo.csv");
}

/// `name`.csv: `before_s` of the machine whose map stands in `name`.toml, then `after_s` of another. Returns its path.
inline std::string changed(const command::Folder& folder, const std::string& name, const Iron& after, int seed,
                           double before_s, double after_s)
{
    std::string text = log_of(folder, Iron(), seed, before_s);
    const std::string more = log_of(folder, after, seed + 1, after_s);
    for (std::size_t at = more.find('\n') + 1; at < more.size();) {
        const std::size_t end = more.find('\n', at), comma = more.find(',', at);
        char t_s[40];
        std::snprintf(t_s, sizeof t_s, "%.6f", before_s + std::stod(more.substr(at, comma - at)));
        text += t_s + more.substr(comma, end + 1 - comma);
        at = end + 1;
    }
    folder.write("healthy.csv", Iron().csv());
    folder.write(name + ".toml", "[log]\nregime = \"dynamic\"\nvoltage_interval = \"next\"\nvoltage_scale = 0\n"
                                 "[machine]\npole_pairs = 4\nflux_map = \"healthy.csv\"\n");
    return folder.write(name + ".csv", text);
}

}  // namespace mapped_drive
#endif
