#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_csv.h"
#include "sim_map.h"

enum { COLUMNS = 4, POINTS_MAX = 1000000 };
static const char *const names[COLUMNS] = {"i_d_A", "i_q_A", "psi_d_Wb", "psi_q_Wb"};

typedef struct point {
    double value[COLUMNS];
    long line;
} point;

typedef struct reader {
    const char *path;
    long line;
    char *message;
    size_t size;
    int at[COLUMNS];
    point *points;
    size_t count, room;
} reader;

static int refuse(reader *r, long line, const char *format, ...)
{
    const int n = line > 0 ? snprintf(r->message, r->size, "%s:%ld: ", r->path, line)
                           : snprintf(r->message, r->size, "%s: ", r->path);
    va_list args;
    va_start(args, format);
    if (n >= 0 && (size_t)n < r->size) vsnprintf(r->message + n, r->size - (size_t)n, format, args);
    va_end(args);
    return DQW_SIM_ERR_MAP;
}

static int read_header(reader *r, char *text)
{
    const int missing = dqw_sim_csv_header(text, names, COLUMNS, r->at);
    return missing < COLUMNS
               ? refuse(r, 1, "no column %s; a flux map has i_d_A,i_q_A,psi_d_Wb,psi_q_Wb", names[missing])
               : 0;
}

static int read_point(reader *r, char *text)
{
    char *field[DQW_SIM_CSV_FIELDS];
    const int n = dqw_sim_csv_split(text, field);
    if (n == 1 && !*field[0]) return 0;
    point p = {.line = r->line};
    for (int k = 0; k < COLUMNS; ++k) {
        if (r->at[k] >= n) return refuse(r, r->line, "%d fields, but %s is field %d", n, names[k], r->at[k] + 1);
        char *end;
        const char *text_k = field[r->at[k]];
        p.value[k] = strtod(text_k, &end);
        if (end == text_k || *end || !isfinite(p.value[k]))
            return refuse(r, r->line, "%s is '%.40s', not a finite number", names[k], text_k);
    }
    if (r->count == r->room) {
        r->room = r->room ? 2 * r->room : 256;
        point *more = r->count < POINTS_MAX ? realloc(r->points, r->room * sizeof *more) : NULL;
        if (!more) return refuse(r, r->line, "more than %d points, or out of memory", POINTS_MAX);
        r->points = more;
    }
    r->points[r->count++] = p;
    return 0;
}

static int by_current(const void *a, const void *b)
{
    const point *p = a, *q = b;
    if (p->value[0] != q->value[0]) return p->value[0] < q->value[0] ? -1 : 1;
    return (p->value[1] > q->value[1]) - (p->value[1] < q->value[1]);
}

static int make_grid(reader *r, dqw_sim_grid *g)
{
    if (r->count == 0) return refuse(r, 0, "no points");
    qsort(r->points, r->count, sizeof *r->points, by_current);
    const point *p = r->points;
    g->n_q = 1;
    while (g->n_q < r->count && p[g->n_q].value[0] == p[0].value[0]) ++g->n_q;
    for (size_t k = 0; k < r->count; ++k) {
        if (k && p[k].value[0] == p[k - 1].value[0] && p[k].value[1] == p[k - 1].value[1])
            return refuse(r, p[k].line, "i_d_A = %g, i_q_A = %g is there twice (line %ld)", p[k].value[0],
                          p[k].value[1], p[k - 1].line);
    }
    if (r->count % g->n_q)
        return refuse(r, 0, "not a full grid: %lu points, %lu with the first i_d_A", (unsigned long)r->count,
                      (unsigned long)g->n_q);
    g->n_d = r->count / g->n_q;
    for (size_t k = 0; k < r->count; ++k) {
        const point *row = &p[k - k % g->n_q], *column = &p[k % g->n_q];
        if (p[k].value[0] != row->value[0] || p[k].value[1] != column->value[1])
            return refuse(r, p[k].line, "not a full grid: i_d_A = %g, i_q_A = %g has no place in it", p[k].value[0],
                          p[k].value[1]);
    }
    if (g->n_d < 3 || g->n_q < 3)
        return refuse(r, 0, "a grid of %lu by %lu points; 3 by 3 are needed", (unsigned long)g->n_d,
                      (unsigned long)g->n_q);
    const double *first = p[0].value, *last = p[r->count - 1].value;
    if (first[0] > 0 || last[0] < 0 || first[1] > 0 || last[1] < 0)
        return refuse(r, 0, "zero current lies outside the map");
    g->i_d_A = malloc(g->n_d * sizeof(double)), g->i_q_A = malloc(g->n_q * sizeof(double));
    g->psi_d_Wb = malloc(r->count * sizeof(double)), g->psi_q_Wb = malloc(r->count * sizeof(double));
    if (!g->i_d_A || !g->i_q_A || !g->psi_d_Wb || !g->psi_q_Wb) return DQW_SIM_ERR_MEMORY;
    for (size_t j = 0; j < g->n_d; ++j) g->i_d_A[j] = p[j * g->n_q].value[0];
    for (size_t k = 0; k < g->n_q; ++k) g->i_q_A[k] = p[k].value[1];
    for (size_t k = 0; k < r->count; ++k) g->psi_d_Wb[k] = p[k].value[2], g->psi_q_Wb[k] = p[k].value[3];
    return 0;
}

int dqw_sim_grid_read(const char *path, dqw_sim_grid *grid, char *message, size_t size)
{
    reader r = {.path = path, .size = size};
    r.message = message;
    memset(grid, 0, sizeof *grid);
    FILE *file = fopen(path, "r");
    if (!file) return refuse(&r, 0, "%s", strerror(errno));
    char text[DQW_SIM_CSV_LINE];
    int status = 0;
    while (status == 0 && fgets(text, sizeof text, file)) {
        ++r.line;
        if (strlen(text) == sizeof text - 1)
            status = refuse(&r, r.line, "line of over %d characters", DQW_SIM_CSV_LINE - 2);
        else
            status = r.line == 1 ? read_header(&r, text) : read_point(&r, text);
    }
    if (status == 0 && ferror(file)) status = refuse(&r, 0, "%s", strerror(errno));
    fclose(file);
    if (status == 0 && r.line == 0) status = refuse(&r, 0, "empty file");
    if (status == 0) status = make_grid(&r, grid);
    free(r.points);
    if (status) dqw_sim_grid_free(grid);
    return status;
}

void dqw_sim_grid_free(dqw_sim_grid *grid)
{
    free(grid->i_d_A), free(grid->i_q_A), free(grid->psi_d_Wb), free(grid->psi_q_Wb);
    memset(grid, 0, sizeof *grid);
}
