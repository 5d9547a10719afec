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
    double torque_Nm, w_rad_s, J_kgm2, B_Nms_rad;
} shaft;

static shaft driven(const char *scenario, const char *noise)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find(scenario);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "noise", noise));
    shaft d = {.J_kgm2 = s.machine.J_kgm2, .B_Nms_rad = s.machine.B_Nms_rad};
    d.rows = simulate(&s);
    d.count = count;
    for (size_t k = 0; k < d.count; k++) {
        d.torque_Nm = fmax(d.torque_Nm, fabs(d.rows[k].torque_Nm));
        d.w_rad_s = fmax(d.w_rad_s, fabs(d.rows[k].w_m_rad_s));
    }
    d.scale.torque_full_uNm = (uint32_t)ceil(1.01e6 * d.torque_Nm);
    d.scale.w_full_mrad_s = (uint32_t)ceil(1.01e3 * d.w_rad_s);
    d.scale.dt_ns = (uint32_t)lrint(1e9 * (d.rows[1].t_s - d.rows[0].t_s));
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
    return dqw_mechanical_step_q15(m, q15(r->torque_Nm, 1e-6 * s->torque_full_uNm), q15(r->w_m_rad_s, 1e-3 * s->w_full_mrad_s), turn(r->theta_m_rad), saturated);
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
    const char *scenario, *noise;
    bool coulomb;
    double width_rad_s, standstill_rad_s;
    bool effects;  // all five of the shaft
    double low, high, sd_low, sd_high;
    uint32_t known;  // at the end
} setup;

// Largest difference of a known value at every 20th block, in percent of the effect's largest weight, and of a deviation at the end.
static double trajectory(const setup *s, double *apart_sd)
{
    shaft d = driven(s->scenario, s->noise);
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
    double most = 0.0;
    double v[VALUES], sd[VALUES];
    uint32_t known = 0;
    int blocks = 0;
    for (size_t k = 0; k < d.count; k++) {
        const dqw_sim_row *r = &d.rows[k];
        const uint32_t one = dqw_mechanical_step_at(&g, (float)r->torque_Nm, (float)r->w_m_rad_s, (float)remainder(r->theta_m_rad, 2 * PI));
        (void)step(&m, r, false);
        const uint32_t two = dqw_mechanical_background_q15(&m);
        TEST_ASSERT_EQUAL_UINT32(one & DQW_EVENT_LEARNED, two & DQW_EVENT_LEARNED);
        if (two == 0 || ++blocks % 20 != 0) continue;
        read_float(&g, effects, v, sd, &known);
        CASE("%s, noise %s, block %d", s->scenario, s->noise, blocks);
        if (blocks >= 60) TEST_ASSERT_EQUAL_HEX32_MESSAGE(known, m.friction.known, test_case);
        for (int i = 0; i < VALUES; i++) {
            if ((known >> i & m.friction.known >> i & 1u) == 0) continue;
            // A small weight of a large effect is as good as the large one.
            const double size = i == 6 || i == 7 ? hypot(v[6], v[7]) : fabs(v[i]);
            const double apart = 100.0 * fabs(value(&m, i) - v[i]) / size;
            if (apart > most) most = apart;
        }
    }
    *apart_sd = 0.0;
    for (int i = 0; i < VALUES; i++)
        if ((known >> i & 1u) != 0) *apart_sd = fmax(*apart_sd, 100.0 * fabs(deviation(&m, i) / sd[i] - 1.0));
    TEST_ASSERT_EQUAL_HEX32(s->known, known);
    TEST_ASSERT_EQUAL_UINT32(0, m.missed);
    TEST_ASSERT_EQUAL_UINT32(0, m.gate.saturated);
    BETWEEN(380, blocks, 400);
    free(d.rows);
    return most;
}

static void test_the_whole_trajectory(void)
{
    static const setup logs[] = {
        {"coast_friction", "0", .known = 3, .low = 0.001, .high = 0.1, .sd_low = 0.0, .sd_high = 20},
        {"coast_friction", "0", true, .known = 7, .low = 0.001, .high = 0.1, .sd_low = 0.0, .sd_high = 20},
        {"coast_friction", "0", true, 1.0, .known = 7, .low = 0.001, .high = 0.1, .sd_low = 0.0, .sd_high = 20},
        {"coast_friction", "0.01", true, 1.0, 0.5, .known = 7, .low = 0.001, .high = 0.1, .sd_low = 0.0, .sd_high = 20},
        {"coast_friction", "0.2", true, .known = 7, .low = 0.001, .high = 0.1, .sd_low = 0.0, .sd_high = 20},
        {"effect_friction", "0", .effects = true, .known = 0xfb, .low = 0.001, .high = 0.1, .sd_low = 0.0, .sd_high = 20},
        {"effect_friction", "0.01", .effects = true, .known = 0xfb, .low = 0.001, .high = 0.1, .sd_low = 0.0, .sd_high = 20},
    };
    for (unsigned n = 0; n < sizeof logs / sizeof logs[0]; n++) {
        double apart_sd;
        const double most = trajectory(&logs[n], &apart_sd);
        CASE("log %u: %s, noise %s", n, logs[n].scenario, logs[n].noise);
        BETWEEN(logs[n].low, most, logs[n].high);
        BETWEEN(logs[n].sd_low, apart_sd, logs[n].sd_high);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_whole_trajectory);
    return UNITY_END();
}
