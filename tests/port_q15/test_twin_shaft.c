// The shaft in fixed point beside the float one over simulated logs: the whole trajectory, every effect of the shaft,
// what is skipped, late backgrounds; and the laws of the effects over every speed.
// First: it asks for the registers of a signal.
#include "preempt.h"

#include "dqw_effect_kind.h"
#include "dqw_number.h"
#include "dqw_shaft.h"
#include "dqw_shaft_q15.h"
#include "dqw_test.h"
#include "sim_log.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { HALF = 25, VALUES = DQW_SHAFT_Q15_INPUTS, LIST = 6 };
#define ONE 32768.0

// A log and its full scales.
typedef struct shaft {
    dqw_sim_row *rows;
    size_t count;
    dqw_shaft_scale scale;
    double torque_Nm, w_rad_s, truth[3];
} shaft;

static shaft coast, rough;

static void set_scale(shaft *d)
{
    d->scale.torque_full_uNm = (uint32_t)ceil(1.01e6 * d->torque_Nm);
    d->scale.w_full_mrad_s = (uint32_t)ceil(1.01e3 * d->w_rad_s);
    d->scale.dt_ns = (uint32_t)lrint(1e9 * (d->rows[1].t_s - d->rows[0].t_s));
}

static shaft driven(const char *scenario)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find(scenario);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "noise", "0"));
    s.duration_s = 5;
    shaft d = {.truth = {s.machine.J_kgm2, s.machine.B_Nms_rad, s.machine.coulomb_Nm}};
    d.rows = simulate(&s);
    d.count = count;
    for (size_t k = 0; k < d.count; k++) {
        d.torque_Nm = fmax(d.torque_Nm, fabs(d.rows[k].torque_Nm));
        d.w_rad_s = fmax(d.w_rad_s, fabs(d.rows[k].w_m_rad_s));
    }
    set_scale(&d);
    return d;
}

static int16_t q15(double x, double full)
{
    return (int16_t)fmax(-32768.0, fmin(32767.0, floor(x / full * ONE + 0.5)));
}
static uint16_t turn(double angle_rad)
{
    return (uint16_t)((uint32_t)(int32_t)lrint(remainder(angle_rad, 2 * PI) / (2 * PI) * 65536.0) & 65535u);
}

static dqw_shaft_q15_config config_of(const shaft *d)
{
    const dqw_shaft_q15_config c = {.scale = d->scale, .half_window = HALF, .solve_blocks = 1};
    return c;
}

static dqw_shaft_q15 begin(const dqw_shaft_q15_config *c)
{
    dqw_shaft_q15 m;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_shaft_init_q15(&m, c));
    return m;
}

static uint32_t step(dqw_shaft_q15 *m, const dqw_sim_row *r, bool saturated)
{
    const dqw_shaft_scale *s = &m->config->scale;
    return dqw_shaft_sample_q15(m, q15(r->torque_Nm, 1e-6 * s->torque_full_uNm),
                                q15(r->w_m_rad_s, 1e-3 * s->w_full_mrad_s), turn(r->theta_m_rad), saturated);
}

static double unit_of(const dqw_shaft_scale *s, int i)
{
    const double torque = 1e-6 * s->torque_full_uNm;
    const double w = 1e-3 * s->w_full_mrad_s;
    return i == DQW_J ? torque * 1e-9 * s->dt_ns / w : i == DQW_B ? torque / w : torque;
}

// All readings in the order of the weights, Q40.
typedef struct readings {
    int64_t value[VALUES], sd[VALUES];
    uint32_t known;  // a quarter, as of effects
} readings;

static readings read_all(const dqw_shaft_q15 *m)
{
    readings r = {.known = 0};
    for (int i = 0; i < DQW_SHAFT_PARAMETERS; i++) {
        const dqw_reading_q15 one = dqw_shaft_read_q15(m, (enum dqw_shaft_parameter)i);
        r.value[i] = one.value_q40;
        r.sd[i] = one.sd_q40;
        r.known |= (uint32_t)(one.sd_q40 < one.value_q40 / 4) << i;
    }
    int at = DQW_SHAFT_PARAMETERS;
    for (int k = 0; k < m->effect_count; k++) {
        r.known |= (uint32_t)dqw_shaft_read_effect_q15(m, k, r.value + at, r.sd + at) << at;
        at += dqw_effect_weights((enum dqw_effect_name)m->effect[k].effect);
    }
    return r;
}

static double value(const dqw_shaft_q15 *m, int i)
{
    return ldexp((double)read_all(m).value[i], -40) * unit_of(&m->config->scale, i);
}

static double deviation(const dqw_shaft_q15 *m, int i)
{
    const int64_t sd_q40 = read_all(m).sd[i];
    return sd_q40 == INT64_MAX ? INFINITY : ldexp((double)sd_q40, -40) * unit_of(&m->config->scale, i);
}

// What the float twin read, in the same order.
static void read_float(const dqw_shaft *g, int effects, double v[VALUES], double sd[VALUES], uint32_t *known)
{
    *known = 0;
    int at = 0;
    for (; at < DQW_SHAFT_PARAMETERS; at++) {
        const dqw_reading r = dqw_shaft_read(g, (enum dqw_shaft_parameter)at);
        v[at] = r.value, sd[at] = r.sd;
        *known |= (uint32_t)(r.sd < 0.25f * r.value) << at;
    }
    for (int k = 0; k < effects; k++) {
        float w[2];
        float s[2];
        *known |= (uint32_t)dqw_shaft_read_effect(g, k, w, s) << at;
        for (int i = 0; i < dqw_effect_weights(g->config->effects[k].effect); i++, at++) v[at] = w[i], sd[at] = s[i];
    }
}

// An effect of both twins.
static void add_effect(enum dqw_effect_name name, double first, double second, dqw_effect_config *f,
                       dqw_torque_q15_config *q)
{
    *f = (dqw_effect_config){.effect = name, .shape = {(float)first, (float)second}};
    *q = (dqw_torque_q15_config){.effect = name,
                                 .width_urad_s = (uint32_t)lrint(1e6 * first),
                                 .fall_urad_s = (uint32_t)lrint(1e6 * second),
                                 .periods = (uint16_t)lrint(first)};
}

