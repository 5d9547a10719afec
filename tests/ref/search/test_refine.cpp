// The damped fit on an error whose whole step leads away, and at a limit, with a count of its sweeps.
#include <Eigen/Cholesky>
#include <cmath>
#include <utility>

#include "ref/search/solve.hpp"
#include "unity.h"

void setUp() {}
void tearDown() {}

namespace {

/// One channel, of which every block has the same 50 rows, seen and held out in turn; counts its sweeps.
class OneChannel : public dqw::Model {
public:
    explicit OneChannel(std::vector<std::string> names) : names_(std::move(names))
    {
        for (std::size_t b = 0; b < 4; ++b) plan_.blocks.push_back({nullptr, 50 * b, 50 * b + 50, b % 2 == 1});
    }
    const std::vector<std::string>& base_names() const override { return names_; }
    int channels() const override { return 1; }
    int gains() const override { return 0; }
    bool common_weight() const override { return false; }
    const dqw::Plan& plan() const override { return plan_; }
    const std::vector<double>& measured(const dqw::Log&, int) const override { return none_; }
    std::vector<dqw::ReportBlock> report(const dqw::Point&, std::size_t) const override { return {}; }
    /// Derivatives by the parameters, and the error.
    virtual Eigen::VectorXd line(const Eigen::VectorXd& p, int row) const = 0;
    bool sweep(const dqw::Point& at, const std::vector<dqw::Input>*, std::vector<dqw::BlockSum>& sums) const override
    {
        ++sweeps;
        sums = dqw::empty_sums(plan_.blocks.size(), 1, at.base.size());
        for (dqw::BlockSum& s : sums)
            for (int row = 0; row < 50; ++row) {
                const Eigen::VectorXd l = line(at.base, row);
                s.gram[0] += l * l.transpose(), ++s.rows;
            }
        return true;
    }
    mutable int sweeps = 0;

private:
    std::vector<std::string> names_;
    std::vector<double> none_;
    dqw::Plan plan_;
};

/// e = arctan(p), +-1 and of four kinds of row: its whole step leads away from where |p| > 1.39, and its mean square
/// is least at p = 0, where it is 1.
class Bent : public OneChannel {
public:
    Bent() : OneChannel({"p"}) {}
    Eigen::VectorXd line(const Eigen::VectorXd& p, int row) const override
    {
        return Eigen::Vector2d(1.0 / (1.0 + p[0] * p[0]), std::atan(p[0]) + (row % 2 == 0 ? 1.0 : -1.0));
    }
};

/// e = y - x p, p = (R, L_d, L_q), of which a step moves L_d and L_q by 1.2 of themselves at most; no two columns are at
/// right angles.
class Straight : public OneChannel {
public:
    explicit Straight(double apart = 1.0) : OneChannel({"R_ohm", "Ld_H", "Lq_H"}), apart_(apart) {}
    Eigen::Vector3d x(int row) const
    {
        const double d = 0.1 * (row % 10);
        return {1.0, d, d + apart_ * (row % 3 == 0 ? 1.0 : -0.5)};
    }
    double y(int row) const { return x(row).dot(Eigen::Vector3d(2.0, 5.0, 1.0)) + (row % 2 == 0 ? 0.1 : -0.1); }
    Eigen::VectorXd line(const Eigen::VectorXd& p, int row) const override
    {
        Eigen::Vector4d l;
        l << -x(row), y(row) - x(row).dot(p);
        return l;
    }

private:
    double apart_;
};

dqw::Point straight(double R, double Ld, double Lq)
{
    dqw::Point at;
    at.base = Eigen::Vector3d(R, Ld, Lq), at.gain.resize(0);
    return at;
}

/// Least squares of R and L_q where L_d is given, by the normal equations.
Eigen::Vector2d beside(const Straight& model, double Ld)
{
    Eigen::Matrix2d a = Eigen::Matrix2d::Zero();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for (int row = 0; row < 50; ++row) {
        const Eigen::Vector3d x = model.x(row);
        const Eigen::Vector2d of(x[0], x[2]);
        a += of * of.transpose(), b += of * (model.y(row) - x[1] * Ld);
    }
    return a.ldlt().solve(b);
}

dqw::Point point(double p)
{
    dqw::Point at;
    at.base.resize(1), at.gain.resize(0);
    at.base[0] = p;
    return at;
}

void a_whole_step_that_leads_away_is_bent()
{
    const Bent model;
    const dqw::Refined r = dqw::refine(model, point(3.0), 12);
    TEST_ASSERT_TRUE(r.ok);
    // 0.2 nats of 100 rows.
    TEST_ASSERT_DOUBLE_WITHIN(0.07, 0.0, r.point.base[0]);
}

void what_cannot_be_worth_it_ends_early()
{
    const Bent model;
    const double least = dqw::refine(model, point(0.0), 12).left.seen;
    // A start from which whole steps swing to and fro.
    const dqw::Refined whole = dqw::refine(model, point(1.38), 40);
    const int all = model.sweeps;  // with those of the least
    const dqw::Refined worth = dqw::refine(model, point(1.38), 40, least - 1.0);
    TEST_ASSERT_EQUAL_DOUBLE(whole.point.base[0], worth.point.base[0]);
    model.sweeps = 0;
    const dqw::Refined less = dqw::refine(model, point(1.38), 40, least + 1e5);
    TEST_ASSERT_TRUE(less.ok);
    TEST_ASSERT_LESS_OR_EQUAL_INT(4, model.sweeps);
    TEST_ASSERT_LESS_THAN_INT(all, model.sweeps);
    TEST_ASSERT_TRUE(less.left.seen >= dqw::swept(model, point(1.38)).left.seen);
}

void beside_a_limit_the_others_are_where_it_leaves_least()
{
    const Straight model;
    const dqw::Refined r = dqw::refine(model, straight(0.0, 1.0, 1.0), 2);
    TEST_ASSERT_EQUAL_INT(2, model.sweeps);
    const Eigen::Vector2d others = beside(model, 2.2);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.2, r.point.base[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, others[0], r.point.base[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, others[1], r.point.base[2]);
}

/// Columns of L_d and L_q that are nearly one: from far both come to their limits at once, and each step still ascends.
void two_that_are_limited_at_once_arrive()
{
    for (const double apart : {0.5, 0.05}) {
        const Straight model(apart);
        const double best = dqw::refine(model, straight(2.0, 5.0, 1.0), 40).left.seen;
        for (const double Ld : {0.2, 1.0, 10.0})
            for (const double Lq : {0.2, 5.0, 10.0}) {
                const dqw::Refined r = dqw::refine(model, straight(0.0, Ld, Lq), 40);
                TEST_ASSERT_DOUBLE_WITHIN(0.2, best, r.left.seen);
            }
    }
}

void a_step_that_promises_little_takes_no_sweep()
{
    const Straight model;
    const dqw::Refined far = dqw::refine(model, straight(0.0, 1.0, 1.0), 12);
    // Of noise of 0.1 some hundredths of a nat.
    dqw::Point near = far.point;
    near.base[0] += 0.003;
    model.sweeps = 0;
    const dqw::Refined r = dqw::refine(model, near, 12);
    TEST_ASSERT_EQUAL_INT(1, model.sweeps);
    TEST_ASSERT_TRUE((r.point.base - far.point.base).cwiseAbs().maxCoeff() < 1e-9);
    const dqw::Refined swept = dqw::swept(model, r.point);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, swept.left.seen, r.left.seen);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, swept.left.heldout, r.left.heldout);
    for (std::size_t b = 0; b < r.sums.size(); ++b)
        TEST_ASSERT_TRUE((r.sums[b].gram[0] - swept.sums[b].gram[0]).cwiseAbs().maxCoeff() < 1e-9);
}

/// Along a difference of columns that the rows hardly tell, next to nothing is gained far away: such a step is swept.
void a_long_step_is_swept_whatever_it_promises()
{
    const Straight model(1e-3);
    dqw::Point start = dqw::refine(model, straight(2.0, 5.0, 1.0), 40).point;
    start.base[1] += 1.0, start.base[2] -= 1.0;
    const dqw::Refined at = dqw::swept(model, start);
    model.sweeps = 0;
    const dqw::Refined r = dqw::refine(model, at, 12);
    TEST_ASSERT_TRUE(r.left.seen - at.left.seen < 0.2);
    TEST_ASSERT_TRUE(model.sweeps > 0);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(a_whole_step_that_leads_away_is_bent);
    RUN_TEST(what_cannot_be_worth_it_ends_early);
    RUN_TEST(beside_a_limit_the_others_are_where_it_leaves_least);
    RUN_TEST(two_that_are_limited_at_once_arrive);
    RUN_TEST(a_step_that_promises_little_takes_no_sweep);
    RUN_TEST(a_long_step_is_swept_whatever_it_promises);
    return UNITY_END();
}
