// The gate: every combination of flags, runs of repeats, counters at their end.
#include "dqw_gate.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_fresh_gate_is_all_zero_but_the_limit(void)
{
    dqw_gate g;
    memset(&g, 0x5a, sizeof g);
    dqw_gate_init(&g, 7);
    dqw_gate expected;
    memset(&expected, 0, sizeof expected);
    expected.stale_limit = 7;
    TEST_ASSERT_EQUAL_MEMORY(&expected, &g, sizeof g);
}

// Every sequence of 6 samples, each of 8 kinds, at every limit of 0 .. 3, against the rule told in other words.
static void test_every_short_sequence(void)
{
    for (uint32_t limit = 0; limit <= 3; limit++)
        for (int sequence = 0; sequence < 8 * 8 * 8 * 8 * 8 * 8; sequence += (limit == 2 ? 1 : 7)) {
            CASE("limit %u, sequence 0%o", (unsigned)limit, (unsigned)sequence);
            dqw_gate g;
            dqw_gate_init(&g, limit);
            uint32_t count[4] = {0};
            for (int k = 0; k < 6; k++) {
                const int kind = sequence >> (3 * k) & 7;
                const dqw_gate_sample s = {
                    .finite = !(kind & 1), .saturated = (kind & 2) != 0, .repeated = (kind & 4) != 0};
                // Repeats in a row that end here; samples that are no numbers neither count nor break the row.
                uint32_t row = 0;
                for (int m = k; m >= 0; m--) {
                    const int at = sequence >> (3 * m) & 7;
                    if (at & 1) continue;
                    if (!(at & 4)) break;
                    row++;
                }
                uint32_t expected = 0;
                int counter = 0;
                if (kind & 1)
                    expected = DQW_EVENT_NONFINITE, counter = 1;
                else if (kind & 2)
                    expected = DQW_EVENT_SATURATED, counter = 2;
                else if (limit != 0 && row >= limit)
                    expected = DQW_EVENT_STALE, counter = 3;
                count[counter]++;
                HOLDS(dqw_gate_check(&g, s) == expected);
            }
            HOLDS(g.accepted == count[0] && g.nonfinite == count[1] && g.saturated == count[2] && g.stale == count[3]);
        }
}

static void test_counters_stop_at_their_maximum(void)
{
    dqw_gate g;
    memset(&g, 0xff, sizeof g);
    const dqw_gate full = g;
    const dqw_gate_sample kinds[] = {
        {.finite = false}, {.finite = true, .saturated = true, .repeated = true}, {.finite = true, .repeated = true}};
    for (int k = 0; k < 3; k++) (void)dqw_gate_check(&g, kinds[k]);
    TEST_ASSERT_EQUAL_MEMORY(&full, &g, sizeof g);
    g.stale_limit = 0;
    TEST_ASSERT_EQUAL_UINT32(0, dqw_gate_check(&g, kinds[2]));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, g.accepted);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_fresh_gate_is_all_zero_but_the_limit);
    RUN_TEST(test_every_short_sequence);
    RUN_TEST(test_counters_stop_at_their_maximum);
    return UNITY_END();
}