typedef struct setup {
    const char *name;
    const shaft *log;
    double noise;
    bool coulomb, effects;  // effects: all five of the shaft
    double width_rad_s, standstill_rad_s;
    uint32_t known;         // at the end
    double most, apart_sd;  // measured
} setup;

// Largest difference of a known value at every 20th block, in percent, and of a deviation at the end.
static void trajectory(const setup *s, double *most, double *apart_sd)
{
    shaft d = *s->log;
    dqw_effect_config list[LIST];
    dqw_torque_q15_config list_q15[LIST];
    int effects = 0;
    if (s->effects) {
        add_effect(DQW_EFFECT_COULOMB_FRICTION, 1, 0, &list[0], &list_q15[0]);
        add_effect(DQW_EFFECT_DIRECTION_ASYMMETRY, 1, 0, &list[1], &list_q15[1]);
        add_effect(DQW_EFFECT_STRIBECK_FRICTION, 1, 8, &list[2], &list_q15[2]);
        add_effect(DQW_EFFECT_COGGING_TORQUE, 12, 0, &list[3], &list_q15[3]);
        add_effect(DQW_EFFECT_LOAD_TORQUE, 0, 0, &list[4], &list_q15[4]);
        effects = 5;
    }
    // Noise of sensors beyond the largest signal needs a larger scale.
    d.torque_Nm *= 1 + 3 * s->noise;
    d.w_rad_s *= 1 + 3 * s->noise;
    set_scale(&d);
    dqw_shaft_q15_config c = config_of(&d);
    c.coulomb = s->coulomb;
    c.coulomb_width_urad_s = (uint32_t)lrint(1e6 * s->width_rad_s);
    c.standstill_urad_s = (uint32_t)lrint(1e6 * s->standstill_rad_s);
    c.effects = list_q15;
    c.effect_count = (uint8_t)effects;
    const dqw_shaft_config f = {.dt_s = 1e-9f * (float)d.scale.dt_ns,
                                .torque_base_Nm = (float)d.torque_Nm,
                                .w_base_rad_s = (float)d.w_rad_s,
                                .half_window = HALF,
                                .coulomb = s->coulomb,
                                .coulomb_width_rad_s = (float)s->width_rad_s,
                                .standstill_rad_s = (float)s->standstill_rad_s,
                                .effects = list,
                                .effect_count = (uint8_t)effects};
    dqw_shaft_q15 m = begin(&c);
    dqw_shaft g;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_shaft_init(&g, &f));
    double v[VALUES] = {0};
    double sd[VALUES] = {0};
    uint32_t known = 0;
    int blocks = 0;
    test_random random = {77};
    *most = 0.0;
    for (size_t k = 0; k < d.count; k++) {
        dqw_sim_row r = d.rows[k];
        r.torque_Nm += 0.5 * s->noise * s->log->torque_Nm * random_normal(&random);
        r.w_m_rad_s += 0.5 * s->noise * s->log->w_rad_s * random_normal(&random);
        const uint32_t one = dqw_shaft_sample(&g, (float)r.torque_Nm, (float)r.w_m_rad_s,
                                              (float)remainder(r.theta_m_rad, 2 * PI), false);
        TEST_ASSERT_EQUAL_UINT32(one, step(&m, &r, false));
        const bool learned = dqw_shaft_background(&g);
        TEST_ASSERT_EQUAL(learned, dqw_shaft_background_q15(&m));
        if (!learned || ++blocks % 20 != 0) continue;
        read_float(&g, effects, v, sd, &known);
        const readings q = read_all(&m);
        CASE("%s, block %d: known %x, %x", s->name, blocks, (unsigned)known, (unsigned)q.known);
        if (blocks >= 60) HOLDS(known == q.known);
        for (int i = 0; i < VALUES; i++) {
            if ((known >> i & q.known >> i & 1u) == 0) continue;
            // A small weight of a large effect is as good as the large one.
            const double size = i == 6 || i == 7 ? hypot(v[6], v[7]) : fabs(v[i]);
            const double apart = 100.0 * fabs(value(&m, i) - v[i]) / size;
            if (apart > *most) *most = apart;
        }
    }
    *apart_sd = 0.0;
    for (int i = 0; i < VALUES; i++)
        if ((known >> i & 1u) != 0) *apart_sd = fmax(*apart_sd, 100.0 * fabs(deviation(&m, i) / sd[i] - 1.0));
    HOLDS(known == s->known);
    TEST_ASSERT_EQUAL_UINT32(0, m.missed);
    TEST_ASSERT_EQUAL_UINT32(0, m.gate.saturated);
    BETWEEN(190, blocks, 200);
}

static void test_the_whole_trajectory(void)
{
    // A value before much is learned; a deviation by the likeness of blocks, which the float twin counts from the first
    // block on.
    const setup logs[] = {
        {.name = "J and B", .log = &coast, .known = 3, .most = 0.0032, .apart_sd = 9.5},
        {.name = "friction", .log = &coast, .coulomb = true, .known = 7, .most = 0.036, .apart_sd = 8.9},
        {.name = "soft friction",
         .log = &coast,
         .coulomb = true,
         .width_rad_s = 1,
         .known = 7,
         .most = 0.037,
         .apart_sd = 8.9},
        {.name = "friction, standstill, noise of 1 %",
         .log = &coast,
         .noise = 0.01,
         .coulomb = true,
         .width_rad_s = 1,
         .standstill_rad_s = 0.5,
         .known = 7,
         .most = 0.011,
         .apart_sd = 5.2},
        {.name = "J and B, noise of 20 %", .log = &coast, .noise = 0.2, .known = 3, .most = 0.0030, .apart_sd = 4.0},
        {.name = "five effects", .log = &rough, .effects = true, .known = 0xfb, .most = 0.19, .apart_sd = 19},
        {.name = "five effects, noise of 1 %",
         .log = &rough,
         .noise = 0.01,
         .effects = true,
         .known = 0xeb,
         .most = 0.091,
         .apart_sd = 15},
    };
    for (unsigned n = 0; n < sizeof logs / sizeof logs[0]; n++) {
        double most;
        double apart_sd;
        trajectory(&logs[n], &most, &apart_sd);
        CASE("%s", logs[n].name);
        BETWEEN(0.4 * logs[n].most, most, 2.5 * logs[n].most);
        BETWEEN(0.5 * logs[n].apart_sd, apart_sd, 2 * logs[n].apart_sd);
    }
}

