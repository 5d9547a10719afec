// Files of the library built with two values of DQW_EFFECT_WEIGHTS do not link.
// Plain only: runs other programs.
#include "tool.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_no_file_of_another_size_links(void) { tool_passes("tests/lib/sizes.sh gcc"); }

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_no_file_of_another_size_links);
    return UNITY_END();
}
