// Work on all cores is done once each, and ends where one of them throws or where nobody waits for it any more.
#include <atomic>
#include <stdexcept>
#include <vector>

#include "ref/fit/fit.hpp"
#include "ref/log/hands.hpp"
#include "ref/machine.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) { dqw::still_wanted = nullptr; }

namespace {

struct Enough {};

void each_once()
{
    constexpr std::size_t kCount = 1000;
    std::vector<std::atomic<int>> done(kCount);
    std::atomic<bool> rising{true};
    dqw::side_by_side(
        kCount, [] { return std::size_t{0}; },
        [&](std::size_t n, std::size_t& last) {
            if (n != 0 && n <= last) rising = false;
            last = n;
            ++done[n];
        });
    for (const auto& n : done) TEST_ASSERT_EQUAL(1, n.load());
    TEST_ASSERT_TRUE(rising);
}

template <typename Work> bool ended(Work&& work)
{
    try {
        work();
        return false;
    } catch (const Enough&) {
        return true;
    }
}

void what_one_throws()
{
    for (const std::size_t where : {std::size_t{0}, std::size_t{1}, std::size_t{999}})
        TEST_ASSERT_TRUE(ended([&] {
            dqw::side_by_side(1000, [&](std::size_t n) {
                if (n == where) throw Enough();
            });
        }));
}

void threads_ask_as_well()
{
    std::atomic<int> asked{0};
    dqw::still_wanted = [&] { ++asked; };
    dqw::side_by_side(50, [](std::size_t) { dqw::ask_at(65536); });
    TEST_ASSERT_EQUAL(50, asked.load());
    dqw::ask_at(65535);
    dqw::ask_at(65537);
    TEST_ASSERT_EQUAL(50, asked.load());
    dqw::ask_at(65540, 20);
    TEST_ASSERT_EQUAL(51, asked.load());
}

/// Between two of its looks at the gains too, and to its last pass.
void a_fit_ends_wherever_it_is()
{
    const dqw::Log log = machine::simulate({}, {});
    int asked = 0;
    dqw::still_wanted = [&] { ++asked; };
    dqw::fit({log});
    const int all = asked;
    TEST_ASSERT_TRUE(all > 20);
    for (int part = 0; part < 4; ++part) {
        int left = 1 + part * (all - 1) / 3;
        dqw::still_wanted = [&] {
            if (--left == 0) throw Enough();
        };
        TEST_ASSERT_TRUE(ended([&] { dqw::fit({log}); }));
        TEST_ASSERT_EQUAL(0, left);
    }
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(each_once);
    RUN_TEST(what_one_throws);
    RUN_TEST(threads_ask_as_well);
    RUN_TEST(a_fit_ends_wherever_it_is);
    return UNITY_END();
}