// So many blocks that each of the intervals below ends with a solution.
enum { WHOLE = 192 };

static dqw_shaft_q15 learned(const dqw_shaft_q15_config *c)
{
    dqw_shaft_q15 m = begin(c);
    for (size_t k = 0; k < coast.count && m.gate.blocks < WHOLE; k++) {
        (void)step(&m, &coast.rows[k], false);
        (void)dqw_shaft_background_q15(&m);
    }
    TEST_ASSERT_EQUAL_UINT32(WHOLE, m.gate.blocks);
    return m;
}

static dqw_shaft_q15_config frictional(void)
{
    dqw_shaft_q15_config c = config_of(&coast);
    c.coulomb = true;
    c.coulomb_width_urad_s = 1000000;
    return c;
}

// From what the whole log says, percent of the value that is farthest from it.
static double worst(const dqw_shaft_q15 *m)
{
    const dqw_shaft_q15_config c = frictional();
    const dqw_shaft_q15 whole = learned(&c);
    double off = 0.0;
    for (int i = 0; i < 3; i++) off = fmax(off, 100.0 * fabs(value(m, i) / value(&whole, i) - 1.0));
    return off;
}

static void test_start_values_and_readings_are_irrelevant(void)
{
    static const uint8_t every[] = {0, 1, 16, 64};
    for (int n = 0; n < 4; n++)
        for (int start = 0; start < 3; start++) {
            CASE("solved every %d blocks, start %d", every[n], start);
            dqw_shaft_q15_config c = frictional();
            c.solve_blocks = every[n];
            c.J_gmm2 = (uint32_t)(1e9 * 0.65 * start * coast.truth[0]);
            c.B_nNms_rad = (uint32_t)(1e9 * 0.65 * start * coast.truth[1]);
            const dqw_shaft_q15 m = learned(&c);
            HOLDS(read_all(&m).known == 7u);
            BETWEEN(start == 0 && every[n] == 1 ? 0.0 : 1e-6, worst(&m), 0.02);  // 0.0001 to 0.005
        }
    // Before anything is learned a value is where it starts, and not known.
    dqw_shaft_q15_config c = frictional();
    c.J_gmm2 = 2000000;
    c.B_nNms_rad = 1000000;
    dqw_shaft_q15 m = begin(&c);
    BETWEEN(1.998e-3, value(&m, DQW_J), 2.002e-3);
    BETWEEN(0.999e-3, value(&m, DQW_B), 1.001e-3);
    TEST_ASSERT_EQUAL_UINT32(0, read_all(&m).known);
}

static void test_saturated_samples_are_counted_and_not_learned(void)
{
    const dqw_shaft_q15_config c = frictional();
    dqw_shaft_q15 given = begin(&c);
    dqw_shaft_q15 seen = begin(&c);
    static const int16_t ends[] = {32767, -32767, -32768};
    uint32_t bad = 0;
    for (size_t k = 0; k < coast.count; k++) {
        const dqw_sim_row *r = &coast.rows[k];
        const bool now = k % 40 == 17;
        (void)step(&given, r, now);
        (void)dqw_shaft_background_q15(&given);
        int16_t torque = q15(r->torque_Nm, 1e-6 * c.scale.torque_full_uNm);
        int16_t w = q15(r->w_m_rad_s, 1e-3 * c.scale.w_full_mrad_s);
        if (now) *(bad % 2 ? &torque : &w) = ends[bad % 3];
        const uint32_t event = dqw_shaft_sample_q15(&seen, torque, w, 0, false);
        TEST_ASSERT_EQUAL_INT(now, (event & DQW_EVENT_SATURATED) != 0);
        (void)dqw_shaft_background_q15(&seen);
        bad += now;
    }
    TEST_ASSERT_EQUAL_UINT32(bad, given.gate.saturated);
    TEST_ASSERT_EQUAL_UINT32(bad, seen.gate.saturated);
    TEST_ASSERT_EQUAL_UINT32(coast.count - bad, seen.gate.accepted);
    TEST_ASSERT_EQUAL_MEMORY(given.w_q40, seen.w_q40, sizeof seen.w_q40);
    TEST_ASSERT_EQUAL_MEMORY(given.sd_q40, seen.sd_q40, sizeof seen.sd_q40);
    BETWEEN(0.01, worst(&seen), 0.5);
}

// Across a gap nothing is paired. Without the word about it the torque of one stretch meets the speed of another.
static void test_a_gap(void)
{
    const dqw_shaft_q15_config c = frictional();
    double off[2];
    for (int say = 0; say < 2; say++) {
        dqw_shaft_q15 m = begin(&c);
        for (size_t k = 0; k < coast.count; k++) {
            if (k % 200 == 110) {
                k += 90;
                if (say) dqw_shaft_missing_q15(&m, 0);
            }
            if (k >= coast.count) break;
            (void)step(&m, &coast.rows[k], false);
            (void)dqw_shaft_background_q15(&m);
        }
        off[say] = worst(&m);
    }
    BETWEEN(50.0, off[0], 200.0);  // 94
    BETWEEN(0.5, off[1], 3.0);     // 1.6: half of the rows
}

