// Packages generated from packages/: each is used by a consumer that learns a motor. make packages has the ecosystems'
// own judges too.
// Plain only: runs other programs.
#include "tool.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_platformio_is_used(void) { tool_passes("tests/packages/package.sh platformio use"); }
static void test_arduino_has_its_layout(void) { tool_passes("tests/packages/package.sh arduino judge"); }
static void test_arduino_is_used(void) { tool_passes("tests/packages/package.sh arduino use"); }
static void test_espidf_is_used(void) { tool_passes("tests/packages/package.sh espidf use"); }
static void test_cmsis_is_used(void) { tool_passes("tests/packages/package.sh cmsis use"); }

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_platformio_is_used);
    RUN_TEST(test_arduino_has_its_layout);
    RUN_TEST(test_arduino_is_used);
    RUN_TEST(test_espidf_is_used);
    RUN_TEST(test_cmsis_is_used);
    return UNITY_END();
}
