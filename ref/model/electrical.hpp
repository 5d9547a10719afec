// The electrical model of a dynamic log in innovations form, (E40), with any effects on top of it, (E44).
#ifndef DQW_REF_MODEL_ELECTRICAL_HPP
#define DQW_REF_MODEL_ELECTRICAL_HPP

#include "ref/effect/columns.hpp"
#include "ref/model/gain.hpp"
#include "ref/model/plan.hpp"
#include "ref/model/rows.hpp"

namespace dqw {

/// Simulates the dq currents over each piece from v_d, v_q, w_m and corrects the state after each row by a gain of each
/// axis, which is a parameter like the others: 1 predicts one step, 0 only simulates. (P6), (P7):
///   L_d di_d/dt = v_d - R i_d + w_e L_q i_q,   L_q di_q/dt = v_q - R i_q - w_e (L_d i_d + psi),   w_e = p w_m
/// The speed of a period is the mean of its two ends. Derivatives run along, by hand: those of the plain model's
/// parameters are exact.
class ElectricalModel : public Model {
public:
    /// A point's base; the pole pairs only where they are fitted, and then without effects.
    enum Index { kR, kLd, kLq, kPsi, kPolePairs };

    /// `columns[i]` belongs to logs[i], and may lack where there are no effects; both outlive the model. `rotor_held`:
    /// within a period the voltage turns with the rotor. `noise`: put on the rows that a sweep reads; outlives it too.
    ElectricalModel(const std::vector<Log>& logs, const std::vector<TraceColumns>& columns, double pole_pairs,
                    Plan plan, bool rotor_held = false, const RowNoise* noise = nullptr);

    const std::vector<std::string>& base_names() const override;
    int channels() const override { return 2; }
    int gains() const override { return 2; }
    bool common_weight() const override { return false; }
    const Plan& plan() const override { return plan_; }
    const std::vector<double>& measured(const Log& log, int axis) const override
    {
        return axis == 0 ? log.i_d_A : log.i_q_A;
    }
    void weigh_starts(const Point& at, bool count) override;
    std::vector<ReportBlock> report(const Point& at, std::size_t rows) const override;
    std::vector<ReportBlock> report_some(const Point& at, const WantedBlock& wanted) const override;
    void report_each(const std::vector<Point>& at, std::size_t rows,
                     const std::function<void(const std::vector<ReportBlock>&)>& visit) const override;
    bool sweep(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const override;
    bool sweep_some(const Point& at, const std::vector<Input>* candidates, bool heldout,
                    std::vector<BlockSum>& sums) const override;
    std::vector<std::vector<BlockSum>> sweep_gains(const std::vector<Point>& at,
                                                   const std::vector<std::vector<Input>>& candidates,
                                                   bool whole) const override;

private:
    struct Plant;
    struct Pass;
    struct Period;
    struct Run;
    struct Reporter;
    bool work(const Point& at, const std::vector<Input>* candidates, const std::vector<Span>& spans,
              std::vector<BlockSum>& sums) const;
    void run_through(const Pass& pass, const Span& span, RowReader& rows, Fold fold,
                     const std::vector<std::vector<BlockSum>*>& sums, std::vector<char>& ok) const;
    GainSchedule schedule(const Point& at, int axis) const;
    void report_blocks(const std::vector<Point>& at, std::size_t rows, const WantedBlock& wanted,
                       const std::function<void(const std::vector<ReportBlock>&)>& visit) const;
    /// The voltage that begins at the row, as the rotor sees it then; it turns by `turn_rad` in the period.
    Vector2 begun(const Row& row, double turn_rad) const;

    const std::vector<Log>& logs_;
    const std::vector<TraceColumns>& columns_;
    double pole_pairs_;
    Plan plan_;
    bool rotor_held_;
    const RowNoise* noise_;
    std::vector<Piece> report_pieces_;  ///< of the reported residual
    double w_max_rad_s_ = 0.0, dt_max_s_ = 0.0, dt_mean_s_ = 0.0;
    StartWeights weights_[2];
};

}  // namespace dqw
#endif