// A background that leaves every fourth half out loses the next one, says so, and learns the others as they are: those
// that follow each other.
static void test_a_late_background_is_counted(void)
{
    const dqw_shaft_q15_config c = frictional();
    dqw_shaft_q15 m = begin(&c);
    int said = 0;
    int blocks = 0;
    uint32_t missed = 0;
    for (size_t k = 0; k < coast.count; k++) {
        const uint32_t event = step(&m, &coast.rows[k], false);
        missed += (event & DQW_EVENT_MISSED) != 0;
        if ((event & (DQW_EVENT_BLOCK | DQW_EVENT_MISSED)) == 0) continue;
        if (++said % 4 != 0) blocks += dqw_shaft_background_q15(&m);
    }
    TEST_ASSERT_EQUAL_INT((said - 1) / 4, missed);
    TEST_ASSERT_EQUAL_UINT32(missed, m.missed);
    BETWEEN(said / 2 - 1, blocks, said / 2 + 1);
    BETWEEN(0.7, worst(&m), 5.0);
    m.missed = UINT32_MAX;
    for (size_t k = 0; k < (size_t)5 * HALF; k++) (void)step(&m, &coast.rows[k], false);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, m.missed);
}

static dqw_shaft_q15 held;
static size_t held_at;

static void half_more(void)
{
    for (size_t k = held_at; k < held_at + HALF; k++) (void)step(&held, &rough.rows[k], false);
}
static void learn_held(void) { (void)dqw_shaft_background_q15(&held); }

// Samples of half a block come after any one instruction of the background: what is learned is what would be learned
// had they come before it, where the block that they bring is lost, or else behind it; to the bit.
static void test_samples_may_interrupt_the_background_anywhere(void)
{
    dqw_effect_config list[2];
    dqw_torque_q15_config list_q15[2];
    add_effect(DQW_EFFECT_STRIBECK_FRICTION, 1, 8, &list[0], &list_q15[0]);
    add_effect(DQW_EFFECT_COGGING_TORQUE, 12, 0, &list[1], &list_q15[1]);
    dqw_shaft_q15_config c = config_of(&rough);
    c.coulomb = true;
    c.coulomb_width_urad_s = 1000000;
    c.effects = list_q15;
    c.effect_count = 2;
    static dqw_shaft_q15 start;
    static dqw_shaft_q15 behind;
    static dqw_shaft_q15 before;
    start = begin(&c);
    for (held_at = 0; held_at < (size_t)40 * HALF || !start.window.over.pending; held_at++) {
        (void)dqw_shaft_background_q15(&start);
        (void)step(&start, &rough.rows[held_at], false);
    }
    memcpy(&held, &start, sizeof held);
    learn_held(), half_more(), learn_held();
    memcpy(&behind, &held, sizeof held);
    memcpy(&held, &start, sizeof held);
    half_more(), learn_held(), learn_held();
    memcpy(&before, &held, sizeof held);
    TEST_ASSERT_EQUAL_UINT32(1, before.missed);
    TEST_ASSERT_EQUAL_UINT32(before.gate.blocks + 1, behind.gate.blocks);
#if PREEMPT_HERE
    int places[2] = {0};
    for (long at = 0;; at += at < 300 ? 1 : at / 6) {
        CASE("after instruction %ld", at);
        memcpy(&held, &start, sizeof held);
        const bool came = preempt_run(at, learn_held, half_more);
        if (!came) break;
        learn_held();
        const bool lost = held.missed != 0;
        places[lost]++;
        HOLDS(lost == (places[0] == 0));
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(lost ? &before : &behind, &held, sizeof held, test_case);
    }
    BETWEEN(20, places[1], 3000);
    BETWEEN(20, places[0], 3000);
#endif
}

// One sample that did not come is one that was refused; of more nobody knows what lies between.
static void test_missing_samples(void)
{
    const dqw_shaft_q15_config c = frictional();
    dqw_shaft_q15 none = begin(&c);
    dqw_shaft_q15 bad;
    memcpy(&bad, &none, sizeof bad);
    uint32_t lost = 0;
    for (size_t k = 0; k < (size_t)20 * HALF; k++) {
        const bool here = k % 17 != 3;
        lost += !here;
        if (here)
            (void)step(&none, &coast.rows[k], false);
        else
            dqw_shaft_missing_q15(&none, 1);
        (void)step(&bad, &coast.rows[k], !here);
        TEST_ASSERT_EQUAL_INT(dqw_shaft_background_q15(&bad), dqw_shaft_background_q15(&none));
    }
    TEST_ASSERT_EQUAL_UINT32(lost, none.gate.nonfinite);
    TEST_ASSERT_EQUAL_UINT32(lost, bad.gate.saturated);
    TEST_ASSERT_EQUAL_UINT32(bad.gate.accepted, none.gate.accepted);
    TEST_ASSERT_EQUAL_MEMORY(&bad.window, &none.window, sizeof none.window);
    TEST_ASSERT_EQUAL_MEMORY(bad.w_q40, none.w_q40, sizeof none.w_q40);
    TEST_ASSERT_TRUE(none.gate.blocks > 10);
    for (uint32_t periods = 0; periods < 4; periods++) {
        CASE("%u periods", (unsigned)periods);
        for (int k = 0; k < 2 * HALF + 3; k++) {
            (void)step(&none, &coast.rows[k], false);
            (void)dqw_shaft_background_q15(&none);
        }
        dqw_shaft_missing_q15(&none, periods);
        HOLDS((none.window.at == 0) == (periods != 1) && none.window.over.follows == (periods == 1) && !none.has_last);
    }
}

