#include "ref/model/column_noise.hpp"

#include <algorithm>
#include <cmath>

#include "ref/log/median.hpp"
#include "ref/log/piece.hpp"
#include "ref/log/wanted.hpp"

namespace dqw {
namespace {

/// Rows of a chunk, of which a mean square scatters by a third at least; a wild stretch spoils no more of them.
constexpr std::size_t kChunk = 200, kLeastChunk = 20;

/// The most that white noise of a column may have: the lesser of what two bands would make of it, the top one and that
/// of means over five rows, (E46).
double white_variance(const std::vector<Log>& logs, std::vector<double> Log::*column)
{
    constexpr std::size_t kFive = 5, kReach = 3 * kFive;
    constexpr double kTop = 1 + 16 + 36 + 16 + 1, kMeans = (1 + 4 + 1) / 5.0;  // sums of squares of the filters
    std::vector<double> top, means;
    for (const Log& log : logs) {
        const std::vector<double>& x = log.*column;
        for (const Piece& piece : pieces_of(log, kReach + kLeastChunk))
            for (std::size_t k = piece.begin; k + kReach + kLeastChunk <= piece.end; k += kChunk) {
                ask_at(k, kChunk);
                const std::size_t stop = std::min(k + kChunk, piece.end - kReach);
                double a = 0.0, b = 0.0;
                for (std::size_t r = k; r < stop; ++r) {
                    const double y = x[r] - 4.0 * x[r + 1] + 6.0 * x[r + 2] - 4.0 * x[r + 3] + x[r + 4];
                    double z = 0.0;
                    for (std::size_t n = r; n < r + kFive; ++n)
                        z += (x[n] - 2.0 * x[n + kFive] + x[n + 2 * kFive]) / static_cast<double>(kFive);
                    a += y * y, b += z * z;
                }
                top.push_back(a / kTop / static_cast<double>(stop - k));
                means.push_back(b / kMeans / static_cast<double>(stop - k));
            }
    }
    return std::min(median(top), median(means));
}

}  // namespace

ColumnNoise::ColumnNoise(const std::vector<Log>& logs, std::vector<Piece> read) : logs_(logs), read_(std::move(read))
{
    double rows = 0.0;
    for (const Log& log : logs) {
        for (std::size_t k = 0; k < log.rows(); ++k) {
            mean_d_A_ += log.i_d_A[k], square_w_ += log.w_m_rad_s[k] * log.w_m_rad_s[k];
            square_A2_[0] += log.i_d_A[k] * log.i_d_A[k], square_A2_[1] += log.i_q_A[k] * log.i_q_A[k];
        }
        dt_s_ += log.dt_s * static_cast<double>(log.rows()), rows += static_cast<double>(log.rows());
    }
    for (double* sum : {&mean_d_A_, &square_A2_[0], &square_A2_[1], &square_w_, &dt_s_}) *sum /= std::max(rows, 1.0);
    speed_ = white_variance(logs, &Log::w_m_rad_s);
    voltage_[0] = white_variance(logs, &Log::v_d_V), voltage_[1] = white_variance(logs, &Log::v_q_V);
}

NoiseSizes ColumnNoise::sizes(const Eigen::VectorXd& base, const Eigen::VectorXd& gain, double pole_pairs,
                              const Eigen::VectorXd& variance) const
{
    enum { kR, kLd, kLq, kPsi, kPolePairs };
    NoiseSizes out;
    const double R = base[kR], psi = base[kPsi], p = base.size() > kPolePairs ? base[kPolePairs] : pole_pairs;
    // Mean square of the flux that the speed turns into each axis' voltage.
    const double flux[] = {base[kLq] * base[kLq] * square_A2_[1],
                           psi * psi + 2.0 * psi * base[kLd] * mean_d_A_ + base[kLd] * base[kLd] * square_A2_[0]};
    double turned[2] = {1.0, 1.0};
    for (int axis : {0, 1}) {
        const double L = base[kLd + axis], g = std::clamp(gain[axis], 0.0, 1.0), x = R * dt_s_ / L;
        if (!(L > 0.0) || !(std::abs(x) > 0.0) || !(variance[axis] > 0.0)) return {};
        const double decay = std::exp(-x), volt_A = (1.0 - decay) / R;
        // What the state gets in a period beside what it keeps, less what comes from the other axis' error by turning.
        const double across = base[kLq - axis] / L, other = std::clamp(gain[1 - axis], 0.0, 1.0);
        const double state = g * variance[axis] * (1.0 - decay * decay * (1.0 - g)) -
                             across * across * p * p * square_w_ * dt_s_ * dt_s_ * other * (1.0 - other) *
                                 variance[1 - axis];
        const double noise = state / (volt_A * volt_A);
        if (!(noise > 0.0)) {
            turned[axis] = 0.0;
            continue;
        }
        // The mean of both ends' speeds: of one row half the noise, of many all.
        const double of_speed = p * p * flux[axis] * speed_ * (1.0 - 0.5 * g);
        if (of_speed > noise) turned[axis] = noise / of_speed;
        const double of_voltage = std::min(std::max(noise - of_speed, 0.0), voltage_[axis]);
        out.v_V[axis] = std::sqrt(of_voltage);
        // What is in no column is noise of the state, which innovations are made for; the sensor's goes with the rest.
        out.share[axis] = std::min(1.0, (of_voltage + of_speed) / noise);
        out.i_A[axis] = std::sqrt((1.0 - g) * variance[axis] * out.share[axis]);
    }
    // An axis without much flux says little of the speed.
    out.w_m_rad_s = std::sqrt(speed_ * (flux[0] > flux[1] ? turned[0] : turned[1]));
    return out;
}

Eigen::MatrixXd ColumnNoise::second(const NoiseSizes& sizes, const std::function<Eigen::MatrixXd(const RowNoise*)>& of)
{
    if (!draws_) draws_.emplace(logs_, read_);
    const Eigen::MatrixXd middle = of(nullptr);
    Eigen::MatrixXd sum = -2.0 * middle;
    for (const double sign : {1.0, -1.0}) {
        const RowNoise noise{&*draws_,
                             {sign * sizes.v_V[0], sign * sizes.v_V[1], sign * sizes.i_A[0], sign * sizes.i_A[1],
                              sign * sizes.w_m_rad_s}};
        const Eigen::MatrixXd moved = of(&noise);
        if (moved.size() != middle.size() || middle.size() == 0) return {};
        sum += moved;
    }
    return 0.5 * sum;
}

Eigen::MatrixXd ColumnNoise::added(const NoiseSizes& sizes,
                                   const std::function<Eigen::MatrixXd(const RowNoise*)>& scores)
{
    Eigen::MatrixXd middle;
    Eigen::MatrixXd sum = second(sizes, [&](const RowNoise* noise) {
        Eigen::MatrixXd out = scores(noise);
        if (noise == nullptr) middle = out;
        return out;
    });
    if (sum.size() == 0) return {};
    // Sizes are of axes that do not turn into each other within a period: the squares themselves say how near they are.
    constexpr double kMost = 2.0;
    const Eigen::Index last = middle.rows() - 1;
    for (Eigen::Index c = 0; c < sum.cols(); ++c)
        if (sum(last, c) > 0.0)
            sum.col(c) *= std::clamp(sizes.share[c] * middle(last, c) / sum(last, c), 1.0 / kMost, kMost);
    return sum.topRows(last);
}

}  // namespace dqw
