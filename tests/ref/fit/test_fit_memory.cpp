// A fit takes little memory beside the log: nothing that grows with it is kept.
// Plain only: counts by an operator new of its own.
#include <malloc.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>

#include "ref/fit/fit.hpp"
#include "ref/machine.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

std::atomic<std::size_t> held{0}, most{0};

void* taken(std::size_t bytes)
{
    void* p = std::malloc(bytes);
    if (p == nullptr) throw std::bad_alloc();
    const std::size_t now = held += malloc_usable_size(p);
    std::size_t before = most;
    while (now > before && !most.compare_exchange_weak(before, now)) {}
    return p;
}

void given_back(void* p)
{
    if (p == nullptr) return;
    held -= malloc_usable_size(p);
    std::free(p);
}

}  // namespace

void* operator new(std::size_t bytes) { return taken(bytes); }
void* operator new[](std::size_t bytes) { return taken(bytes); }
void operator delete(void* p) noexcept { given_back(p); }
void operator delete[](void* p) noexcept { given_back(p); }
void operator delete(void* p, std::size_t) noexcept { given_back(p); }
void operator delete[](void* p, std::size_t) noexcept { given_back(p); }

namespace {

void beside_a_noisy_log()
{
    machine::Run run;
    run.rows = 240000, run.substeps = 2;
    std::vector<dqw::Log> logs{machine::simulate({}, run)};
    unsigned seed = 1;
    for (auto* column : {&logs[0].v_d_V, &logs[0].v_q_V, &logs[0].i_d_A, &logs[0].i_q_A, &logs[0].w_m_rad_s})
        machine::add_noise(*column, 0.02, seed++);
    const std::size_t log = 6 * run.rows * sizeof(double), before = held;
    most = before;
    TEST_ASSERT_EQUAL_DOUBLE(4.0, machine::value(dqw::fit(logs), "pole_pairs"));
    const double part = static_cast<double>(most - before) / static_cast<double>(log);
    std::printf("of the log's memory: %.3f\n", part);
    // 3 MB of it for what looks at 20 000 rows, whatever the log.
    TEST_ASSERT_TRUE(part < 0.35);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(beside_a_noisy_log);
    return UNITY_END();
}