static void test_read_before_anything_was_learned(void)
{
    const dqw_torque_q15_config list[] = {
        {.effect = DQW_EFFECT_COULOMB_FRICTION, .width_urad_s = 1000000, .start_uNm = {500000}},
        {.effect = DQW_EFFECT_COGGING_TORQUE, .periods = 6, .start_uNm = {-250000, 125000}}};
    dqw_shaft_q15_config c = config_of(&coast);
    c.B_nNms_rad = 1000000;
    c.effects = list;
    c.effect_count = 2;
    dqw_shaft_q15 m = begin(&c);
    TEST_ASSERT_FALSE(dqw_shaft_background_q15(&m));
    for (int i = -1; i < 5; i++) {
        CASE("parameter %d", i);
        const dqw_reading_q15 r = dqw_shaft_read_q15(&m, (enum dqw_shaft_parameter)i);
        HOLDS((r.value_q40 != 0) == (i == DQW_B) && r.sd_q40 == INT64_MAX && r.sd_change_q40 == INT64_MAX && !r.usable);
    }
    BETWEEN(0.9999e-3, value(&m, DQW_B), 1.0001e-3);
    int64_t w[2];
    int64_t sd[2];
    TEST_ASSERT_EQUAL_INT(0, dqw_shaft_read_effect_q15(&m, 1, w, sd));
    const double torque = 1e-6 * c.scale.torque_full_uNm;
    BETWEEN(-0.2501, ldexp((double)w[0], -40) * torque, -0.2499);
    BETWEEN(0.1249, ldexp((double)w[1], -40) * torque, 0.1251);
    HOLDS(sd[0] == INT64_MAX && sd[1] == INT64_MAX);
    TEST_ASSERT_EQUAL_INT(0, dqw_shaft_read_effect_q15(&m, 0, w, sd));
    BETWEEN(0.4999, ldexp((double)w[0], -40) * torque, 0.5001);
    TEST_ASSERT_EQUAL_INT(DQW_ERR_SIZE, dqw_shaft_read_effect_q15(&m, 2, w, sd));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_SIZE, dqw_shaft_read_effect_q15(&m, -1, w, sd));
}

// The variance of a start is 10^6: a weight was learned where it fell to a hundredth, so at information of 99e-6. By
// default blocks 1, 2, 4, 8 and each fourth are read.
static void test_the_threshold_of_learned(void)
{
    for (int every = 0; every < 2; every++) {
        dqw_shaft_q15_config c = {.scale = {1000000, 1000000, 1000000}, .solve_blocks = (uint8_t)every};
        dqw_shaft_q15 m = begin(&c);
        int solutions = 0;
        int64_t last = 0;
        for (int k = 0; k < 34 * HALF; k++) {
            // Information 9.69e-6 a block.
            (void)dqw_shaft_sample_q15(&m, 51, 102, 0, false);
            if (!dqw_shaft_background_q15(&m)) continue;
            const uint32_t blocks = m.gate.blocks;
            CASE("solved every %d, %u blocks", every, (unsigned)blocks);
            HOLDS(m.excited == 1u << DQW_B);
            HOLDS((dqw_shaft_read_q15(&m, DQW_B).sd_q40 != INT64_MAX) == (blocks >= (every == 1 ? 11u : 12u)));
            HOLDS(dqw_shaft_read_q15(&m, DQW_J).sd_q40 == INT64_MAX);
            solutions += m.w_q40[DQW_B] != last;
            last = m.w_q40[DQW_B];
        }
        HOLDS(m.gate.blocks == 33);
        BETWEEN(0.495e-3, value(&m, DQW_B), 0.5e-3);
        TEST_ASSERT_EQUAL_INT(every == 1 ? 33 : 10, solutions);
    }
}

// Where the weights explain all, a deviation is that of a residual of 2^-13.5 of the torque, and of last places.
static void test_a_residual_of_nothing(void)
{
    const dqw_shaft_q15_config c = {.scale = {1000000, 1000000, 1000000}, .solve_blocks = 1};
    dqw_shaft_q15 m = begin(&c);
    static const int16_t torques[] = {51, 30000};
    for (int n = 0; n < 2; n++) {
        for (int k = 0; k < 40 * HALF; k++) {
            (void)dqw_shaft_sample_q15(&m, torques[n], 20000, 0, false);
            // Less than nothing is left.
            m.normal.c_q32 = -((int64_t)1 << 40);
            m.lag_q56 = m.error_last_q28 = 0;
            (void)dqw_shaft_background_q15(&m);
        }
        dqw_solution_q15 s;
        dqw_normal_solve_q15(&m.normal, m.start_q40, &s);
        const double floor = ldexp((double)m.target_q56, -56 - 27) + ldexp(8, -56);
        CASE("torque %d", torques[n]);
        BETWEEN(0.99, ldexp((double)m.sd_q40[DQW_B], -40) / sqrt(floor * ldexp((double)s.cov_q40[DQW_B], -40)), 1.01);
    }
}

static void test_what_is_usable(void)
{
    const dqw_shaft_q15_config c = frictional();
    dqw_shaft_q15 m = learned(&c);
    for (int i = 0; i < DQW_SHAFT_PARAMETERS; i++) HOLDS(dqw_shaft_read_q15(&m, (enum dqw_shaft_parameter)i).usable);
    const int64_t least_q40 = 30 * m.sd_q40[DQW_J];
    const int64_t weight_q40[] = {least_q40 + least_q40 / 1000, least_q40 - least_q40 / 1000, 0, -2 * least_q40};
    for (int k = 0; k < 4; k++) {
        CASE("%d", k);
        m.w_q40[DQW_J] = weight_q40[k];
        HOLDS(dqw_shaft_read_q15(&m, DQW_J).usable == (k == 0));
    }
}

static void test_a_configuration_from_a_nameplate(void)
{
    const struct {
        uint32_t dt_ns;
        int half;
    } sampled[] = {{1000000, 25}, {100000, 100}, {600000, 42}, {4000000, 10}, {1000000000, 10}, {1, 100}};
    dqw_shaft_q15 m;
    for (int k = 0; k < 6; k++) {
        CASE("period %u ns", (unsigned)sampled[k].dt_ns);
        const dqw_shaft_q15_nameplate plate = {sampled[k].dt_ns, 1000001, 150000};
        const dqw_shaft_q15_config c = dqw_shaft_config_default_q15(&plate);
        HOLDS(c.half_window == sampled[k].half && c.coulomb && c.coulomb_width_urad_s == 1500000 &&
              c.effect_count == 0 && c.J_gmm2 == 0);
        HOLDS(c.scale.torque_full_uNm == 3000003 && c.scale.w_full_mrad_s == 225000 &&
              c.scale.dt_ns == sampled[k].dt_ns);
        HOLDS(dqw_shaft_init_q15(&m, &c) == DQW_OK);
    }
    // As far as there is room; what is too large is refused.
    const dqw_shaft_q15_nameplate large = {1000000, 2000000000, 9000000};
    const dqw_shaft_q15_config c = dqw_shaft_config_default_q15(&large);
    HOLDS(c.scale.torque_full_uNm == DQW_SHAFT_TORQUE_MAX && c.scale.w_full_mrad_s == DQW_SCALE_MAX &&
          dqw_shaft_init_q15(&m, &c) == DQW_OK);
    const dqw_shaft_q15_nameplate bad[] = {{0, 1, 1000}, {1000000001, 1, 1000}, {1, 0, 1000}, {1, 4000000001, 1000},
                                           {1, 1, 0},    {1, 1, 10000001}};
    static const int refused[] = {DQW_ERR_DT,          DQW_ERR_DT,     DQW_ERR_TORQUE_BASE,
                                  DQW_ERR_TORQUE_BASE, DQW_ERR_W_BASE, DQW_ERR_W_BASE};
    for (int k = 0; k < 6; k++) {
        CASE("bad %d", k);
        const dqw_shaft_q15_config d = dqw_shaft_config_default_q15(&bad[k]);
        REFUSED(m, refused[k], dqw_shaft_init_q15(&m, &d));
    }
    const dqw_shaft_q15_config none = dqw_shaft_config_default_q15(NULL);
    REFUSED(m, DQW_ERR_DT, dqw_shaft_init_q15(&m, &none));
}

