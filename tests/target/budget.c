// Instructions, bytes and stack of the paper's plain neurons and of the monitor, on the target, over a log whose rows argv[1] holds as
// floats. One `name value` a line.
#include <math.h>
#include <stdio.h>

#include "dqw_monitor.h"
#include "foc_config.h"
#include "target/count.h"
#include "target/stack.h"

typedef struct {
    uint32_t most, stack;
    uint64_t sum;
    uint32_t calls;
} cost;

static void counted(cost *c, uint32_t n)
{
    if (n > c->most) c->most = n;
    c->sum += n;
    c->calls++;
}

static void deep(cost *c, uint32_t used)
{
    if (used > c->stack) c->stack = used;
}

static float w_d[3];
static float w_q[4];
static void plain(const float x_d[], float v_d, const float x_q[], float v_q) __attribute__((noinline));
static void plain(const float x_d[], float v_d, const float x_q[], float v_q)
{
    (void)dqw_learner_step_pu(w_d, x_d, 3, v_d, 0.5f);
    (void)dqw_learner_step_pu(w_q, x_q, 4, v_q, 0.5f);
}

static dqw_monitor m;
static dqw_monitor_random lent;

// Every so often something that no good sample takes the way of.
static void spoil(dqw_sample *s, unsigned long n, bool *limited)
{
    *limited = n % 977 == 0;
    if (n % 1009 == 0) s->i_d_A = NAN;
    if (n % 1013 == 0) s->v_q_V = 1e9f;
    if (n % 5000 > 4700) s->i_d_A = s->i_q_A = s->w_m_rad_s = 1.0f;
}

int main(int argc, char *argv[])
{
    FILE *rows = argc == 2 ? fopen(argv[1], "rb") : NULL;
    dqw_monitor_random_init(&lent);
    if (rows == NULL || dqw_monitor_init(&m, &CONFIG, &lent) != DQW_OK) return 2;
    cost paper = {0};
    cost step = {0};
    cost background = {0};
    float x[6];
    unsigned long n = 0;
    while (fread(x, sizeof x, 1, rows) == 1) {
        dqw_sample s = dqw_sample_from_dq(x[0], x[1], x[2], x[3], x[4], x[5]);
        dqw_monitor_event event;
        bool limited = false;
        const float x_d[] = {s.i_d_A, 0.1f * s.i_q_A, s.w_m_rad_s * s.i_q_A * 0.01f};
        const float x_q[] = {s.i_q_A, 0.1f * s.i_d_A, s.w_m_rad_s * s.i_d_A * 0.01f, 0.01f * s.w_m_rad_s};
        if (n % 10 == 0) {
            count_start();
            plain(x_d, s.v_d_V, x_q, s.v_q_V);
            counted(&paper, count_stop());
        }
        if (n > 40000) spoil(&s, n, &limited);
        if (n % 17 == 0) {
            stack_paint();
            (void)dqw_monitor_sample(&m, &s, limited);
            deep(&step, stack_used());
        } else {
            count_start();
            (void)dqw_monitor_sample(&m, &s, limited);
            counted(&step, count_stop());
        }
        const bool waits = m.tracker.pending;
        if (waits && n % 3 == 0) {
            stack_paint();
            (void)dqw_monitor_background(&m, &event);
            deep(&background, stack_used());
        } else if (waits) {
            count_start();
            (void)dqw_monitor_background(&m, &event);
            counted(&background, count_stop());
        }
        if (dqw_monitor_stage(&m) == DQW_STAGE_DOMAIN) {
            dqw_monitor_random_init(&lent);
            (void)dqw_monitor_define(&m, &CONFIG, &lent);
        }
        n++;
    }
    printf("plain_worst %lu\n", (unsigned long)paper.most);
    printf("step_worst %lu\n", (unsigned long)step.most);
    printf("step_mean %lu\n", (unsigned long)(step.sum / step.calls));
    printf("step_stack %lu\n", (unsigned long)step.stack);
    printf("background_worst %lu\n", (unsigned long)background.most);
    printf("background_mean %lu\n", (unsigned long)(background.sum / background.calls));
    printf("background_stack %lu\n", (unsigned long)background.stack);
    printf("state_bytes %u\n", (unsigned)sizeof m);
    printf("lent_bytes %u\n", (unsigned)sizeof lent);
    return 0;
}
