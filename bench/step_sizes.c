// The neuron at every step size and amplitude, float and Q15: a filter of four taps is learned from white noise, and
// the weights' error, RMS over the last quarter of a run, is printed in % of the weights, a line `NAME STEP_SIZE
// AMPLITUDE SAMPLES ERROR` each.
// `step_sizes AMPLITUDE SAMPLES` writes the signals instead, input and target as pairs of 16-bit numbers, for who else
// learns them.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "dqw_learner.h"
#include "dqw_learner_q15.h"

enum { TAPS = 4, EVERY = 100, STEPS = 4, AMPLITUDES = 6 };
static const double truth[TAPS] = {0.304, -0.26, 0.11, 0.15};  // no sum beyond the full scale
static const uint16_t step_q15[STEPS] = {16384, 3277, 328, 33};
static const double amplitudes[AMPLITUDES] = {0.05, 0.1, 0.3, 0.5, 0.7, 1.0};

// White noise between -amplitude and amplitude, and what the filter makes of it, both rounded to Q15.
typedef struct signals {
    uint64_t state;
    double amplitude;
    int16_t x_q15[TAPS], y_q15;  ///< newest first
} signals;

static void next(signals *s)
{
    uint64_t z = s->state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    z ^= z >> 31;
    for (int i = TAPS - 1; i > 0; i--) s->x_q15[i] = s->x_q15[i - 1];
    s->x_q15[0] = (int16_t)lrint(32767 * s->amplitude * (2 * ((double)(z >> 11) / 9007199254740992.0) - 1));
    double y = 0.0;
    for (int i = 0; i < TAPS; i++) y += truth[i] * s->x_q15[i];
    s->y_q15 = (int16_t)lrint(y);
}

// Until what is left of the start is e^-16 of it, where errors fall with the slowest learner's time.
static long samples_of(double step, double amplitude)
{
    const double power = amplitude * amplitude / 3;
    return 40000 + EVERY * (long)(16 * (1 + TAPS * power) / (step * power) / EVERY);
}

static double off(const double w[])
{
    double sum = 0.0;
    double all = 0.0;
    for (int i = 0; i < TAPS; i++) {
        sum += (w[i] - truth[i]) * (w[i] - truth[i]);
        all += truth[i] * truth[i];
    }
    return 1e4 * sum / all;
}

static void learn(uint16_t step, double amplitude)
{
    signals s = {.state = 1, .amplitude = amplitude};
    float w[TAPS] = {0};
    int32_t w_q31[TAPS] = {0};
    const long samples = samples_of(step / 32768.0, amplitude);
    double square[2] = {0};
    long count = 0;
    for (long k = 1; k <= samples; k++) {
        next(&s);
        float x[TAPS];
        for (int i = 0; i < TAPS; i++) x[i] = (float)s.x_q15[i] / 32768;
        (void)dqw_learner_step_pu(w, x, TAPS, (float)s.y_q15 / 32768, (float)step / 32768);
        (void)dqw_learner_step_pu_q15(w_q31, s.x_q15, TAPS, s.y_q15, step);
        if (k <= samples - samples / 4 || k % EVERY != 0) continue;
        double is[2][TAPS];
        for (int i = 0; i < TAPS; i++) is[0][i] = (double)w[i], is[1][i] = w_q31[i] / 2147483648.0;
        for (int kind = 0; kind < 2; kind++) square[kind] += off(is[kind]);
        count++;
    }
    printf("float %g %g %ld %.6f\n", round(step * 1e4 / 32768) / 1e4, amplitude, samples,
           sqrt(square[0] / (double)count));
    printf("Q15 %g %g %ld %.6f\n", round(step * 1e4 / 32768) / 1e4, amplitude, samples,
           sqrt(square[1] / (double)count));
}

int main(int argc, char **argv)
{
    if (argc == 3) {
        signals s = {.state = 1, .amplitude = atof(argv[1])};
        for (long k = atol(argv[2]); k > 0; k--) {
            next(&s);
            const int16_t pair[2] = {s.x_q15[0], s.y_q15};
            if (fwrite(pair, sizeof pair, 1, stdout) != 1) return 1;
        }
        return fflush(stdout) == 0 ? 0 : 1;
    }
    for (int i = 0; i < STEPS; i++)
        for (int a = 0; a < AMPLITUDES; a++) learn(step_q15[i], amplitudes[a]);
    return 0;
}
