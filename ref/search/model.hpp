// What the tracer needs of a prediction model: errors and their derivatives, added up in blocks of rows.
#ifndef DQW_REF_SEARCH_MODEL_HPP
#define DQW_REF_SEARCH_MODEL_HPP

#include <Eigen/Dense>
#include <cstddef>
#include <string>
#include <vector>

#include "ref/effect/input.hpp"
#include "ref/log/piece.hpp"

namespace dqw {

/// An effect that is switched on: its inputs, and the value of each weight, input by input.
struct Term {
    Input input;
    std::array<double, kMostWeights> weights{};
};

/// A point in the space of models. Columns of its derivatives: base, gains, then each term's weights and free shapes.
struct Point {
    Eigen::VectorXd base, gain;
    std::vector<Term> terms;

    Eigen::Index columns() const;
    Eigen::VectorXd values() const;
    void set(const Eigen::VectorXd& values);
};

/// Rows that are judged together. Even in stretches: rows of neighbouring blocks are alike, so whole stretches are held
/// out.
struct FineBlock {
    const Piece* piece = nullptr;
    std::size_t begin = 0, end = 0;  ///< rows of the log; row k is judged by its prediction
    bool heldout = false;
};

/// The stretches of each log that the fit sees and those held out, some twenty a log in turn, each cut into fine
/// blocks.
/// `guard`: rows at the edges of a stretch that count in neither.
struct Plan {
    std::vector<Piece> pieces;
    std::vector<FineBlock> blocks;  ///< in the order of the rows
    std::size_t guard = 0;
};

/// One block of the reported residual, (E43).
struct ReportBlock {
    const Log* log = nullptr;
    std::size_t begin = 0, end = 0;  ///< rows; at `end` the next block's first
    double measured[2] = {}, residual[2] = {};
};

/// Sums over one fine block: rows, and for each channel the Gram matrix of [J e], e last.
struct BlockSum {
    double rows = 0.0;
    std::vector<Eigen::MatrixXd> gram;
};

class TraceModel {
public:
    TraceModel() = default;
    TraceModel(const TraceModel&) = delete;
    TraceModel& operator=(const TraceModel&) = delete;
    virtual ~TraceModel() = default;

    virtual const std::vector<std::string>& base_names() const = 0;
    virtual int channels() const = 0;
    virtual int gains() const = 0;
    /// Whether all channels' errors weigh alike (settled points), or each by its own noise.
    virtual bool common_weight() const = 0;
    virtual const Plan& plan() const = 0;
    /// Reported residuals of all logs at `at`, block by block of `rows` rows; 0: the regime's own length.
    virtual std::vector<ReportBlock> report(const Point& at, std::size_t rows) const = 0;
    /// Errors at `at`, with derivatives by its columns and by the weights (at zero) of `candidates`. False outside the
    /// model's domain.
    virtual bool pass(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const = 0;
};

}  // namespace dqw
#endif
