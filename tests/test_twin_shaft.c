// The mechanical axis in fixed point beside the float one over simulated logs: the whole trajectory, every effect of the shaft, what is
// skipped, late backgrounds; and the laws of the effects over every speed.
#include "dqw_mechanical.h"
#include "dqw_mechanical_q15.h"
#include "dqw_test.h"
#include "sim_log.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { HALF = 25, VALUES = DQW_FRICTION_Q15_VALUES, LIST = 6 };
#define ONE 32768.0

// A log and its full scales.
typedef struct shaft {
    dqw_sim_row *rows;
    size_t count;
    dqw_mechanical_scale scale;
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

static int16_t q15(double x, double full) { return (int16_t)fmax(-32768.0, fmin(32767.0, floor(x / full * ONE + 0.5))); }
static uint16_t turn(double angle_rad) { return (uint16_t)((uint32_t)(int32_t)lrint(remainder(angle_rad, 2 * PI) / (2 * PI) * 65536.0) & 65535u); }

static dqw_mechanical_q15_config config_of(const shaft *d)
{
    const dqw_mechanical_q15_config c = {.scale = d->scale, .half_window = HALF, .read_blocks = 1};
    return c;
}

static dqw_mechanical_q15 begin(const dqw_mechanical_q15_config *c)
{
    dqw_mechanical_q15 m;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init_q15(&m, c));
    return m;
}

static uint32_t step(dqw_mechanical_q15 *m, const dqw_sim_row *r, bool saturated)
{
    const dqw_mechanical_scale *s = &m->config->scale;
    return dqw_mechanical_step_q15(m, q15(r->torque_Nm, 1e-6 * s->torque_full_uNm), q15(r->w_m_rad_s, 1e-3 * s->w_full_mrad_s), turn(r->theta_m_rad),
                                   saturated);
}

static double unit_of(const dqw_mechanical_scale *s, int i)
{
    const double torque = 1e-6 * s->torque_full_uNm;
    const double w = 1e-3 * s->w_full_mrad_s;
    return i == DQW_J_Q15 ? torque * 1e-9 * s->dt_ns / w : i == DQW_B_Q15 ? torque / w : torque;
}

static double value(const dqw_mechanical_q15 *m, int i) { return ldexp((double)m->friction.value_q40[i], -40) * unit_of(&m->config->scale, i); }

static double deviation(const dqw_mechanical_q15 *m, int i)
{
    const int64_t sd_q40 = m->friction.sd_q40[i];
    return sd_q40 == INT64_MAX ? INFINITY : ldexp((double)sd_q40, -40) * unit_of(&m->config->scale, i);
}

// What the float twin read, in the order of dqw_friction_q15.
static void read_float(const dqw_mechanical *g, int effects, double v[VALUES], double sd[VALUES], uint32_t *known)
{
    const dqw_friction f = dqw_mechanical_read(g);
    const double plain[2][3] = {{f.J_kgm2, f.B_Nms_rad, f.coulomb_Nm}, {f.J_sd_kgm2, f.B_sd_Nms_rad, f.coulomb_sd_Nm}};
    for (int i = 0; i < 3; i++) v[i] = plain[0][i], sd[i] = plain[1][i];
    *known = (uint32_t)f.J_known | (uint32_t)f.B_known << 1 | (uint32_t)f.coulomb_known << 2;
    int at = 3;
    for (int k = 0; k < effects; k++) {
        float w[2], s[2];
        *known |= (uint32_t)dqw_mechanical_effect(g, k, w, s) << at;
        for (int i = 0; i < dqw_effect_weights(g->effects[k].effect); i++, at++) v[at] = w[i], sd[at] = s[i];
    }
}

