// What the C tests share: a random generator, two-sided bounds, least squares in double, the kind of run.
#ifndef DQW_TEST_H
#define DQW_TEST_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unity.h"

#define PI 3.14159265358979323846

/// What is being tried: set it before a loop's assertions, and a failure names it.
static char test_case[160];

#define CASE(...) ((void)snprintf(test_case, sizeof test_case, __VA_ARGS__))

/// low <= value <= high. The comment beside a use gives the value when the bound was written; DQW_TEST_VALUES=1 prints
/// it.
static inline void test_between(double low, double value, double high, const char *text, int line)
{
    char message[400];
    const bool ok = value >= low && value <= high;
    (void)snprintf(message, sizeof message, "%s = %.6g, bounds %.6g .. %.6g%s%s", text, value, low, high,
                   test_case[0] ? "; " : "", test_case);
    if (getenv("DQW_TEST_VALUES") != NULL) printf("line %d: %s\n", line, message);
    if (!ok) UNITY_TEST_FAIL((UNITY_LINE_TYPE)line, message);
}
#define BETWEEN(low, value, high) test_between((low), (value), (high), #value, __LINE__)

/// A condition whose failure names the case.
#define HOLDS(condition)                                                                                               \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            char holds_message[400];                                                                                   \
            (void)snprintf(holds_message, sizeof holds_message, "%s; %s", #condition, test_case);                      \
            UNITY_TEST_FAIL((UNITY_LINE_TYPE)__LINE__, holds_message);                                                 \
        }                                                                                                              \
    } while (0)

/// `call` returns `status` and leaves every byte of `object` as it was.
#define REFUSED(object, status, call)                                                                                  \
    do {                                                                                                               \
        unsigned char refused_before[sizeof(object)];                                                                  \
        memset(&(object), 0x5a, sizeof(object));                                                                       \
        memcpy(refused_before, &(object), sizeof(object));                                                             \
        TEST_ASSERT_EQUAL_INT((status), (call));                                                                       \
        TEST_ASSERT_EQUAL_MEMORY(refused_before, &(object), sizeof(object));                                           \
    } while (0)

/// Fewer repetitions where the sanitizers slow everything down, and where somebody waits: `make check`.
static inline int scaled(int count)
{
    const char *kind = getenv("DQW_TEST_KIND");
    if (kind == NULL) return count;
    return strcmp(kind, "asan") == 0 ? (count + 9) / 10 : strcmp(kind, "check") == 0 ? (count + 2) / 3 : count;
}

typedef struct test_random {
    uint64_t state;
} test_random;

static inline uint64_t random_bits(test_random *r)
{
    uint64_t z = r->state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/// Uniform in low .. high.
static inline double random_uniform(test_random *r, double low, double high)
{
    return low + (high - low) * ((double)(random_bits(r) >> 11) / 9007199254740992.0);
}

/// Standard normal.
static inline double random_normal(test_random *r)
{
    const double u = random_uniform(r, 1e-300, 1.0);
    return sqrt(-2.0 * log(u)) * cos(2.0 * PI * random_uniform(r, 0.0, 1.0));
}

/// Any of the 2^32 bit patterns; every fourth is NaN, infinite, denormal, zero or huge.
static inline float random_float_bits(test_random *r)
{
    static const uint32_t odd[] = {0x7fc00000u, 0xffc12345u, 0x7f800001u, 0x7f800000u, 0xff800000u, 0u,
                                   0x80000000u, 1u,          0x807fffffu, 0x7f7fffffu, 0xff7fffffu};
    const uint64_t z = random_bits(r);
    uint32_t bits = (uint32_t)z;
    if ((z >> 32) % 4 == 0) bits = odd[(z >> 34) % (sizeof odd / sizeof odd[0])];
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

#define LS_MAX 8

/// Least squares in double: sums of the normal equations, X'X + ridge I.
typedef struct test_ls {
    int n;
    long rows;
    double a[LS_MAX][LS_MAX], b[LS_MAX], yy;
} test_ls;

static inline void ls_begin(test_ls *s, int n, double ridge)
{
    memset(s, 0, sizeof *s);
    s->n = n;
    for (int i = 0; i < n; i++) s->a[i][i] = ridge;
}

static inline void ls_add(test_ls *s, const double x[], double y)
{
    for (int i = 0; i < s->n; i++) {
        s->b[i] += x[i] * y;
        for (int j = 0; j < s->n; j++) s->a[i][j] += x[i] * x[j];
    }
    s->yy += y * y;
    s->rows++;
}

/// Solution and inverse by Cholesky, in long double. Returns the sum of squared residuals.
static inline double ls_solve(const test_ls *s, double w[], double inverse[LS_MAX][LS_MAX])
{
    long double l[LS_MAX][LS_MAX] = {{0}};
    const int n = s->n;
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            long double sum = s->a[i][j];
            for (int k = 0; k < j; k++) sum -= l[i][k] * l[j][k];
            l[i][j] = i == j ? sqrtl(sum) : sum / l[j][j];
        }
    for (int c = -1; c < n; c++) {
        long double z[LS_MAX];
        for (int i = 0; i < n; i++) {
            long double sum = c < 0 ? (long double)s->b[i] : (c == i ? 1.0L : 0.0L);
            for (int k = 0; k < i; k++) sum -= l[i][k] * z[k];
            z[i] = sum / l[i][i];
        }
        for (int i = n - 1; i >= 0; i--) {
            for (int k = i + 1; k < n; k++) z[i] -= l[k][i] * z[k];
            z[i] /= l[i][i];
        }
        for (int i = 0; i < n; i++) {
            if (c < 0)
                w[i] = (double)z[i];
            else
                inverse[i][c] = (double)z[i];
        }
    }
    double rest = s->yy;
    for (int i = 0; i < n; i++) rest -= w[i] * s->b[i];
    return rest;
}

#endif
