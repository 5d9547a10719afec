// Noise that is drawn as rows are read is that of one generator, log by log and column by column, wherever one reads.
#include <array>
#include <random>
#include <vector>

#include "ref/model/rows.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

constexpr std::array<double, 5> kSize{0.5, -2.0, 0.0, 1e-3, 30.0};

std::vector<double> column(std::size_t rows, double first)
{
    std::vector<double> out(rows);
    for (std::size_t k = 0; k < rows; ++k) out[k] = first + 0.25 * static_cast<double>(k);
    return out;
}

/// Three marks' rows, and a few.
std::vector<dqw::Log> two_logs()
{
    std::vector<dqw::Log> logs(2);
    double first = 1.0;
    for (dqw::Log& log : logs)
        for (auto* c : {&log.v_d_V, &log.v_q_V, &log.i_d_A, &log.i_q_A, &log.w_m_rad_s})
            *c = column(&log == logs.data() ? 2 * dqw::Draws::kApart + 9 : 50, first++);
    return logs;
}

/// The whole of it in memory.
std::vector<dqw::Log> noisy(std::vector<dqw::Log> logs)
{
    std::mt19937_64 bits(1);
    std::normal_distribution<double> normal;
    for (dqw::Log& log : logs) {
        std::size_t c = 0;
        for (auto* values : {&log.v_d_V, &log.v_q_V, &log.i_d_A, &log.i_q_A, &log.w_m_rad_s}) {
            for (double& x : *values) x += kSize[c] * normal(bits);
            ++c;
        }
    }
    return logs;
}

void expect_row(const dqw::Row& expected, const dqw::Row& row)
{
    TEST_ASSERT_EQUAL_MEMORY(&expected, &row, sizeof row);
}

void forwards()
{
    const std::vector<dqw::Log> logs = two_logs(), all = noisy(logs);
    const dqw::Draws draws(logs);
    const dqw::RowNoise noise{&draws, kSize};
    dqw::RowReader rows(&noise);
    for (std::size_t l = 0; l < logs.size(); ++l)
        for (std::size_t k = 0; k < logs[l].rows(); ++k) expect_row(row_of(all[l], k), rows.at(logs[l], k));
}

void anywhere()
{
    const std::vector<dqw::Log> logs = two_logs(), all = noisy(logs);
    // Of the second, rows by the mark and rows that are kept.
    const std::vector<dqw::Piece> kept{{&logs[0], 5, 9, 0.0}, {&logs[1], 3, 50, 0.0}};
    const dqw::Draws plain(logs), some_kept(logs, kept);
    for (const dqw::Draws* draws : {&plain, &some_kept}) {
        const dqw::RowNoise noise{draws, kSize};
        dqw::RowReader rows(&noise);
        for (const std::size_t k : {dqw::Draws::kApart - 1, dqw::Draws::kApart, std::size_t{7}, std::size_t{7},
                                    2 * dqw::Draws::kApart + 8, std::size_t{0}, std::size_t{8}, std::size_t{9}}) {
            expect_row(row_of(all[0], k), rows.at(logs[0], k));
            expect_row(row_of(all[1], k % 50), rows.at(logs[1], k % 50));
            TEST_ASSERT_TRUE(all[0].w_m_rad_s[k] == rows.speed_at(logs[0], k));
        }
    }
}

void without_noise()
{
    const std::vector<dqw::Log> logs = two_logs();
    dqw::RowReader rows(nullptr);
    expect_row(row_of(logs[0], 70000), rows.at(logs[0], 70000));
    expect_row(row_of(logs[1], 3), rows.at(logs[1], 3));
    TEST_ASSERT_TRUE(logs[1].w_m_rad_s[3] == rows.speed_at(logs[1], 3));
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(forwards);
    RUN_TEST(anywhere);
    RUN_TEST(without_noise);
    return UNITY_END();
}