static void test_define_begins_anew(void)
{
    const dqw_shaft_q15_config c = frictional();
    dqw_shaft_q15 m = learned(&c);
    dqw_shaft_q15 before;
    memcpy(&before, &m, sizeof m);
    dqw_shaft_q15_config bad = c;
    bad.scale.dt_ns = 0;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_DT, dqw_shaft_define_q15(&m, &bad));
    TEST_ASSERT_EQUAL_MEMORY(&before, &m, sizeof m);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_shaft_define_q15(&m, &c));
    HOLDS(read_all(&m).known == 0 && m.gate.accepted == 0);
}

// Up to the speed of standstill, either way, friction has no direction; beyond it has one.
static void test_the_edges_of_standstill(void)
{
    const dqw_shaft_scale scale = {1500000, 150000, 1000000};
    const dqw_shaft_q15_config c = {.scale = scale, .coulomb = true, .standstill_urad_s = 1500000};
    dqw_shaft_q15 m = begin(&c);
    const int edge = (int)lrint(32768 * 1.5 / 150);
    for (int sign = -1; sign <= 1; sign += 2)
        for (int beyond = 0; beyond < 2; beyond++) {
            CASE("sign %d, beyond %d", sign, beyond);
            (void)dqw_shaft_sample_q15(&m, 0, (int16_t)(sign * (edge + beyond)), 0, false);
            HOLDS(m.direction_last_q15 == (beyond ? 32768 * sign : 0));
        }
}

static void test_what_the_signals_cannot_teach_is_not_known(void)
{
    const dqw_shaft_scale scale = {1500000, 150000, 1000000};
    for (int kind = 0; kind < 3; kind++) {
        CASE("kind %d", kind);
        const dqw_shaft_q15_config c = {.scale = scale, .coulomb = true};
        dqw_shaft_q15 m = begin(&c);
        for (int k = 0; k < 20000; k++) {
            const double w = kind == 0 ? 0.0 : kind == 1 ? 100.0 : 50 + 49 * sin(0.01 * k);
            const double slope = kind == 2 ? 49 * 0.01 / 1e-3 * cos(0.01 * (k + 0.5)) : 0.0;
            const double t = kind == 0 ? 0.0 : 2e-3 * slope + 4e-3 * w + 0.1;
            (void)dqw_shaft_sample_q15(&m, q15(t, 1.5), q15(w, 150), 0, false);
            (void)dqw_shaft_background_q15(&m);
        }
        // At rest nothing; at one speed viscous and Coulomb friction are one; in one direction at many speeds all of
        // it.
        HOLDS(read_all(&m).known == (kind == 2 ? 7u : 0u));
        if (kind != 2) continue;
        BETWEEN(-0.01, value(&m, DQW_J) / 2e-3 - 1, 0.01);
        BETWEEN(-0.01, value(&m, DQW_B) / 4e-3 - 1, 0.01);
        BETWEEN(-0.01, value(&m, DQW_COULOMB) / 0.1 - 1, 0.01);
    }
}

