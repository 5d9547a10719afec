// What the inverter of a blind log loses: a dead time of legs that switch, or of their mean a law of the current.
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "blind_effect.hpp"

namespace blind {
namespace {

enum class Law { tanh, arctan, ramp, plateau };

/// Over V and the width; between -1 and 1.
double shape_of(Law law, double x)
{
    switch (law) {
    case Law::tanh: return std::tanh(x);
    case Law::arctan: return std::atan(x * 1.5707963267948966) / 1.5707963267948966;
    case Law::ramp: return std::fmin(1, x);
    case Law::plateau: break;
    }
    // A ramp, then the slow rise of what conducts.
    return 0.9 * std::fmin(1, x) + 0.1 * std::tanh(0.15 * x);
}

/// A folder of this process: forks of it each take their own.
std::filesystem::path folder()
{
    return std::filesystem::temp_directory_path() / fmt::format("dqwatch_blind_{}", getpid());
}

/// The points go with what the law does near its width, and on to where no current is.
std::string curve(Law law, double volt, double width_A, double most_A)
{
    std::filesystem::create_directories(folder());
    const std::string path = (folder() / fmt::format("{}_{:.17g}_{:.17g}.csv", static_cast<int>(law), volt, width_A));
    if (std::filesystem::exists(path)) return path;
    std::string text = "i_A,v_V\n0,0\n";
    constexpr int kPoints = 400;
    for (int k = 1; k <= kPoints; ++k) {
        const double i_A = 0.02 * width_A * std::pow(50 * most_A / width_A, (k - 1.0) / (kPoints - 1));
        text += fmt::format("{:.12g},{:.12g}\n", i_A, volt * shape_of(law, i_A / width_A));
    }
    std::ofstream out(path);
    out << text;
    if (!out.flush()) throw std::runtime_error(path + ": cannot be written");
    return path;
}

}  // namespace

void apply_dead_time(double size, const Setup& s, dqw_sim_scenario& x)
{
    const double width_A = s.current_A * 0.008 * std::pow(10.0, s.shape[0]);
    const bool given_back = s.shape[4] < 0.2;
    if (s.switching) {
        // A leg that closes late loses this share of the link. Given back by half too much, as much is left over.
        x.inverter.dead_time_s = (given_back ? 2 : 1) * size * x.drive.dt_s / x.drive.v_dc_V;
        if (given_back) x.drive.compensation = 1.5, x.drive.compensation_width_A = width_A;
        return;
    }
    const double volt = given_back ? -size : size;
    const Law law = static_cast<Law>(static_cast<int>(3.999 * s.shape[5]));
    if (law == Law::tanh && volt > 0) {
        x.nonideal.dead_time_V = {volt, 0, 0}, x.nonideal.dead_time_width_A = width_A;
        return;
    }
    const std::string path = curve(law, volt, width_A, 4 * s.current_A);
    if (path.size() >= sizeof x.nonideal.inverter_curve) throw std::runtime_error(path + ": too long");
    std::snprintf(x.nonideal.inverter_curve, sizeof x.nonideal.inverter_curve, "%s", path.c_str());
}

void remove_curves()
{
    std::error_code ignored;
    std::filesystem::remove_all(folder(), ignored);
}

}  // namespace blind