// An effect of both twins.
static void add_effect(enum dqw_effect_name name, double first, double second, dqw_effect_config *f, dqw_torque_q15_config *q)
{
    *f = (dqw_effect_config){.effect = name, .shape = {(float)first, (float)second}};
    *q = (dqw_torque_q15_config){
        .effect = name, .width_urad_s = (uint32_t)lrint(1e6 * first), .fall_urad_s = (uint32_t)lrint(1e6 * second), .periods = (uint16_t)lrint(first)};
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
    dqw_mechanical_q15_config c = config_of(&d);
    c.coulomb = s->coulomb;
    c.coulomb_width_urad_s = (uint32_t)lrint(1e6 * s->width_rad_s);
    c.standstill_urad_s = (uint32_t)lrint(1e6 * s->standstill_rad_s);
    c.effects = list_q15;
    c.effect_count = (uint8_t)effects;
    const dqw_mechanical_config f = {.dt_s = 1e-9f * (float)d.scale.dt_ns,
                                     .torque_base_Nm = (float)d.torque_Nm,
                                     .w_base_rad_s = (float)d.w_rad_s,
                                     .half_window = HALF,
                                     .coulomb = s->coulomb,
                                     .coulomb_width_rad_s = (float)s->width_rad_s,
                                     .standstill_rad_s = (float)s->standstill_rad_s,
                                     .effects = list,
                                     .effect_count = (uint8_t)effects};
    dqw_mechanical_q15 m = begin(&c);
    dqw_mechanical g;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init(&g, &f));
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
        const uint32_t one = dqw_mechanical_step_at(&g, (float)r.torque_Nm, (float)r.w_m_rad_s, (float)remainder(r.theta_m_rad, 2 * PI));
        (void)step(&m, &r, false);
        const uint32_t two = dqw_mechanical_background_q15(&m);
        TEST_ASSERT_EQUAL_UINT32(one & DQW_EVENT_LEARNED, two & DQW_EVENT_LEARNED);
        if (two == 0 || ++blocks % 20 != 0) continue;
        read_float(&g, effects, v, sd, &known);
        CASE("%s, block %d: known %x, %x", s->name, blocks, (unsigned)known, (unsigned)m.friction.known);
        if (blocks >= 60) HOLDS(known == m.friction.known);
        for (int i = 0; i < VALUES; i++) {
            if ((known >> i & m.friction.known >> i & 1u) == 0) continue;
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
    // A value before much is learned; a deviation by the likeness of blocks, which the float twin counts from the first block on.
    const setup logs[] = {
        {.name = "J and B", .log = &coast, .known = 3, .most = 0.0032, .apart_sd = 9.5},
        {.name = "friction", .log = &coast, .coulomb = true, .known = 7, .most = 0.036, .apart_sd = 8.9},
        {.name = "soft friction", .log = &coast, .coulomb = true, .width_rad_s = 1, .known = 7, .most = 0.037, .apart_sd = 8.9},
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
        {.name = "five effects, noise of 1 %", .log = &rough, .noise = 0.01, .effects = true, .known = 0xeb, .most = 0.091, .apart_sd = 15},
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

static dqw_mechanical_q15 learned(const dqw_mechanical_q15_config *c)
{
    dqw_mechanical_q15 m = begin(c);
    for (size_t k = 0; k < coast.count; k++) {
        (void)step(&m, &coast.rows[k], false);
        (void)dqw_mechanical_background_q15(&m);
    }
    dqw_mechanical_read_q15(&m);
    return m;
}

static dqw_mechanical_q15_config frictional(void)
{
    dqw_mechanical_q15_config c = config_of(&coast);
    c.coulomb = true;
    c.coulomb_width_urad_s = 1000000;
    return c;
}

// From what the whole log says, percent of the value that is farthest from it.
static double worst(const dqw_mechanical_q15 *m)
{
    const dqw_mechanical_q15_config c = frictional();
    const dqw_mechanical_q15 whole = learned(&c);
    double off = 0.0;
    for (int i = 0; i < 3; i++) off = fmax(off, 100.0 * fabs(value(m, i) / value(&whole, i) - 1.0));
    return off;
}

static void test_start_values_and_readings_are_irrelevant(void)
{
    static const uint8_t every[] = {0, 1, 16, 255};
    for (int n = 0; n < 4; n++)
        for (int start = 0; start < 3; start++) {
            CASE("read every %d blocks, start %d", every[n], start);
            dqw_mechanical_q15_config c = frictional();
            c.read_blocks = every[n];
            c.J_gmm2 = (uint32_t)(1e9 * 0.65 * start * coast.truth[0]);
            c.B_nNms_rad = (uint32_t)(1e9 * 0.65 * start * coast.truth[1]);
            const dqw_mechanical_q15 m = learned(&c);
            HOLDS(m.friction.known == 7u);
            BETWEEN(start == 0 && every[n] == 1 ? 0.0 : 1e-6, worst(&m), 0.02);  // 0.0001 to 0.005
        }
    // Before anything is learned a value is where it starts, and not known.
    dqw_mechanical_q15_config c = frictional();
    c.J_gmm2 = 2000000;
    c.B_nNms_rad = 1000000;
    dqw_mechanical_q15 m = begin(&c);
    dqw_mechanical_read_q15(&m);
    BETWEEN(1.998e-3, value(&m, DQW_J_Q15), 2.002e-3);
    BETWEEN(0.999e-3, value(&m, DQW_B_Q15), 1.001e-3);
    TEST_ASSERT_EQUAL_UINT32(0, m.friction.known);
}

static void test_saturated_samples_are_counted_and_not_learned(void)
{
    const dqw_mechanical_q15_config c = frictional();
    dqw_mechanical_q15 told = begin(&c);
    dqw_mechanical_q15 seen = begin(&c);
    static const int16_t ends[] = {32767, -32767, -32768};
    uint32_t bad = 0;
    for (size_t k = 0; k < coast.count; k++) {
        const dqw_sim_row *r = &coast.rows[k];
        const bool now = k % 40 == 17;
        (void)step(&told, r, now);
        (void)dqw_mechanical_background_q15(&told);
        int16_t torque = q15(r->torque_Nm, 1e-6 * c.scale.torque_full_uNm);
        int16_t w = q15(r->w_m_rad_s, 1e-3 * c.scale.w_full_mrad_s);
        if (now) *(bad % 2 ? &torque : &w) = ends[bad % 3];
        const uint32_t event = dqw_mechanical_step_q15(&seen, torque, w, 0, false);
        TEST_ASSERT_EQUAL_INT(now, (event & DQW_EVENT_SATURATED) != 0);
        (void)dqw_mechanical_background_q15(&seen);
        bad += now;
    }
    TEST_ASSERT_EQUAL_UINT32(bad, told.gate.saturated);
    TEST_ASSERT_EQUAL_UINT32(bad, seen.gate.saturated);
    TEST_ASSERT_EQUAL_UINT32(coast.count - bad, seen.gate.accepted);
    TEST_ASSERT_EQUAL_MEMORY(&told.friction, &seen.friction, sizeof seen.friction);
    BETWEEN(0.01, worst(&seen), 0.5);
}

// Across a gap nothing is paired. Without the word about it the torque of one stretch meets the speed of another.
static void test_a_gap(void)
{
    const dqw_mechanical_q15_config c = frictional();
    double off[2];
    for (int say = 0; say < 2; say++) {
        dqw_mechanical_q15 m = begin(&c);
        for (size_t k = 0; k < coast.count; k++) {
            if (k % 200 == 110) {
                k += 90;
                if (say) dqw_mechanical_gap_q15(&m);
            }
            if (k >= coast.count) break;
            (void)step(&m, &coast.rows[k], false);
            (void)dqw_mechanical_background_q15(&m);
        }
        off[say] = worst(&m);
    }
    BETWEEN(50.0, off[0], 200.0);  // 94
    BETWEEN(0.5, off[1], 3.0);     // 1.6: half of the rows
}

// A background that comes for every third block misses two of three, says so, and learns the others as they are.
static void test_a_late_background_is_counted(void)
{
    const dqw_mechanical_q15_config c = frictional();
    dqw_mechanical_q15 m = begin(&c);
    int told = 0;
    int blocks = 0;
    for (size_t k = 0; k < coast.count; k++) {
        if ((step(&m, &coast.rows[k], false) & DQW_EVENT_LEARNED) == 0) continue;
        if (++told % 3 == 0) blocks += (dqw_mechanical_background_q15(&m) & DQW_EVENT_LEARNED) != 0;
    }
    TEST_ASSERT_EQUAL_INT(told / 3 * 2 + (told % 3 == 2), m.missed);
    TEST_ASSERT_EQUAL_INT(told / 3, blocks);
    BETWEEN(0.7, worst(&m), 5.0);  // 2.2: a third of the blocks
}

static void test_what_the_signals_cannot_teach_is_not_known(void)
{
    const dqw_mechanical_scale scale = {1500000, 150000, 1000000};
    for (int kind = 0; kind < 3; kind++) {
        CASE("kind %d", kind);
        const dqw_mechanical_q15_config c = {.scale = scale, .coulomb = true};
        dqw_mechanical_q15 m = begin(&c);
        for (int k = 0; k < 20000; k++) {
            const double w = kind == 0 ? 0.0 : kind == 1 ? 100.0 : 50 + 49 * sin(0.01 * k);
            const double slope = kind == 2 ? 49 * 0.01 / 1e-3 * cos(0.01 * (k + 0.5)) : 0.0;
            const double t = kind == 0 ? 0.0 : 2e-3 * slope + 4e-3 * w + 0.1;
            (void)dqw_mechanical_step_q15(&m, q15(t, 1.5), q15(w, 150), 0, false);
            (void)dqw_mechanical_background_q15(&m);
        }
        dqw_mechanical_read_q15(&m);
        // At rest nothing; at one speed viscous and Coulomb friction are one; in one direction at many speeds all of it.
        HOLDS(m.friction.known == (kind == 2 ? 7u : 0u));
        if (kind != 2) continue;
        BETWEEN(-0.01, value(&m, DQW_J_Q15) / 2e-3 - 1, 0.01);
        BETWEEN(-0.01, value(&m, DQW_B_Q15) / 4e-3 - 1, 0.01);
        BETWEEN(-0.01, value(&m, DQW_COULOMB_Q15) / 0.1 - 1, 0.01);
    }
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_mechanical_q15 m;
    const dqw_mechanical_q15_config good = frictional();
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_mechanical_init_q15(NULL, &good));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_mechanical_scale_check(NULL));
    REFUSED(m, DQW_ERR_NULL, dqw_mechanical_init_q15(&m, NULL));
    dqw_mechanical_q15_config bad[12];
    for (int k = 0; k < 12; k++) bad[k] = good;
    bad[0].scale.torque_full_uNm = 0;
    bad[1].scale.torque_full_uNm = DQW_MECHANICAL_SCALE_MAX + 1u;
    bad[2].scale.w_full_mrad_s = 0;
    bad[3].scale.w_full_mrad_s = DQW_SCALE_MAX + 1u;
    bad[4].scale.dt_ns = 0;
    bad[5].scale.dt_ns = 1000000001u;
    bad[6].excitation_q15 = 32767;
    bad[7].coulomb_width_urad_s = (uint32_t)(1000.0 * good.scale.w_full_mrad_s / 8200);
    bad[8].scale.w_full_mrad_s = 1000, bad[8].coulomb_width_urad_s = 16100000;
    bad[9].scale = (dqw_mechanical_scale){1, DQW_SCALE_MAX, 1}, bad[9].J_gmm2 = UINT32_MAX, bad[9].coulomb_width_urad_s = 0;
    bad[10].scale = (dqw_mechanical_scale){1, DQW_SCALE_MAX, 1}, bad[10].B_nNms_rad = UINT32_MAX, bad[10].coulomb_width_urad_s = 0;
    const dqw_mechanical_scale zero = {0};
    bad[11].scale = zero;
    for (int k = 0; k < 12; k++) {
        CASE("%d", k);
        REFUSED(m, DQW_ERR_RANGE, dqw_mechanical_init_q15(&m, &bad[k]));
    }
    dqw_mechanical_q15_config long_window = good;
    long_window.half_window = 101;
    REFUSED(m, DQW_ERR_SIZE, dqw_mechanical_init_q15(&m, &long_window));

    const struct {
        dqw_torque_q15_config effect;
        int status;
    } effects[] = {
        {{.effect = DQW_EFFECT_NONE}, DQW_ERR_RANGE},
        {{.effect = DQW_EFFECT_DEAD_TIME, .width_urad_s = 1000000}, DQW_ERR_RANGE},
        {{.effect = DQW_EFFECT_NAMES}, DQW_ERR_RANGE},
        {{.effect = DQW_EFFECT_COULOMB_FRICTION}, DQW_ERR_RANGE},
        {{.effect = DQW_EFFECT_STRIBECK_FRICTION, .width_urad_s = 1000000}, DQW_ERR_RANGE},
        {{.effect = DQW_EFFECT_STRIBECK_FRICTION, .fall_urad_s = 1000000}, DQW_ERR_RANGE},
        {{.effect = DQW_EFFECT_COGGING_TORQUE}, DQW_ERR_RANGE},
        {{.effect = DQW_EFFECT_COGGING_TORQUE, .periods = 1001}, DQW_ERR_RANGE},
        {{.effect = DQW_EFFECT_COGGING_TORQUE, .periods = 1000}, DQW_OK},
        {{.effect = DQW_EFFECT_LOAD_TORQUE, .start_uNm = {-250000}}, DQW_OK},
    };
    for (unsigned k = 0; k < sizeof effects / sizeof effects[0]; k++) {
        CASE("effect %u", k);
        dqw_torque_q15 t;
        if (effects[k].status != DQW_OK) REFUSED(t, effects[k].status, dqw_torque_init_q15(&t, &effects[k].effect, good.scale.w_full_mrad_s));
        dqw_mechanical_q15_config c = good;
        c.effects = &effects[k].effect;
        c.effect_count = 1;
        if (effects[k].status != DQW_OK)
            REFUSED(m, effects[k].status, dqw_mechanical_init_q15(&m, &c));
        else
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init_q15(&m, &c));
        if (effects[k].status != DQW_OK) continue;
        // A start value is believed to a millionth, in 12 bits.
        dqw_mechanical_read_q15(&m);
        const double start = 1e-6 * effects[k].effect.start_uNm[0];
        BETWEEN(1.001 * start, value(&m, DQW_FRICTION_Q15_PLAIN), 0.999 * start);
    }
    dqw_mechanical_q15_config c = good;
    c.effect_count = 1;
    REFUSED(m, DQW_ERR_NULL, dqw_mechanical_init_q15(&m, &c));
    dqw_torque_q15_config many[DQW_EFFECT_WEIGHTS + 1];
    for (int k = 0; k <= DQW_EFFECT_WEIGHTS; k++) many[k] = effects[9].effect;
    c.effects = many;
    c.effect_count = DQW_EFFECT_WEIGHTS + 1;
    REFUSED(m, DQW_ERR_SIZE, dqw_mechanical_init_q15(&m, &c));
    c.effect_count = DQW_EFFECT_WEIGHTS;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init_q15(&m, &c));
}

