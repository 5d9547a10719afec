// A reference beside the estimators that shares nothing with them: plain least squares of R, L_d, L_q and the flux on
// triangular blocks, (E13) to (E16), its deviations widened by all of the residual that lasts, as if that stood in line
// with each input. No effect, no noise on inputs, no memory that fades. Arguments: CSV of `dqwatch sim`, pole pairs.
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CHANNELS = 6, WEIGHTS = 4 };

static const char *const NAME[CHANNELS] = {"t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s"};
static const char *const WEIGHT[WEIGHTS] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};

typedef struct {
    size_t rows;
    double *x;  // CHANNELS a row
} log_rows;

static log_rows read_log(const char *path)
{
    FILE *f = fopen(path, "r");
    if (f == NULL) exit(3);
    static char line[4096];
    int column[64] = {0};
    int columns = 0;
    if (fgets(line, sizeof line, f) == NULL) exit(3);
    for (char *name = strtok(line, ",\n"); name != NULL && columns < 64; name = strtok(NULL, ",\n"), columns++) {
        column[columns] = -1;
        for (int c = 0; c < CHANNELS; c++)
            if (strcmp(name, NAME[c]) == 0) column[columns] = c;
    }
    log_rows log = {0, NULL};
    size_t room = 0;
    while (fgets(line, sizeof line, f) != NULL) {
        if (log.rows == room) {
            room = room ? 2 * room : 100000;
            log.x = realloc(log.x, room * CHANNELS * sizeof *log.x);
            if (log.x == NULL) exit(3);
        }
        char *at = line;
        for (int c = 0; c < columns; c++) {
            const double x = strtod(at, &at);
            if (column[c] >= 0) log.x[log.rows * CHANNELS + (size_t)column[c]] = x;
            if (*at == ',') at++;
        }
        log.rows++;
    }
    fclose(f);
    return log;
}

// Cholesky; the inverse of a positive definite matrix in place. False where it is none.
static bool invert(double a[WEIGHTS][WEIGHTS])
{
    double l[WEIGHTS][WEIGHTS] = {{0}};
    double b[WEIGHTS][WEIGHTS] = {{0}};
    for (int i = 0; i < WEIGHTS; i++)
        for (int j = 0; j <= i; j++) {
            double sum = a[i][j];
            for (int k = 0; k < j; k++) sum -= l[i][k] * l[j][k];
            if (i == j && !(sum > 1e-12 * a[i][i])) return false;
            l[i][j] = i == j ? sqrt(sum) : sum / l[j][j];
        }
    for (int j = 0; j < WEIGHTS; j++)
        for (int i = j; i < WEIGHTS; i++) {
            double sum = i == j ? 1 : 0;
            for (int k = j; k < i; k++) sum -= l[i][k] * b[k][j];
            b[i][j] = sum / l[i][i];
        }
    for (int i = 0; i < WEIGHTS; i++)
        for (int j = 0; j < WEIGHTS; j++) {
            a[i][j] = 0;
            for (int k = i > j ? i : j; k < WEIGHTS; k++) a[i][j] += b[k][i] * b[k][j];
        }
    return true;
}

typedef struct {
    double v[2], x[2][WEIGHTS];
} block_row;

