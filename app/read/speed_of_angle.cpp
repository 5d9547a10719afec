#include "app/read/speed_of_angle.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace dqw {

std::vector<double> slope_of_angle(const std::vector<double>& t_s, const std::vector<double>& theta_rad)
{
    constexpr double turn_rad = 6.283185307179586;
    constexpr std::size_t reach = 10;
    const std::size_t rows = theta_rad.size();
    std::vector<double> unwrapped(theta_rad), slope(rows, 0.0);
    for (std::size_t k = 1; k < rows; ++k)
        unwrapped[k] = unwrapped[k - 1] + std::remainder(theta_rad[k] - theta_rad[k - 1], turn_rad);
    for (std::size_t k = 0; k < rows; ++k) {
        const std::size_t first = k < reach ? 0 : k - reach, last = std::min(k + reach, rows - 1);
        double n = 0, st = 0, sa = 0, stt = 0, sta = 0;
        for (std::size_t j = first; j <= last; ++j) {
            const double t = t_s[j] - t_s[k], a = unwrapped[j] - unwrapped[k];
            n += 1, st += t, sa += a, stt += t * t, sta += t * a;
        }
        const double spread = n * stt - st * st;
        if (spread > 0) slope[k] = (n * sta - st * sa) / spread;
    }
    return slope;
}

}  // namespace dqw
