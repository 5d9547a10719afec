// What a solver needs of a model with effects: errors and their derivatives, added up in blocks of rows.
#ifndef DQW_REF_MODEL_MODEL_HPP
#define DQW_REF_MODEL_MODEL_HPP

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <string>
#include <utility>
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
bool operator==(const Point& a, const Point& b);
/// What the angle is off by at all speeds, rad: the weights of `angle_offset`; 0 without.
double angle_offset_of(const Point& at);

/// Rows that are judged together. Even in stretches: rows of neighbouring blocks are alike, so whole stretches are held
/// out.
struct FineBlock {
    const Piece* piece = nullptr;
    std::size_t begin = 0, end = 0;  ///< rows of the log; row k is judged by its prediction
    bool heldout = false;
};

/// Pieces, and which of their rows are judged: those of the blocks. A copy's blocks lie in its own pieces.
struct Plan {
    std::vector<Piece> pieces;
    std::vector<FineBlock> blocks;  ///< in the order of the rows

    Plan() = default;
    Plan(std::vector<Piece> p, std::vector<FineBlock> b) : pieces(std::move(p)), blocks(std::move(b)) {}
    Plan(const Plan& other);
    Plan(Plan&&) = default;
    Plan& operator=(Plan other)
    {
        pieces.swap(other.pieces), blocks.swap(other.blocks);
        return *this;
    }
};

/// One block of the reported residual, (E43).
struct ReportBlock {
    const Log* log = nullptr;
    std::size_t begin = 0, end = 0;  ///< rows; at `end` the next block's first
    double measured[2] = {}, residual[2] = {};
};

/// Whether a block of these rows is asked for.
using WantedBlock = std::function<bool(const Log& log, std::size_t begin, std::size_t end)>;

/// Sums over one fine block: rows, and for each channel the Gram matrix of [J e], e last.
struct BlockSum {
    double rows = 0.0;
    std::vector<Eigen::MatrixXd> gram;
};

void add_to(BlockSum& sum, const BlockSum& more);
/// Sum over all blocks of one channel's.
Eigen::MatrixXd total_of(const std::vector<BlockSum>& sums, std::size_t channel);
/// `count` empty sums of n columns and e.
std::vector<BlockSum> empty_sums(std::size_t count, int channels, Eigen::Index n);

/// The plain model of a regime with any effects on top of it, in innovations form where it moves.
class Model {
public:
    Model() = default;
    Model(const Model&) = delete;
    Model& operator=(const Model&) = delete;
    virtual ~Model() = default;

    virtual const std::vector<std::string>& base_names() const = 0;
    virtual int channels() const = 0;
    virtual int gains() const = 0;
    /// Whether all channels' errors weigh alike (settled points), or each by its own noise.
    virtual bool common_weight() const = 0;
    virtual const Plan& plan() const = 0;
    /// The column that a channel predicts; empty where the log lacks it.
    virtual const std::vector<double>& measured(const Log& log, int channel) const = 0;
    /// From now on the first rows of a piece weigh by how their innovations scatter at `at`, or, without `count`,
    /// nothing until the start is forgotten. Before, each row weighs 1: a plan's guards leave the start out.
    virtual void weigh_starts(const Point& at, bool count) { (void)at, (void)count; }
    /// Reported residuals of all logs at `at`, block by block of `rows` rows; 0: the regime's own length.
    virtual std::vector<ReportBlock> report(const Point& at, std::size_t rows) const = 0;
    /// Those of report(at, 0) that `wanted` says yes to; a model that works out no others overrides it.
    virtual std::vector<ReportBlock> report_some(const Point& at, const WantedBlock& wanted) const;
    /// The same of several points, block by block of all; little is kept where a model has a way of its own.
    virtual void report_each(const std::vector<Point>& at, std::size_t rows,
                             const std::function<void(const std::vector<ReportBlock>&)>& visit) const;
    /// Errors at `at`, with derivatives by its columns and by the weights (at zero) of `candidates`, or, where that is
    /// nullptr, without any. False outside the model's domain.
    virtual bool sweep(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const = 0;
    /// The same of the blocks that are held out, or of those that are not; the others' sums are empty where a model saves
    /// work by it, and as they are where it does not.
    virtual bool sweep_some(const Point& at, const std::vector<Input>* candidates, bool heldout,
                            std::vector<BlockSum>& sums) const
    {
        (void)heldout;
        return sweep(at, candidates, sums);
    }

    /// Of points that differ in their gains alone, what those sums add up to: of the rows seen, and of those held out,
    /// without `whole` of those alone that a model meets on its way. All may have the candidates' columns as they are at
    /// the first one's currents, and zeros where two groups of candidates meet. Nothing of a point outside the model's
    /// domain, and of none where the first has no numbers.
    virtual std::vector<std::vector<BlockSum>> sweep_gains(const std::vector<Point>& at,
                                                           const std::vector<std::vector<Input>>& candidates,
                                                           bool whole) const;

    bool pass(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const
    {
        return sweep(at, &candidates, sums);
    }
};

/// Columns of a sweep.
Eigen::Index columns_of(const Point& at, const std::vector<Input>* candidates);

}  // namespace dqw
#endif