// Block number n, halves of h pairs; L[] for the end correction, 0: none.
static block_row block_of(const double *x, size_t n, int h, double T_s, double p, const double L_H[2])
{
    block_row b = {{0}, {{0}}};
    const double sum = (double)h * (h + 1);
    for (int j = 0; j < 2 * h; j++) {
        const double g = (j < h ? j + 1 : 2 * h - j) / sum;
        const double *a = x + (n * (size_t)h + (size_t)j) * CHANNELS;
        const double *c = a + CHANNELS;
        const double w = p * 0.5 * (a[5] + c[5]);
        const double di[2] = {c[3] - a[3], c[4] - a[4]};
        double i[2] = {0.5 * (a[3] + c[3]), 0.5 * (a[4] + c[4])};
        double wi[2] = {p * 0.5 * (a[5] * a[3] + c[5] * c[3]), p * 0.5 * (a[5] * a[4] + c[5] * c[4])};
        if (L_H[0] > 0 && L_H[1] > 0) {
            const double J[2] = {T_s * w * (a[2] + L_H[1] * di[1] / T_s) / L_H[0],
                                 -T_s * w * (a[1] + L_H[0] * di[0] / T_s) / L_H[1]};
            for (int k = 0; k < 2; k++) {
                i[k] -= T_s * J[k] / 12;
                wi[k] -= w * T_s * J[k] / 12;
            }
        }
        b.v[0] += g * a[1];
        b.v[1] += g * a[2];
        const double d[WEIGHTS] = {i[0], di[0] / T_s, -wi[1], 0};
        const double q[WEIGHTS] = {i[1], wi[0], di[1] / T_s, w};
        for (int k = 0; k < WEIGHTS; k++) {
            b.x[0][k] += g * d[k];
            b.x[1][k] += g * q[k];
        }
    }
    return b;
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }

int main(int argc, char **argv)
{
    if (argc != 3) return 2;
    const log_rows log = read_log(argv[1]);
    const double p = atof(argv[2]);
    if (log.rows < 1000) return 3;
    const double T_s = (log.x[(log.rows - 1) * CHANNELS] - log.x[0]) / (double)(log.rows - 1);
    double w_max = 1;
    for (size_t k = 0; k < log.rows; k++) w_max = fmax(w_max, p * fabs(log.x[k * CHANNELS + 5]));
    int h = (int)(fmin(1e-3, 1.1 / w_max) / T_s);
    if (h < 5) h = 5;
    const size_t blocks = (log.rows - 1) / (size_t)h - 1;
    double L_H[2] = {0, 0};
    double w[WEIGHTS] = {0};
    double P[WEIGHTS][WEIGHTS];
    for (int pass = 0; pass < 3; pass++) {
        double y[WEIGHTS] = {0};
        memset(P, 0, sizeof P);
        for (size_t n = 0; n < blocks; n++) {
            const block_row b = block_of(log.x, n, h, T_s, p, L_H);
            for (int axis = 0; axis < 2; axis++)
                for (int i = 0; i < WEIGHTS; i++) {
                    y[i] += b.x[axis][i] * b.v[axis];
                    for (int j = 0; j < WEIGHTS; j++) P[i][j] += b.x[axis][i] * b.x[axis][j];
                }
        }
        if (!invert(P)) {
            printf("{}\n");
            return 0;
        }
        for (int i = 0; i < WEIGHTS; i++) w[i] = dot(P[i], y);
        L_H[0] = w[1];
        L_H[1] = w[2];
    }
    // Of the residual: its power, and its mean products with itself one, two and three blocks later.
    double product[4] = {0};
    double before[3][2] = {{0}};
    for (size_t n = 0; n < blocks; n++) {
        const block_row b = block_of(log.x, n, h, T_s, p, L_H);
        const double e[2] = {b.v[0] - dot(b.x[0], w), b.v[1] - dot(b.x[1], w)};
        product[0] += e[0] * e[0] + e[1] * e[1];
        for (size_t k = 1; k <= 3 && k <= n; k++)
            product[k] += e[0] * before[(n - k) % 3][0] + e[1] * before[(n - k) % 3][1];
        memcpy(before[n % 3], e, sizeof e);
    }
    const double rows = 2.0 * (double)blocks;
    for (int k = 0; k < 4; k++) product[k] /= rows;
    const double inflation = 1 + 2 * fmax(product[1] / product[0], 0);
    const double lasts = fmax(0.5 * (product[2] + product[3]) - 2 * product[0] / sqrt(rows), 0);
    printf("{");
    for (int i = 0; i < WEIGHTS; i++)
        printf("%s\"%s\": {\"value\": %.7g, \"sd\": %.7g}", i ? ", " : "", WEIGHT[i], w[i],
               sqrt(product[0] * P[i][i] * inflation + lasts * rows * P[i][i]));
    printf("}\n");
    free(log.x);
    return 0;
}
