// A sweep of the rows seen, or of those held out, alone: its sums are those of a sweep through all rows.
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "ref/model/electrical.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

constexpr double R = 1.2, L = 3e-3, dt = 1e-4, kNoise_A = 0.02;
constexpr std::size_t kRows = 6000, kStretches = 6;

/// A machine at rest under random steps of voltage; its currents with noise.
std::vector<dqw::Log> at_rest()
{
    std::mt19937_64 bits(3);
    std::normal_distribution<double> normal;
    std::vector<dqw::Log> logs(1);
    dqw::Log& log = logs[0];
    log.regime = dqw::Regime::dynamic;
    const double kept = std::exp(-R / L * dt);
    double i[2] = {}, v[2] = {};
    for (std::size_t k = 0; k < kRows; ++k) {
        for (double& x : v)
            if (bits() % 8 == 0) x = 5.0 * normal(bits);
        log.t_s.push_back(dt * static_cast<double>(k)), log.w_m_rad_s.push_back(0.0);
        log.v_d_V.push_back(v[0]), log.v_q_V.push_back(v[1]);
        log.i_d_A.push_back(i[0] + kNoise_A * normal(bits)), log.i_q_A.push_back(i[1] + kNoise_A * normal(bits));
        for (int a : {0, 1}) i[a] = kept * i[a] + (1.0 - kept) / R * v[a];
    }
    return logs;
}

struct Sweeps {
    std::vector<dqw::Log> logs = at_rest();
    std::vector<dqw::TraceColumns> columns{dqw::trace_columns(logs[0], 1.0, 1.0, 1.0)};
    dqw::ElectricalModel model{logs, columns, 1.0, dqw::alternate_plan(dqw::pieces_of(logs, 30), kStretches, 10, 60)};
    std::vector<dqw::BlockSum> all, some;

    Sweeps(double R_ohm, double gain, bool heldout, const std::vector<dqw::Term>& terms = {})
    {
        dqw::Point at;
        at.base = Eigen::Vector4d(R_ohm, L, 1.1 * L, 0.01), at.gain = Eigen::Vector2d(gain, gain);
        at.terms = terms;
        const std::vector<dqw::Input> none;
        TEST_ASSERT_TRUE(model.sweep(at, &none, all));
        TEST_ASSERT_TRUE(model.sweep_some(at, &none, heldout, some));
    }
    bool heldout(std::size_t block) const { return model.plan().blocks[block].heldout; }
};

/// Of both kinds: the start of each stretch is forgotten, voltages that come late too, and the others' rows are not worked
/// out.
void stretches_alone()
{
    const std::vector<std::vector<dqw::Term>> terms{
        {}, {{{dqw::Law::delay, {}}, {4.5}}}, {{{dqw::Law::iron_loss, {1.0}}, {0.02}}}};
    for (const std::vector<dqw::Term>& of : terms)
        for (const bool heldout : {false, true})
            for (const double gain : {1e-3, 0.1, 0.5, 0.8, 0.95, 1.0}) {
                const Sweeps s(R, gain, heldout, of);
                for (std::size_t b = 0; b < s.all.size(); ++b) {
                    if (s.heldout(b) != heldout) {
                        TEST_ASSERT_EQUAL_DOUBLE(0.0, s.some[b].rows);
                        continue;
                    }
                    TEST_ASSERT_EQUAL_DOUBLE(s.all[b].rows, s.some[b].rows);
                    for (int axis : {0, 1}) {
                        const Eigen::MatrixXd &a = s.all[b].gram[axis], &c = s.some[b].gram[axis];
                        const Eigen::Index last = a.rows() - 1;
                        const Eigen::VectorXd unit = a.diagonal().cwiseMax(1e-30).cwiseSqrt();
                        const double off = (c - a).cwiseQuotient(unit * unit.transpose()).cwiseAbs().maxCoeff();
                        TEST_ASSERT_TRUE(off < 2e-3);
                        TEST_ASSERT_DOUBLE_WITHIN(1e-4 * a(last, last), a(last, last), c(last, last));
                    }
                }
            }
}

/// What never forgets where it began is worked out as a whole.
void a_winding_without_resistance()
{
    const Sweeps s(0.0, 1e-4, false);
    const std::size_t last = s.all.size() - 1;
    TEST_ASSERT_TRUE(s.heldout(last));
    for (std::size_t b = 0; b <= last; ++b) {
        if (s.heldout(b) && s.some[b].rows == 0.0) continue;
        TEST_ASSERT_EQUAL_DOUBLE(s.all[b].rows, s.some[b].rows);
        TEST_ASSERT_TRUE(s.all[b].gram[0] == s.some[b].gram[0] && s.all[b].gram[1] == s.some[b].gram[1]);
    }
}

