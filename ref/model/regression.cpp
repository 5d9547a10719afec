#include "ref/model/regression.hpp"

#include "ref/model/plan.hpp"

namespace dqw {

WithoutEffects::WithoutEffects(std::unique_ptr<Model> model, std::vector<std::string> base)
    : model_(std::move(model)), names_(std::move(base)), power_(Eigen::VectorXd::Zero(model_->channels()))
{
    names_.resize(names_.size() + static_cast<std::size_t>(model_->gains()));
    for (const FineBlock& b : model_->plan().blocks) rows_ += b.end - b.begin;
    for (const Piece& piece : model_->plan().pieces)
        for (int c = 0; c < channels(); ++c) {
            const std::vector<double>& y = model_->measured(*piece.log, c);
            for (std::size_t k = piece.begin; k < piece.end && !y.empty(); ++k) power_[c] += y[k] * y[k];
        }
}

Point WithoutEffects::point(const Eigen::VectorXd& theta) const
{
    const Eigen::Index gains = model_->gains();
    return {theta.head(theta.size() - gains), theta.tail(gains), {}};
}

void WithoutEffects::prepare(const Eigen::VectorXd& theta) { model_->weigh_starts(point(theta), count_starts_); }

void WithoutEffects::count_starts(bool count) { count_starts_ = count || rows_ < 1000 * model_->plan().pieces.size(); }

bool WithoutEffects::sweep(const Eigen::VectorXd& theta, std::vector<BlockSum>& sums) const
{
    const std::vector<Input> none;
    std::vector<BlockSum> fine;
    const bool done = model_->sweep(point(theta), &none, fine);
    sums = empty_sums(static_cast<std::size_t>(block_count(rows_)), channels(), theta.size());
    std::size_t passed = 0;
    for (std::size_t b = 0; b < fine.size(); ++b) {
        BlockSum& to = sums[block_of(passed, rows_)];
        to.rows += fine[b].rows;
        for (std::size_t c = 0; c < to.gram.size(); ++c) to.gram[c] += fine[b].gram[c];
        passed += model_->plan().blocks[b].end - model_->plan().blocks[b].begin;
    }
    return done;
}

bool WithoutEffects::squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const
{
    std::vector<BlockSum> sums;
    sum.setZero(channels());
    if (!model_->sweep(point(theta), nullptr, sums)) return false;
    for (int c = 0; c < channels(); ++c) sum[c] = total_of(sums, static_cast<std::size_t>(c))(0, 0);
    return sum.allFinite();
}

}  // namespace dqw
