// What may be no more than a drive's sampling.
#include "ref/trace/sampled_instant.hpp"

#include "unity.h"

void setUp() {}
void tearDown() {}

namespace {

using dqw::Law;

/// R, L_d, L_q, psi and one effect.
dqw::Point with(Law law, double weight)
{
    dqw::Point at;
    at.base.resize(4), at.gain.resize(2);
    at.base << 0.012, 10e-6, 17e-6, 1.6e-3;
    at.terms.push_back({{law, {}}, {weight}});
    return at;
}

/// A microsecond of currents: by itself, or as 17 uH over a resistance.
void a_microsecond_of_the_currents()
{
    const auto is = [](Law law, double weight) { return dqw::may_be_sampling(with(law, weight), dqw::name_of(law)); };
    TEST_ASSERT_TRUE(is(Law::sample_shift, -0.99e-6));
    TEST_ASSERT_FALSE(is(Law::sample_shift, 1.01e-6));
    TEST_ASSERT_TRUE(is(Law::sensor_lag, 0.99e-6));
    TEST_ASSERT_FALSE(is(Law::sensor_lag, 1.01e-6));
    for (const Law law : {Law::iron_loss, Law::turn_short}) {
        TEST_ASSERT_TRUE(is(law, 0.99e-6 / 17e-6));
        TEST_ASSERT_FALSE(is(law, 1.01e-6 / 17e-6));
    }
    // Whatever their size: what is no shift of the currents, and what is not there.
    TEST_ASSERT_FALSE(is(Law::angle_offset, 1e-9));
    TEST_ASSERT_FALSE(dqw::may_be_sampling(with(Law::iron_loss, 1e-9), "turn_short"));
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(a_microsecond_of_the_currents);
    return UNITY_END();
}
