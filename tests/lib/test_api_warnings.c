// The public headers, and configurations as users write them, in every language of both compilers without a warning.
// Plain only: runs other programs.
#include "tool.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_no_warning_of_gcc(void) { tool_passes("tests/lib/api_warnings.sh gcc"); }
static void test_no_warning_of_clang(void) { tool_passes("tests/lib/api_warnings.sh clang"); }

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_no_warning_of_gcc);
    RUN_TEST(test_no_warning_of_clang);
    return UNITY_END();
}
