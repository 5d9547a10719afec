// lib/ under floating-point flags that promise finite numbers: what is none is still refused and counted, and what is
// learned is the same.
// Plain only: runs other programs.
#include <unistd.h>

#include "tool.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { PARAMETERS = 4 };

typedef struct outcome {
    long numbers_wrong, learners_wrong, spoilt, spoilt_wrong, in_service;
    double parameter[PARAMETERS];
} outcome;

static const char *const names[PARAMETERS] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};

static double said(const char *name)
{
    const char *at = tool_said;
    const size_t length = strlen(name);
    while (at != NULL && (strncmp(at, name, length) != 0 || at[length] != ' '))
        at = strchr(at, '\n') != NULL ? strchr(at, '\n') + 1 : NULL;
    return at != NULL ? strtod(at + length, NULL) : NAN;
}

static outcome run(const char *compiler, const char *flags)
{
    char program[] = "/tmp/dqw_fast_math_XXXXXX";
    const int file = mkstemp(program);
    TEST_ASSERT_TRUE(file >= 0);
    (void)close(file);
    char command[300];
    (void)snprintf(command, sizeof command, "tests/lib/fast_math/build.sh %s %s %s", program, compiler, flags);
    const int built = tool(command);
    const int ran = built == 0 ? tool(program) : -1;
    (void)unlink(program);
    if (built == TOOL_ABSENT) TEST_IGNORE_MESSAGE(tool_said);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, built, tool_said);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, ran, tool_said);
    outcome o = {(long)said("numbers_wrong"), (long)said("learners_wrong"), (long)said("spoilt"),
                 (long)said("spoilt_wrong"),  (long)said("in_service"),     {0}};
    for (int i = 0; i < PARAMETERS; i++) o.parameter[i] = said(names[i]);
    return o;
}

static void judge(const char *compiler)
{
    static const char *const flags[] = {"-O2 -ffast-math", "-O2 -ffinite-math-only", "-Os -ffast-math"};
    const outcome plain = run(compiler, "-O2 -ffp-contract=off");
    for (int f = -1; f < 3; f++) {
        const outcome o = f < 0 ? plain : run(compiler, flags[f]);
        CASE("%s %s: wrong numbers %ld, Learners %ld, samples %ld of %ld", compiler, f < 0 ? "plain" : flags[f],
             o.numbers_wrong, o.learners_wrong, o.spoilt_wrong, o.spoilt);
        HOLDS(o.numbers_wrong == 0 && o.learners_wrong == 0 && o.spoilt_wrong == 0);
        HOLDS(o.spoilt >= 50 && o.in_service == 1);
        for (int i = 0; i < PARAMETERS; i++) {
            CASE("%s %s: %s %g, plain %g", compiler, f < 0 ? "plain" : flags[f], names[i], o.parameter[i],
                 plain.parameter[i]);
            HOLDS(fabs(o.parameter[i] / plain.parameter[i] - 1) < 0.01);
        }
    }
}

static void test_what_is_no_number_is_refused_with_gcc(void) { judge("gcc"); }
static void test_what_is_no_number_is_refused_with_clang(void) { judge("clang"); }

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_is_no_number_is_refused_with_gcc);
    RUN_TEST(test_what_is_no_number_is_refused_with_clang);
    return UNITY_END();
}
