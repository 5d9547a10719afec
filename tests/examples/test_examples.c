// The examples for other projects' controllers compile with those projects' flags against their headers' signatures.
// Plain only: runs other programs.
#include "tool.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_vesc(void) { tool_passes("tests/examples/examples.sh vesc"); }
static void test_moteus(void) { tool_passes("tests/examples/examples.sh moteus"); }
static void test_stm32_on_a_cortex_m0(void) { tool_passes("tests/examples/examples.sh stm32_m0"); }
static void test_the_cortex_m0_learns(void) { tool_passes("tests/examples/examples.sh m0_run"); }
static void test_simplefoc(void) { tool_passes("tests/examples/examples.sh simplefoc"); }

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_vesc);
    RUN_TEST(test_moteus);
    RUN_TEST(test_stm32_on_a_cortex_m0);
    RUN_TEST(test_the_cortex_m0_learns);
    RUN_TEST(test_simplefoc);
    return UNITY_END();
}
