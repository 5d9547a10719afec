// Ordinary least squares of a few unknowns, row by row, with standard deviations.
#ifndef DQW_APP_BASE_LEAST_SQUARES_HPP
#define DQW_APP_BASE_LEAST_SQUARES_HPP

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace dqw {

/// Normal equations of `N` unknowns. Enough for a plausibility check, not for a fit: squares the condition number.
template <std::size_t N> class LeastSquares {
public:
    void add(const std::array<double, N>& x, double y)
    {
        for (std::size_t i = 0; i < N; ++i) {
            for (std::size_t j = 0; j <= i; ++j) xx_[i][j] += x[i] * x[j];
            xy_[i] += x[i] * y;
        }
        yy_ += y * y;
        ++rows_;
    }

    /// Solves. An unknown without information gets an infinite sd. Gauss-Jordan on the normalised matrix.
    void solve(std::array<double, N>& value, std::array<double, N>& sd) const
    {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        std::array<std::array<double, 2 * N>, N> a = {};
        std::array<double, N> norm;
        for (std::size_t i = 0; i < N; ++i) norm[i] = xx_[i][i] > 0 ? std::sqrt(xx_[i][i]) : 1.0;
        for (std::size_t i = 0; i < N; ++i) {
            for (std::size_t j = 0; j < N; ++j) a[i][j] = (i >= j ? xx_[i][j] : xx_[j][i]) / (norm[i] * norm[j]);
            a[i][N + i] = 1.0;
        }
        std::array<bool, N> known = {};
        for (std::size_t step = 0; step < N; ++step) {
            // The largest pivot left on the diagonal: the matrix is positive semidefinite.
            std::size_t best = N;
            for (std::size_t i = 0; i < N; ++i)
                if (!known[i] && (best == N || a[i][i] > a[best][best])) best = i;
            if (!(a[best][best] > 1e-9)) break;
            known[best] = true;
            const double pivot = a[best][best];
            for (double& v : a[best]) v /= pivot;
            for (std::size_t i = 0; i < N; ++i) {
                if (i == best) continue;
                const double factor = a[i][best];
                for (std::size_t j = 0; j < 2 * N; ++j) a[i][j] -= factor * a[best][j];
            }
        }
        double rss = yy_;
        for (std::size_t i = 0; i < N; ++i) {
            value[i] = 0;
            for (std::size_t j = 0; j < N && known[i]; ++j)
                if (known[j]) value[i] += a[i][N + j] * xy_[j] / norm[j];
            value[i] /= norm[i];
            rss -= value[i] * xy_[i];
        }
        const double variance = rows_ > N ? std::fmax(rss, 0.0) / static_cast<double>(rows_ - N) : infinity;
        for (std::size_t i = 0; i < N; ++i) {
            bool alone = known[i];  // not a sum with an unknown that was left out
            for (std::size_t j = 0; j < N; ++j) alone = alone && (known[j] || std::fabs(a[i][j]) < 1e-4);
            sd[i] = alone ? std::sqrt(variance * std::fmax(a[i][N + i], 0.0)) / norm[i] : infinity;
        }
    }

    /// The part of y that a solution leaves, RMS over RMS.
    double left(const std::array<double, N>& value) const
    {
        double rss = yy_;
        for (std::size_t i = 0; i < N; ++i) rss -= value[i] * xy_[i];
        return yy_ > 0 ? std::sqrt(std::fmax(rss, 0.0) / yy_) : 0.0;
    }

    /// RMS of unknown i's term over that of y.
    double share(std::size_t i, double value) const
    {
        return yy_ > 0 ? std::fabs(value) * std::sqrt(xx_[i][i] / yy_) : 0.0;
    }

private:
    std::array<std::array<double, N>, N> xx_ = {};
    std::array<double, N> xy_ = {};
    double yy_ = 0.0;
    std::size_t rows_ = 0;
};

}  // namespace dqw
#endif
