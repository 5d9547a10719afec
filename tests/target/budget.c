// Instructions, bytes and stack of the paper's plain neurons and of the monitor, on the target, over a log whose rows
// argv[1] holds as floats. One `name value` a line.
#include <math.h>
#include <stdio.h>

#include "dqw_estimator_random.h"
#include "dqw_learner.h"
#include "dqw_monitor.h"
#include "foc_config.h"
#include "target/count.h"
#include "target/foc_rows.h"
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
static dqw_monitor_config config;
static dqw_estimator_random lent;

// Every so often something that no good sample takes the way of.
static void spoil(dqw_sample *s, unsigned long n, bool *limited)
{
    *limited = n % 977 == 0;
    if (n % 1009 == 0) s->i_d_A = NAN;
    if (n % 1013 == 0) s->v_q_V = 1e9f;
    if (n % 5000 > 4700) s->i_d_A = s->i_q_A = s->w_m_rad_s = 1.0f;
}

static void sample(cost *c, unsigned long n, const dqw_sample *s, bool limited)
{
    if (n % 17 == 0) {
        stack_paint();
        (void)dqw_monitor_sample(&m, s, limited);
        deep(c, stack_used());
    } else {
        count_start();
        (void)dqw_monitor_sample(&m, s, limited);
        counted(c, count_stop());
    }
}

static void background(cost *c, unsigned long n)
{
    dqw_monitor_change change;
    bool told;
    if (n % 3 == 0) {
        stack_paint();
        told = dqw_monitor_background(&m);
        deep(c, stack_used());
    } else {
        count_start();
        told = dqw_monitor_background(&m);
        counted(c, count_stop());
    }
    if (told) (void)dqw_monitor_event(&m, &change);
    if (dqw_monitor_stage(&m) != DQW_STAGE_DOMAIN) return;
    dqw_estimator_random_init(&lent);
    (void)dqw_monitor_define(&m, &config);
}

static void neurons(cost *c, const foc_row *r)
{
    const float x_d[] = {r->i_d_A, 0.1f * r->i_q_A, r->w_m_rad_s * r->i_q_A * 0.01f};
    const float x_q[] = {r->i_q_A, 0.1f * r->i_d_A, r->w_m_rad_s * r->i_d_A * 0.01f, 0.01f * r->w_m_rad_s};
    count_start();
    plain(x_d, r->v_d_V, x_q, r->v_q_V);
    counted(c, count_stop());
}

int main(int argc, char *argv[])
{
    static foc_rows rows;
    config = CONFIG;
    config.estimator.random = &lent;
    dqw_estimator_random_init(&lent);
    cost start = {0};
    stack_paint();
    (void)dqw_monitor_init(&m, &config);
    deep(&start, stack_used());
    stack_paint();
    (void)dqw_monitor_define(&m, &config);
    deep(&start, stack_used());
    dqw_estimator_random_init(&lent);
    if (argc != 2 || !foc_rows_begin(&rows, fopen(argv[1], "rb"), 0) || dqw_monitor_init(&m, &config) != DQW_OK)
        return 2;
    cost paper = {0};
    cost make = {0};
    cost step = {0};
    cost slow = {0};
    board_signals b;
    for (unsigned long n = 0; foc_rows_next(&rows, &b); n++) {
        bool limited = false;
        if (n % 10 == 0) neurons(&paper, &rows.now);
        count_start();
        dqw_sample s = dqw_sample_from_alphabeta(b.v_alpha_V, b.v_beta_V, b.i_alpha_A, b.i_beta_A, b.w_m_rad_s,
                                                 b.cosine, b.sine);
        counted(&make, count_stop());
        if (n > 60000) spoil(&s, n, &limited);
        sample(&step, n, &s, limited);
        if (m.estimator.window.over.pending) background(&slow, n);
    }
    printf("plain_worst %lu\n", (unsigned long)paper.most);
    printf("make_worst %lu\n", (unsigned long)make.most);
    printf("step_worst %lu\n", (unsigned long)step.most);
    printf("step_mean %lu\n", (unsigned long)(step.sum / step.calls));
    printf("step_stack %lu\n", (unsigned long)step.stack);
    printf("background_worst %lu\n", (unsigned long)slow.most);
    printf("background_mean %lu\n", (unsigned long)(slow.sum / slow.calls));
    printf("background_stack %lu\n", (unsigned long)slow.stack);
    printf("start_stack %lu\n", (unsigned long)start.stack);
    printf("state_bytes %u\n", (unsigned)sizeof m);
    printf("stored_bytes %u\n", (unsigned)sizeof(dqw_monitor_stored));
    printf("lent_bytes %u\n", (unsigned)sizeof lent);
    return 0;
}