// As many inputs as there is room for: none is written beyond.
static void test_a_full_shaft(void)
{
    dqw_shaft_q15_config c = frictional();
    static dqw_torque_q15_config list[DQW_EFFECT_WEIGHTS];
    for (int k = 0; k < DQW_EFFECT_WEIGHTS / 2; k++)
        list[k] = (dqw_torque_q15_config){.effect = DQW_EFFECT_COGGING_TORQUE, .periods = (uint16_t)(k + 1)};
    c.effects = list;
    c.effect_count = DQW_EFFECT_WEIGHTS / 2;
    const dqw_shaft_q15 m = begin(&c);
    TEST_ASSERT_EQUAL_UINT8(DQW_SHAFT_Q15_INPUTS, m.inputs);
    for (int i = 0; i < m.inputs; i++) HOLDS(m.sd_q40[i] == INT64_MAX);
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_shaft_q15 m;
    const dqw_shaft_q15_config good = frictional();
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_shaft_init_q15(NULL, &good));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_shaft_define_q15(NULL, &good));
    REFUSED(m, DQW_ERR_NULL, dqw_shaft_define_q15(&m, NULL));
    REFUSED(m, DQW_ERR_NULL, dqw_shaft_init_q15(&m, NULL));
    dqw_shaft_q15_config bad[12];
    for (int k = 0; k < 12; k++) bad[k] = good;
    bad[0].scale.torque_full_uNm = 0;
    bad[1].scale.torque_full_uNm = DQW_SHAFT_TORQUE_MAX + 1u;
    bad[2].scale.w_full_mrad_s = 0;
    bad[3].scale.w_full_mrad_s = DQW_SCALE_MAX + 1u;
    bad[4].scale.dt_ns = 0;
    bad[5].scale.dt_ns = 1000000001u;
    bad[6].excitation_q15 = 32767;
    bad[7].coulomb_width_urad_s = (uint32_t)(1000.0 * good.scale.w_full_mrad_s / 8200);
    bad[8].scale.w_full_mrad_s = 1000, bad[8].coulomb_width_urad_s = 16100000;
    bad[9].scale = (dqw_shaft_scale){1, DQW_SCALE_MAX, 1}, bad[9].J_gmm2 = UINT32_MAX, bad[9].coulomb_width_urad_s = 0;
    bad[10].scale = (dqw_shaft_scale){1, DQW_SCALE_MAX, 1}, bad[10].B_nNms_rad = UINT32_MAX,
    bad[10].coulomb_width_urad_s = 0;
    const dqw_shaft_scale zero = {0};
    bad[11].scale = zero;
    static const int refused[12] = {
        DQW_ERR_TORQUE_BASE, DQW_ERR_TORQUE_BASE,   DQW_ERR_W_BASE,        DQW_ERR_W_BASE, DQW_ERR_DT,   DQW_ERR_DT,
        DQW_ERR_EXCITATION,  DQW_ERR_COULOMB_WIDTH, DQW_ERR_COULOMB_WIDTH, DQW_ERR_UNIT,   DQW_ERR_UNIT, DQW_ERR_DT};
    for (int k = 0; k < 12; k++) {
        CASE("%d", k);
        REFUSED(m, refused[k], dqw_shaft_init_q15(&m, &bad[k]));
        REFUSED(m, refused[k], dqw_shaft_define_q15(&m, &bad[k]));
    }
    dqw_shaft_q15_config all_of_it = good;
    all_of_it.excitation_q15 = DQW_SCALE_MOST_Q15;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_shaft_init_q15(&m, &all_of_it));
    dqw_shaft_q15_config long_window = good;
    long_window.half_window = 101;
    REFUSED(m, DQW_ERR_HALF_WINDOW, dqw_shaft_init_q15(&m, &long_window));

    const struct {
        dqw_torque_q15_config effect;
        int status;
    } effects[] = {
        {{.effect = DQW_EFFECT_NONE}, DQW_ERR_EFFECT_NAME},
        {{.effect = DQW_EFFECT_DEAD_TIME, .width_urad_s = 1000000}, DQW_ERR_EFFECT_NAME},
        {{.effect = DQW_EFFECT_NAMES}, DQW_ERR_EFFECT_NAME},
        {{.effect = DQW_EFFECT_COULOMB_FRICTION}, DQW_ERR_EFFECT_SHAPE},
        {{.effect = DQW_EFFECT_STRIBECK_FRICTION, .width_urad_s = 1000000}, DQW_ERR_EFFECT_SHAPE},
        {{.effect = DQW_EFFECT_STRIBECK_FRICTION, .fall_urad_s = 1000000}, DQW_ERR_EFFECT_SHAPE},
        {{.effect = DQW_EFFECT_COGGING_TORQUE}, DQW_ERR_EFFECT_SHAPE},
        {{.effect = DQW_EFFECT_COGGING_TORQUE, .periods = 1001}, DQW_ERR_EFFECT_SHAPE},
        {{.effect = DQW_EFFECT_COGGING_TORQUE, .periods = 1000}, DQW_OK},
        {{.effect = DQW_EFFECT_LOAD_TORQUE, .start_uNm = {-250000}}, DQW_OK},
    };
    for (unsigned k = 0; k < sizeof effects / sizeof effects[0]; k++) {
        CASE("effect %u", k);
        dqw_torque_q15 t;
        dqw_shaft_q15_config c = good;
        c.effects = &effects[k].effect;
        c.effect_count = 1;
        if (effects[k].status == DQW_OK) {
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_shaft_init_q15(&m, &c));
            continue;
        }
        memset(&t, 0x5a, sizeof t);
        const dqw_torque_q15 before = t;
        TEST_ASSERT_LESS_THAN_INT(0, dqw_torque_init_q15(&t, &effects[k].effect, good.scale.w_full_mrad_s));
        TEST_ASSERT_EQUAL_MEMORY(&before, &t, sizeof t);
        REFUSED(m, effects[k].status, dqw_shaft_init_q15(&m, &c));
    }
    dqw_shaft_q15_config c = good;
    c.effect_count = 1;
    REFUSED(m, DQW_ERR_EFFECT_LIST, dqw_shaft_init_q15(&m, &c));
    dqw_torque_q15_config many[DQW_EFFECT_WEIGHTS + 1];
    for (int k = 0; k <= DQW_EFFECT_WEIGHTS; k++) many[k] = effects[9].effect;
    c.effects = many;
    c.effect_count = DQW_EFFECT_WEIGHTS + 1;
    REFUSED(m, DQW_ERR_EFFECT_ROOM, dqw_shaft_init_q15(&m, &c));
    c.effect_count = DQW_EFFECT_WEIGHTS;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_shaft_init_q15(&m, &c));
    // A full list learns, and touches nothing behind it.
    for (int k = 0; k < 20 * HALF; k++) {
        const int16_t x = (int16_t)(20000 * sin(0.01 * k));
        (void)dqw_shaft_sample_q15(&m, x, (int16_t)-x, (uint16_t)(300 * k), false);
        (void)dqw_shaft_background_q15(&m);
    }
    HOLDS(m.gate.blocks > 10 && m.inputs == VALUES && m.effect_count == DQW_EFFECT_WEIGHTS);
    // Starts of 2 kNm are too many of the smallest full scale.
    many[0].start_uNm[0] = INT32_MAX;
    c.scale.torque_full_uNm = 1;
    REFUSED(m, DQW_ERR_UNIT, dqw_shaft_init_q15(&m, &c));
}

