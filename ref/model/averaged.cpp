#include "ref/model/averaged.hpp"

#include "ref/model/blocks.hpp"
#include "ref/model/hat.hpp"

namespace dqw {
namespace {

std::size_t rows_in_block(const Piece& piece) { return block_rows(*piece.log); }

}  // namespace

std::unique_ptr<LinearModel> averaged_electrical(const std::vector<Piece>& pieces, double pole_pairs, double noise_d_A,
                                                 double noise_q_A)
{
    // Scatter of a difference of two ends, and of a mean, of white noise.
    double ends = 0.0, mean = 0.0, turning = 0.0, blocks = 0.0;
    for (const Piece& piece : pieces) {
        const std::size_t n = rows_in_block(piece);
        for (std::size_t k = piece.begin; k + n < piece.end; k += n) {
            const Block b = block_at(piece, k, n);
            ends += 2.0 / (b.time_s * b.time_s), mean += 1.0 / static_cast<double>(n);
            turning += pole_pairs * b.w * pole_pairs * b.w / static_cast<double>(n), blocks += 1.0;
        }
    }
    if (blocks > 0.0) ends /= blocks, mean /= blocks, turning /= blocks;
    const double d = noise_d_A * noise_d_A, q = noise_q_A * noise_q_A;
    const auto source = [pieces, pole_pairs](const auto& visit) {
        for (const Piece& piece : pieces) {
            const std::size_t n = rows_in_block(piece);
            for (std::size_t k = piece.begin; k + n < piece.end; k += n) {
                const Block b = block_at(piece, k, n);
                LinearModel::Row row;
                row.y = {b.v_d, b.v_q};
                row.x[0] = {b.i_d, b.di_d, -pole_pairs * b.wi_q, 0.0};
                row.x[1] = {b.i_q, pole_pairs * b.wi_d, b.di_q, pole_pairs * b.w};
                visit(row);
            }
        }
    };
    auto model = std::make_unique<LinearModel>(std::vector<std::string>{"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}, 2, source);
    model->set_regressor_noise({{{mean * d, ends * d, turning * q, 0.0}, {mean * q, turning * d, ends * q, 0.0}}});
    return model;
}

std::unique_ptr<LinearModel> averaged_mechanical(const std::vector<Piece>& pieces,
                                                 const std::vector<const std::vector<double>*>& torque, double half_s)
{
    const auto source = [pieces, torque, half_s](const auto& visit) {
        for (std::size_t i = 0; i < pieces.size(); ++i) {
            const Piece& piece = pieces[i];
            each_hat(piece, piece.begin, piece.end, hat_rows(*piece.log, half_s), [&](std::size_t k, const Hat& hat) {
                LinearModel::Row row;
                const double* w = &piece.log->w_m_rad_s[k];
                row.y[0] = hat.mean_of(&(*torque[i])[k]);
                row.x[0] = {hat.slope_of(w), hat.mean_of(w), 0.0, 0.0};
                visit(row);
            });
        }
    };
    return std::make_unique<LinearModel>(std::vector<std::string>{"J_kgm2", "B_Nms_rad"}, 1, source);
}

bool is_off(const Eigen::Vector2d& predicted, const Eigen::Vector2d& means, const Eigen::Vector2d& sd,
            double noise_part)
{
    // A normal exceeds three in 3 of 1000 cases.
    constexpr double kFar = 3.0, kOwnErrors = 0.01;
    const Eigen::Vector2d errors(kOwnErrors + noise_part, kOwnErrors);
    return ((predicted - means).cwiseAbs() - kFar * sd - errors.cwiseProduct(means.cwiseAbs())).maxCoeff() > 0.0;
}

bool clearly_better(const LinearModel& model, double averaged, double predicted)
{
    const double values = static_cast<double>(model.rows()) * model.channels();
    // 3 % of the RMS, ten times what as many parameters take of it by chance, and half a percent of the signal.
    constexpr double kClearly = 1.06, kTimesChance = 10.0, kOfSignal = 2.5e-5;
    const double limit = kClearly + kTimesChance * static_cast<double>(model.names().size()) / values;
    const double gained = predicted * predicted - averaged * averaged;
    return predicted * predicted > limit * averaged * averaged && gained > kOfSignal * model.power().sum() / values;
}

}  // namespace dqw
