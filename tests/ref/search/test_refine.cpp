// The damped fit on an error whose whole step leads away, with a count of its sweeps.
#include <cmath>

#include "ref/search/solve.hpp"
#include "unity.h"

void setUp() {}
void tearDown() {}

namespace {

/// e = arctan(p), +-1 and of four kinds of row: its whole step leads away from where |p| > 1.39, and its mean square
/// is least at p = 0, where it is 1.
class Bent : public dqw::Model {
public:
    Bent()
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
    bool sweep(const dqw::Point& at, const std::vector<dqw::Input>*, std::vector<dqw::BlockSum>& sums) const override
    {
        ++sweeps;
        const double p = at.base[0], by = 1.0 / (1.0 + p * p);
        sums = dqw::empty_sums(plan_.blocks.size(), 1, 1);
        for (dqw::BlockSum& s : sums)
            for (int row = 0; row < 50; ++row) {
                const Eigen::Vector2d line(by, std::atan(p) + (row % 2 == 0 ? 1.0 : -1.0));
                s.gram[0] += line * line.transpose(), ++s.rows;
            }
        return true;
    }
    mutable int sweeps = 0;

private:
    std::vector<std::string> names_{"p"};
    std::vector<double> none_;
    dqw::Plan plan_;
};

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

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(a_whole_step_that_leads_away_is_bent);
    RUN_TEST(what_cannot_be_worth_it_ends_early);
    return UNITY_END();
}