// Every speed, against the laws in double.
static void test_the_laws_of_friction(void)
{
    static const uint32_t full_mrad_s[] = {1000, 312300, 10000000};
    static const double part[] = {1.01 / 8192, 1e-3, 0.02, 0.3, 1.0, 15.9};
    double most[3] = {0};
    double off[3] = {0};
    int tried[3] = {0};
    for (int f = 0; f < 3; f++)
        for (int p = 0; p < 6; p++) {
            const double full = 1e-3 * full_mrad_s[f];
            const double width = part[p] * full;
            const double fall = part[(p + 4) % 6] * full;
            if (width > 4000 || fall > 4000) continue;
            const dqw_torque_q15_config c[] = {
                {.effect = DQW_EFFECT_COULOMB_FRICTION, .width_urad_s = (uint32_t)lrint(1e6 * width)},
                {.effect = DQW_EFFECT_DIRECTION_ASYMMETRY, .width_urad_s = (uint32_t)lrint(1e6 * width)},
                {.effect = DQW_EFFECT_STRIBECK_FRICTION,
                 .width_urad_s = (uint32_t)lrint(1e6 * width),
                 .fall_urad_s = (uint32_t)lrint(1e6 * fall)}};
            for (int k = 0; k < 3; k++) {
                CASE("full %g, width %g, fall %g, law %d", full, width, fall, k);
                dqw_torque_q15 t;
                TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_torque_init_q15(&t, &c[k], full_mrad_s[f]));
                const double w_s = 1e-6 * c[k].width_urad_s;
                const double w_v = k == 2 ? 1e-6 * c[k].fall_urad_s : INFINITY;
                for (int w = -32768; w <= 32767; w += scaled(10) == 10 ? 1 : 7) {
                    int32_t x;
                    dqw_torque_at_q15(&t, (int16_t)w, 0, &x);
                    const double speed = w / ONE * full;
                    const double soft = tanh(speed / w_s) * exp(-speed / w_v * speed / w_v);
                    const double apart = fabs(x - ONE * (k == 1 ? fabs(soft) : soft));
                    if (apart > most[k]) most[k] = apart;
                    if (w > 0 && soft < 0.999) off[k] += x - ONE * soft, tried[k]++;
                }
            }
        }
    CASE("last places of Q15");
    BETWEEN(1.5, most[0], 2.0);  // 1.98
    BETWEEN(1.5, most[1], 2.0);
    BETWEEN(1.5, most[2], 3.0);  // 2.00
    CASE("mean, last places");
    BETWEEN(-0.4, off[0] / tried[0], -0.25);  // -0.33
    BETWEEN(-0.4, off[1] / tried[1], -0.25);
    BETWEEN(0.05, off[2] / tried[2], 0.2);  // 0.12
}

// A width from 2^-13 to 16 of the full speed means something, to the last micro-radian.
static void test_how_wide_a_soft_sign_may_be(void)
{
    static const uint32_t full_mrad_s[] = {1000000, 8192, 4096000};
    for (int f = 0; f < 3; f++) {
        CASE("full %u mrad/s", (unsigned)full_mrad_s[f]);
        const uint64_t least = ((uint64_t)full_mrad_s[f] * 1000 + 8191) / 8192;
        const uint64_t most = (uint64_t)full_mrad_s[f] * 16000;
        HOLDS(dqw_soft_rate_q15((uint32_t)least - 1, full_mrad_s[f]) == 0);
        // 2 / ln 2 over the width, Q16
        BETWEEN(-1e-4, dqw_soft_rate_q15((uint32_t)least, full_mrad_s[f]) / (65536 * 2 / log(2) * 8192) - 1, 1e-3);
        if (most > UINT32_MAX) continue;
        BETWEEN(-1e-4, dqw_soft_rate_q15((uint32_t)most, full_mrad_s[f]) / (65536 * 2 / log(2) / 16) - 1, 1e-4);
        HOLDS(dqw_soft_rate_q15((uint32_t)most + 1, full_mrad_s[f]) == 0);
    }
    HOLDS(dqw_soft_rate_q15(2000000, DQW_SCALE_MAX) != 0 && dqw_soft_rate_q15(2000000, DQW_SCALE_MAX + 1) == 0);
}

static void test_the_laws_of_cogging_and_load(void)
{
    double most = 0.0;
    for (int periods = 1; periods <= 1000; periods += 37) {
        const dqw_torque_q15_config c = {.effect = DQW_EFFECT_COGGING_TORQUE, .periods = (uint16_t)periods};
        dqw_torque_q15 t;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_torque_init_q15(&t, &c, 1000));
        for (int theta = 0; theta < 65536; theta += 5) {
            int32_t x[2];
            dqw_torque_at_q15(&t, 0, (uint16_t)theta, x);
            const double angle = 2 * PI * theta / 65536.0 * periods;
            most = fmax(most, fmax(fabs(x[0] - ONE * cos(angle)), fabs(x[1] - ONE * sin(angle))));
        }
    }
    BETWEEN(0.5, most, 1.5);
    const dqw_torque_q15_config load = {.effect = DQW_EFFECT_LOAD_TORQUE};
    dqw_torque_q15 t;
    int32_t x;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_torque_init_q15(&t, &load, 1000));
    dqw_torque_at_q15(&t, -5, 7, &x);
    TEST_ASSERT_EQUAL_INT32(32768, x);
}

int main(void)
{
    UNITY_BEGIN();
    coast = driven("coast_friction");
    rough = driven("effect_friction");
    RUN_TEST(test_the_laws_of_friction);
    RUN_TEST(test_how_wide_a_soft_sign_may_be);
    RUN_TEST(test_the_laws_of_cogging_and_load);
    RUN_TEST(test_a_full_shaft);
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_the_whole_trajectory);
    RUN_TEST(test_start_values_and_readings_are_irrelevant);
    RUN_TEST(test_saturated_samples_are_counted_and_not_learned);
    RUN_TEST(test_a_gap);
    RUN_TEST(test_a_late_background_is_counted);
    RUN_TEST(test_samples_may_interrupt_the_background_anywhere);
    RUN_TEST(test_missing_samples);
    RUN_TEST(test_read_before_anything_was_learned);
    RUN_TEST(test_the_threshold_of_learned);
    RUN_TEST(test_a_residual_of_nothing);
    RUN_TEST(test_what_is_usable);
    RUN_TEST(test_a_configuration_from_a_nameplate);
    RUN_TEST(test_define_begins_anew);
    RUN_TEST(test_the_edges_of_standstill);
    RUN_TEST(test_what_the_signals_cannot_teach_is_not_known);
    free(coast.rows);
    free(rough.rows);
    return UNITY_END();
}
