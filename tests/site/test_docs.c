// The documentation's sources: links, anchors, navigation and formulas; a motulator log; a notebook. `make docs` builds
// and checks the whole site.
// Plain only: runs other programs.
#include "tool.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_sources_hold_together(void) { tool_passes("tests/site/sources.sh"); }
static void test_checks_see_what_is_wrong(void) { tool_passes("tests/site/sources.sh broken"); }
static void test_formulas_are_typeset_as_written(void) { tool_passes("tests/site/formulas.py"); }
static void test_motulator_log_gives_its_machine(void) { tool_passes("tests/site/motulator.sh"); }
// The shortest; make docs runs all.
static void test_a_notebook_runs(void) { tool_passes("tests/site/notebook.sh float_q15 2"); }

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_sources_hold_together);
    RUN_TEST(test_checks_see_what_is_wrong);
    RUN_TEST(test_formulas_are_typeset_as_written);
    RUN_TEST(test_motulator_log_gives_its_machine);
    RUN_TEST(test_a_notebook_runs);
    return UNITY_END();
}
