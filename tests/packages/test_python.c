// The Python package: pip installs it from this clone, its tests pass there, its types hold.
// Plain only: runs other programs.
#include "tool.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_pip_installs_it(void) { tool_passes("tests/packages/python.sh install"); }
static void test_its_tests_pass(void) { tool_passes("tests/packages/python.sh test"); }
static void test_its_types_hold(void) { tool_passes("tests/packages/python.sh types"); }

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_pip_installs_it);
    RUN_TEST(test_its_tests_pass);
    RUN_TEST(test_its_types_hold);
    return UNITY_END();
}
