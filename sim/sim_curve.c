#include "sim_curve.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_csv.h"

static const char *const names[2] = {"i_A", "v_V"};

typedef struct reader {
    const char *path;
    long line;
    char *message;
    size_t size;
    int at[2];
} reader;

static int refuse(const reader *r, const char *format, ...)
{
    const int n = r->line > 0 ? snprintf(r->message, r->size, "%s:%ld: ", r->path, r->line)
                              : snprintf(r->message, r->size, "%s: ", r->path);
    va_list args;
    va_start(args, format);
    if (n >= 0 && (size_t)n < r->size) vsnprintf(r->message + n, r->size - (size_t)n, format, args);
    va_end(args);
    return DQW_SIM_ERR_MAP;
}

static int read_header(reader *r, char *text)
{
    const int missing = dqw_sim_csv_header(text, names, 2, r->at);
    return missing < 2 ? refuse(r, "no column %s; an inverter curve has i_A,v_V", names[missing]) : 0;
}

static int read_point(reader *r, char *text, dqw_sim_curve *c)
{
    char *field[DQW_SIM_CSV_FIELDS];
    const int n = dqw_sim_csv_split(text, field);
    if (n == 1 && !*field[0]) return 0;
    double value[2];
    for (int k = 0; k < 2; ++k) {
        if (r->at[k] >= n) return refuse(r, "%d fields, but %s is field %d", n, names[k], r->at[k] + 1);
        char *end;
        value[k] = strtod(field[r->at[k]], &end);
        if (end == field[r->at[k]] || *end || !isfinite(value[k]))
            return refuse(r, "%s is '%.40s', not a finite number", names[k], field[r->at[k]]);
    }
    if (c->count == DQW_SIM_CURVE_POINTS) return refuse(r, "more than %d points", DQW_SIM_CURVE_POINTS);
    if (c->count && !(value[0] > c->i_A[c->count - 1])) return refuse(r, "i_A = %g does not ascend", value[0]);
    c->i_A[c->count] = value[0], c->v_V[c->count++] = value[1];
    return 0;
}

int dqw_sim_curve_read(const char *path, dqw_sim_curve *curve, char *message, size_t size)
{
    reader r = {.path = path, .size = size};
    r.message = message;
    memset(curve, 0, sizeof *curve);
    FILE *file = fopen(path, "r");
    if (!file) return refuse(&r, "%s", strerror(errno));
    char text[DQW_SIM_CSV_LINE];
    int status = 0;
    while (status == 0 && fgets(text, sizeof text, file)) {
        ++r.line;
        if (strlen(text) == sizeof text - 1)
            status = refuse(&r, "line of over %d characters", DQW_SIM_CSV_LINE - 2);
        else
            status = r.line == 1 ? read_header(&r, text) : read_point(&r, text, curve);
    }
    fclose(file);
    if (status) return status;
    r.line = 0;
    if (curve->count < 2) return refuse(&r, "%d points; 2 are needed", (int)curve->count);
    if (curve->i_A[0] < 0 && curve->i_A[curve->count - 1] <= 0) return refuse(&r, "no point with a positive current");
    if (curve->i_A[0] == 0 && curve->v_V[0] != 0)
        return refuse(&r, "v_V is %g at zero current, and jumps", curve->v_V[0]);
    if (curve->i_A[0] > 0) {
        memmove(curve->i_A + 1, curve->i_A, curve->count * sizeof *curve->i_A);
        memmove(curve->v_V + 1, curve->v_V, curve->count * sizeof *curve->v_V);
        curve->i_A[0] = curve->v_V[0] = 0, ++curve->count;
    }
    return 0;
}

static double one_side(const dqw_sim_curve *c, double i_A)
{
    size_t low = 0, high = c->count - 1;
    if (i_A <= c->i_A[low]) return c->v_V[low];
    if (i_A >= c->i_A[high]) return c->v_V[high];
    while (high - low > 1) {
        const size_t middle = (low + high) / 2;
        *(i_A < c->i_A[middle] ? &high : &low) = middle;
    }
    return c->v_V[low] + (c->v_V[high] - c->v_V[low]) * (i_A - c->i_A[low]) / (c->i_A[high] - c->i_A[low]);
}

double dqw_sim_curve_at(const dqw_sim_curve *curve, double i_A)
{
    if (curve->i_A[0] < 0) return 0.5 * (one_side(curve, i_A) - one_side(curve, -i_A));
    const double v = one_side(curve, fabs(i_A));
    return i_A < 0 ? -v : v;
}