// Every speed, against the laws in double.
static void test_the_laws_of_friction(void)
{
    static const uint32_t full_mrad_s[] = {1000, 312300, 10000000};
    static const double part[] = {1.01 / 8192, 1e-3, 0.02, 0.3, 1.0, 15.9};
    double most[3] = {0};
    for (int f = 0; f < 3; f++)
        for (int p = 0; p < 6; p++) {
            const double full = 1e-3 * full_mrad_s[f];
            const double width = part[p] * full;
            const double fall = part[(p + 4) % 6] * full;
            if (width > 4000 || fall > 4000) continue;
            const dqw_torque_q15_config c[] = {
                {.effect = DQW_EFFECT_COULOMB_FRICTION, .width_urad_s = (uint32_t)lrint(1e6 * width)},
                {.effect = DQW_EFFECT_DIRECTION_ASYMMETRY, .width_urad_s = (uint32_t)lrint(1e6 * width)},
                {.effect = DQW_EFFECT_STRIBECK_FRICTION, .width_urad_s = (uint32_t)lrint(1e6 * width), .fall_urad_s = (uint32_t)lrint(1e6 * fall)}};
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
                }
            }
        }
    CASE("last places of Q15");
    BETWEEN(1.5, most[0], 2.0);  // 1.98
    BETWEEN(1.5, most[1], 2.0);
    BETWEEN(1.5, most[2], 3.0);  // 2.00
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
    RUN_TEST(test_the_laws_of_cogging_and_load);
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_the_whole_trajectory);
    RUN_TEST(test_start_values_and_readings_are_irrelevant);
    RUN_TEST(test_saturated_samples_are_counted_and_not_learned);
    RUN_TEST(test_a_gap);
    RUN_TEST(test_a_late_background_is_counted);
    RUN_TEST(test_what_the_signals_cannot_teach_is_not_known);
    free(coast.rows);
    free(rough.rows);
    return UNITY_END();
}
