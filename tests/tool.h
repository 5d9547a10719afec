// Runs a script or a program from a C test and keeps what it says.
#ifndef TOOL_H
#define TOOL_H

#include <stdio.h>
#include <sys/wait.h>

#include "dqw_test.h"

/// Exit code of the scripts whose tool is absent.
#define TOOL_ABSENT 77

static char tool_said[16384];

/// Both outputs into tool_said, its end cut off where there is no room. Returns the exit code, -1 where it did not end
/// by itself.
static inline int tool(const char *command)
{
    char line[1000];
    TEST_ASSERT_TRUE((size_t)snprintf(line, sizeof line, "exec 2>&1; %s", command) < sizeof line);
    FILE *pipe = popen(line, "r");
    TEST_ASSERT_NOT_NULL_MESSAGE(pipe, command);
    size_t length = 0;
    char rest[4096];
    for (size_t got; (got = fread(rest, 1, sizeof rest, pipe)) > 0;) {
        const size_t kept = got < sizeof tool_said - 1 - length ? got : sizeof tool_said - 1 - length;
        memcpy(tool_said + length, rest, kept);
        length += kept;
    }
    tool_said[length] = 0;
    const int status = pclose(pipe);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// A script that must succeed; where its tool is absent the test is skipped with what it says.
static inline void tool_passes(const char *command)
{
    const int code = tool(command);
    if (code == TOOL_ABSENT) TEST_IGNORE_MESSAGE(tool_said);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, code, tool_said);
}

#endif