/// At several gains at once the sums are those at each: without candidates all of them, and of the first gain's all but
/// where two groups meet; at another gain what a candidate takes is told by other currents, which differ by the noise.
void gains_side_by_side(const std::vector<dqw::Log>& logs)
{
    const std::vector<dqw::TraceColumns> columns{dqw::trace_columns(logs[0], 1.0, 1.0, 1.0)};
    const dqw::ElectricalModel model{logs, columns, 1.0,
                                     dqw::alternate_plan(dqw::pieces_of(logs, 30), kStretches, 10, 60)};
    const std::vector<std::vector<dqw::Input>> groups{{{dqw::Law::iron_loss, {1.0}}}, {{dqw::Law::saturation, {5.0}}}};
    const std::vector<dqw::Input> flat{groups[0][0], groups[1][0]};
    const std::vector<std::vector<dqw::Term>> terms{{}, {{{dqw::Law::delay, {}}, {0.02}}}};
    for (const std::vector<dqw::Term>& of : terms) {
        std::vector<dqw::Point> at(3);
        for (std::size_t n = 0; n < 3; ++n) {
            const double gain = n == 0 ? 0.3 : n == 1 ? 0.02 : 1.0;
            at[n].base = Eigen::Vector4d(R, L, L, 0.01), at[n].gain = Eigen::Vector2d(gain, gain);
            at[n].terms = of;
        }
        const auto sums = model.sweep_gains(at, groups, true);
        for (std::size_t n = 0; n < 3; ++n) {
            std::vector<dqw::BlockSum> each;
            TEST_ASSERT_TRUE(model.pass(at[n], flat, each));
            const std::vector<dqw::BlockSum> own = dqw::folded(model.plan(), each);
            TEST_ASSERT_EQUAL_size_t(2, sums[n].size());
            for (std::size_t kind : {0, 1}) {
                TEST_ASSERT_EQUAL_DOUBLE(own[kind].rows, sums[n][kind].rows);
                for (int axis : {0, 1}) {
                    const Eigen::MatrixXd &a = own[kind].gram[axis], &c = sums[n][kind].gram[axis];
                    const Eigen::Index last = a.rows() - 1, first = at[n].columns(), second = first + 1;
                    const Eigen::VectorXd unit = a.diagonal().cwiseMax(1e-30).cwiseSqrt();
                    Eigen::MatrixXd off = (c - a).cwiseQuotient(unit * unit.transpose()).cwiseAbs();
                    const Eigen::Index others = last - second;
                    TEST_ASSERT_TRUE(c.block(first, second, 1, others).isZero(0.0));
                    TEST_ASSERT_FALSE(a.block(first, second, 1, others).isZero(0.0));
                    off.block(first, second, 1, others).setZero(), off.block(second, first, others, 1).setZero();
                    TEST_ASSERT_TRUE(off.maxCoeff() < (n == 0 ? 1e-12 : 0.02));
                    // The columns that are there, and the errors.
                    TEST_ASSERT_TRUE(off.topLeftCorner(first, first).maxCoeff() < 1e-12);
                    TEST_ASSERT_TRUE(off(last, last) < 1e-12 && off.row(last).head(first).maxCoeff() < 1e-12);
                }
            }
        }
    }
    // Of the rows seen alone; and nothing of a point outside.
    dqw::Point at;
    at.base = Eigen::Vector4d(R, L, L, 0.01), at.gain = Eigen::Vector2d(0.3, 0.3);
    const auto seen = model.sweep_gains({at}, groups, false).front();
    TEST_ASSERT_EQUAL_DOUBLE(0.0, seen[1].rows);
    TEST_ASSERT_TRUE(seen[0].rows > 1000.0);
    at.base[1] = -L;
    TEST_ASSERT_TRUE(model.sweep_gains({at}, groups, true).front().empty());
}

void at_several_gains()
{
    std::vector<dqw::Log> logs = at_rest();
    gains_side_by_side(logs);
    // In forty pieces.
    for (std::size_t k = kRows / 40; k < kRows; k += kRows / 40) logs[0].segments.push_back(k);
    TEST_ASSERT_EQUAL_size_t(40, dqw::pieces_of(logs, 30).size());
    gains_side_by_side(logs);
}

/// A lead as long as a stretch joins all of them; a piece's end ends one.
void spans()
{
    const dqw::Log log;
    const dqw::Plan plan = dqw::alternate_plan({{&log, 0, 300, 0.0}, {&log, 400, 700, 0.0}}, 6, 3, 10);
    // Two blocks of each stretch.
    const auto expect = [&](const std::vector<dqw::Span>& of, const std::vector<std::array<std::size_t, 4>>& expected) {
        TEST_ASSERT_EQUAL_UINT(expected.size(), of.size());
        for (std::size_t n = 0; n < of.size(); ++n) {
            const std::size_t found[] = {of[n].begin, of[n].end, of[n].first_block, of[n].end_block};
            TEST_ASSERT_EQUAL_MEMORY(expected[n].data(), found, sizeof found);
            TEST_ASSERT_TRUE(of[n].piece == plan.blocks[expected[n][2]].piece);
        }
    };
    expect(dqw::spans_of(plan), {{0, 300, 0, 6}, {400, 700, 6, 12}});
    expect(dqw::spans_of(plan, false, 50), {{0, 100, 0, 2}, {160, 300, 4, 6}, {460, 600, 8, 10}});
    expect(dqw::spans_of(plan, true, 50), {{60, 200, 2, 4}, {400, 500, 6, 8}, {560, 700, 10, 12}});
    expect(dqw::spans_of(plan, false, 110), {{0, 300, 0, 6}, {400, 600, 8, 10}});
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(stretches_alone);
    RUN_TEST(a_winding_without_resistance);
    RUN_TEST(at_several_gains);
    RUN_TEST(spans);
    return UNITY_END();
}
