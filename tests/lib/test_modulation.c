// Which leg of an inverter rests; what the estimator learns behind one, with its dead time on one side, on both or
// overcompensated; an encoder that is off, and one that is late; and how it is found which legs switch.
#include "dqw_estimator_block.h"
#include "dqw_estimator_search.h"
#include "dqw_modulation.h"
#include "dqw_monitor.h"
#include "resting_joint.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { MODULATIONS = 5 };
static const char *const NAME[MODULATIONS] = {"centred", "clamped low", "clamped high", "clamped 60", "mask"};
static const char *const WEIGHT[] = {"R", "L_d", "L_q", "flux", "dead time", "flux on q", "constant"};

// By the duties that each modulation makes, at every degree and at its middle, where two phases are alike.
static void test_the_leg_that_rests(void)
{
    for (int m = 1; m < 4; m++)
        for (int half = 0; half < 720; half++) {
            const double theta = half * PI / 360 + 1e-9;
            double v[3];
            int32_t whole[3];
            for (int p = 0; p < 3; p++) {
                v[p] = 0.4 * cos(theta - p * 2 * PI / 3);
                whole[p] = (int32_t)lrint(v[p] * 2e9);
            }
            CASE("%s at %g degrees: %d, %d, %d", NAME[m], half / 2.0, (int)whole[0], (int)whole[1], (int)whole[2]);
            const unsigned legs = dqw_modulation_resting((enum dqw_modulation)m, whole);
            const unsigned truth = resting_legs((enum dqw_modulation)m, v);
            HOLDS(legs == 1 || legs == 2 || legs == 4);
            // Twice as low a phase's largest, and one of its neighbours' largest, rests; at the edge either.
            const bool edge = half % 60 == 0;
            HOLDS(legs == truth || edge);
        }
    // Any numbers: one leg, the right one, but for sizes that are one apart.
    test_random r = {17};
    for (int k = 0; k < 100000; k++) {
        int32_t v[3];
        for (int p = 0; p < 3; p++)
            v[p] = random_bits(&r) % 4 == 0 ? (random_bits(&r) % 2 ? INT32_MAX : INT32_MIN)
                                            : (int32_t)((int64_t)(random_bits(&r) & 0xffffffffu) + INT32_MIN);
        for (int m = 1; m < 4; m++) {
            CASE("%s: %d, %d, %d", NAME[m], (int)v[0], (int)v[1], (int)v[2]);
            const unsigned legs = dqw_modulation_resting((enum dqw_modulation)m, v);
            HOLDS(legs == 1 || legs == 2 || legs == 4);
            const double x = v[legs / 2];
            for (int p = 0; p < 3; p++)
                HOLDS(m == 1 ? x <= v[p] : m == 2 ? x >= v[p] : fabs(x) >= fabs((double)v[p]) - 1);
        }
        HOLDS(dqw_modulation_resting(DQW_MODULATION_CENTRED, v) == 0 &&
              dqw_modulation_resting(DQW_MODULATION_MASK, v) == 0 &&
              dqw_modulation_resting((enum dqw_modulation)77, v) == 0);
    }
}

static dqw_estimator_config config_of(enum dqw_modulation modulation)
{
    const dqw_estimator_config c = {.dt_s = (float)RESTING_DT_S,
                                    .v_base_V = 24,
                                    .i_base_A = 8,
                                    .w_base_rad_s = 160,
                                    .R_ohm = (float)(1.05 * RESTING_MACHINE[0]),
                                    .Ld_H = (float)(1.05 * RESTING_MACHINE[1]),
                                    .Lq_H = (float)(1.05 * RESTING_MACHINE[2]),
                                    .psi_Wb = (float)(1.05 * RESTING_MACHINE[3]),
                                    .pole_pairs = RESTING_POLES,
                                    .dead_time_width_A = 0.2f,
                                    .modulation = modulation,
                                    .angle = true,
                                    .encoder_offset = true,
                                    .noise_on_inputs = true};
    return c;
}

static dqw_estimator learned(const resting_joint *j, const dqw_estimator_config *c, double seconds)
{
    dqw_estimator e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, c));
    const long rows = lrint(seconds / RESTING_DT_S);
    for (long k = 0; k < rows; k++) {
        bool made;
        const dqw_sample s = resting_sample(j, k, &made);
        if (dqw_estimator_sample(&e, &s, !made) & DQW_EVENT_BLOCK) (void)dqw_estimator_background(&e);
    }
    HOLDS(e.restarts == 0);
    return e;
}

static double value_of(const dqw_estimator *e, int i)
{
    return (double)dqw_estimator_read(e, (enum dqw_parameter)i).value;
}

static double off_percent(const dqw_estimator *e, const resting_joint *j, int i)
{
    return 100 * (value_of(e, i) / j->machine[i] - 1);
}

static resting_joint joint_of(enum dqw_modulation modulation, double dead_V, double constant_V)
{
    const resting_joint j = {
        .machine = {RESTING_MACHINE[0], RESTING_MACHINE[1], RESTING_MACHINE[2], RESTING_MACHINE[3]},
        .modulation = modulation,
        .dead_V = dead_V,
        .constant_V = constant_V,
        .width_A = 0.2};
    return j;
}

// With the right modulation all is as if no leg rested; said to be centred, dead time is a third too small, and R takes
// up some of the rest.
static void test_a_leg_that_rests_has_no_dead_time(void)
{
    for (int m = 0; m < MODULATIONS; m++) {
        const resting_joint j = joint_of((enum dqw_modulation)m, 0.24, 0.0);
        const dqw_estimator_config right = config_of(j.modulation);
        const dqw_estimator e = learned(&j, &right, 2.0);
        for (int i = 0; i < 4; i++) {
            CASE("%s, %s", NAME[m], WEIGHT[i]);
            BETWEEN(-0.02, off_percent(&e, &j, i), 0.02);  // 0.008
        }
        CASE("%s", NAME[m]);
        BETWEEN(0.998, value_of(&e, DQW_DEAD_TIME) / 0.24, 1.002);  // 1.0003
        HOLDS(dqw_estimator_read(&e, DQW_DEAD_TIME).usable);
        BETWEEN(-0.004, value_of(&e, DQW_DEAD_CONSTANT) / 0.24, 0.004);  // 0.0012
        // Without a leg that rests nothing shows it.
        HOLDS((dqw_estimator_sd(&e, DQW_DEAD_CONSTANT) < DQW_UNKNOWN) == (m != 0));
        if (m == 0) continue;
        const dqw_estimator_config wrong = config_of(DQW_MODULATION_CENTRED);
        const dqw_estimator w = learned(&j, &wrong, 2.0);
        BETWEEN(0.5, value_of(&w, DQW_DEAD_TIME) / 0.24, 0.75);  // 0.59 to 0.68
        BETWEEN(0.25, fabs(off_percent(&w, &j, DQW_R)), 2.0);    // 0.28 to 1.3
        BETWEEN(5, sqrt(dqw_estimator_common_variance(&w) / dqw_estimator_common_variance(&e)), 100);
    }
}

// A switching leg loses V (sign i - 1): dead time that shows while the current flows one way alone.
static void test_dead_time_on_one_side(void)
{
    for (int m = 1; m < MODULATIONS; m++)
        for (int sign = -1; sign <= 1; sign += 2) {
            const resting_joint j = joint_of((enum dqw_modulation)m, 0.24, sign * 0.24);
            const dqw_estimator_config c = config_of(j.modulation);
            const dqw_estimator e = learned(&j, &c, 2.0);
            for (int i = 0; i < 4; i++) {
                CASE("%s, %g V, %s", NAME[m], j.constant_V, WEIGHT[i]);
                BETWEEN(-0.02, off_percent(&e, &j, i), 0.02);  // 0.008
            }
            CASE("%s, %g V", NAME[m], j.constant_V);
            BETWEEN(0.998, value_of(&e, DQW_DEAD_TIME) / 0.24, 1.002);
            BETWEEN(0.996, value_of(&e, DQW_DEAD_CONSTANT) / j.constant_V, 1.004);  // 0.9988 to 1.0012
            HOLDS(dqw_estimator_read(&e, DQW_DEAD_CONSTANT).usable);
        }
}

// Compensated twice.
static void test_a_negative_dead_time(void)
{
    for (int m = 0; m < MODULATIONS; m++) {
        const resting_joint j = joint_of((enum dqw_modulation)m, -0.24, 0.0);
        const dqw_estimator_config c = config_of(j.modulation);
        const dqw_estimator e = learned(&j, &c, 2.0);
        for (int i = 0; i < 4; i++) {
            CASE("%s, %s", NAME[m], WEIGHT[i]);
            BETWEEN(-0.02, off_percent(&e, &j, i), 0.02);  // 0.008
        }
        BETWEEN(0.998, value_of(&e, DQW_DEAD_TIME) / -0.24, 1.002);  // 1.0005
        HOLDS(dqw_estimator_read(&e, DQW_DEAD_TIME).usable);
    }
}

// Unlike inductances, and an encoder that is off by 0.12 rad: the data are turned, and the angle is told as it came. An
// angle that is late by half a period turns with the speed.
static void test_an_angle_that_is_off_or_late(void)
{
    for (int way = 0; way < 6; way++) {
        resting_joint j = joint_of(way % 2 ? DQW_MODULATION_CLAMPED_60 : DQW_MODULATION_CENTRED, 0.24, 0.0);
        j.off_rad = way / 2 == 1 ? 0.0 : way % 2 ? -0.12 : 0.12;
        j.late_s = way / 2 == 0 ? 0.0 : 0.5 * RESTING_DT_S;
        dqw_estimator_config c = config_of(j.modulation);
        c.angle_late_s = (float)j.late_s;
        c.follow = true;
        // What was learned before the turn counts for as long again.
        const dqw_estimator e = learned(&j, &c, j.off_rad != 0.0 ? 8.0 : 4.0);
        for (int i = 0; i < 4; i++) {
            CASE("off by %g rad, late by %g s, %s", j.off_rad, j.late_s, WEIGHT[i]);
            const double most = j.off_rad != 0.0 ? 0.08 : 0.02;  // 0.066, 0.007
            BETWEEN(-most, off_percent(&e, &j, i), most);
        }
        CASE("off by %g rad, late by %g s", j.off_rad, j.late_s);
        BETWEEN(-5e-4, value_of(&e, DQW_PSI_Q) / j.machine[3] - sin(j.off_rad), 5e-4);
        // Less than a hundredth is left where it is.
        BETWEEN(-0.01, asin((double)e.turn_sine) + j.off_rad, 0.01);
        HOLDS((j.off_rad == 0.0) == (e.turn_sine == 0.0f));
        if (way / 2 != 1) continue;
        // Not said, it shows.
        c.angle_late_s = 0.0f;
        const dqw_estimator u = learned(&j, &c, 4.0);
        BETWEEN(0.25, fabs(off_percent(&u, &j, DQW_R)), 1.0);
        // The other way it is as wrong again.
        c.angle_late_s = -(float)j.late_s;
        const dqw_estimator v = learned(&j, &c, 4.0);
        BETWEEN(1.7, off_percent(&v, &j, DQW_R) / off_percent(&u, &j, DQW_R), 2.3);
    }
}

// Every vector of a block is turned by the same angle, the block's own angle the other way.
static void test_a_block_is_turned(void)
{
    test_random r = {31};
    for (int k = 0; k < 1000; k++) {
        const double off = random_uniform(&r, -PI, PI);
        const bool late = k % 2 == 0;
        dqw_estimator_config c = config_of(DQW_MODULATION_CENTRED);
        c.angle_late_s = late ? (float)random_uniform(&r, -2 * RESTING_DT_S, 2 * RESTING_DT_S) : 0.0f;
        c.pole_pairs = k % 3 == 0 ? 0 : 7;
        dqw_estimator e;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
        e.turn_cosine = (float)cos(off);
        e.turn_sine = (float)sin(off);
        dqw_estimator_block b = {.whole = false};
        for (int i = 0; i < DQW_PLAIN_SIGNALS; i++) b.sum[i] = (float)random_uniform(&r, -100, 100);
        for (int i = 0; i < 2; i++) b.v_step_V[i] = (float)random_uniform(&r, -100, 100);
        const double theta = random_uniform(&r, -PI, PI);
        b.cosine = (float)cos(theta);
        b.sine = (float)sin(theta);
        dqw_estimator_block t = b;
        dqw_estimator_turn_block(&e, &t);
        const double by = off + (double)c.angle_late_s * c.pole_pairs * 0.5 * (double)b.sum[8];
        CASE("by %g", by);
        for (int i = 0; i < DQW_PLAIN_SIGNALS + 2; i++) {
            if (i == 8) continue;
            const float *from = i < 8 ? &b.sum[i & ~1] : i < 13 ? &b.sum[9 + ((i - 9) & ~1)] : b.v_step_V;
            const float *to = i < 8 ? &t.sum[i & ~1] : i < 13 ? &t.sum[9 + ((i - 9) & ~1)] : t.v_step_V;
            BETWEEN(-2e-4, (double)to[0] - (cos(by) * (double)from[0] + sin(by) * (double)from[1]), 2e-4);
            BETWEEN(-2e-4, (double)to[1] - (cos(by) * (double)from[1] - sin(by) * (double)from[0]), 2e-4);
        }
        HOLDS(t.sum[8] == b.sum[8]);
        BETWEEN(-1e-5, (double)t.cosine - cos(theta + by), 1e-5);
        BETWEEN(-1e-5, (double)t.sine - sin(theta + by), 1e-5);
    }
}

// Nobody says which legs switch: found, on whichever side dead time is, with an encoder that is off and one that is
// not; and then all is learned as if it had been said. Time has jumped now and then, and the drive stood still.
static void test_the_legs_that_switch_are_found(void)
{
    for (int m = 0; m < 4; m++)
        for (int way = 0; way < 4; way++) {
            resting_joint j = joint_of((enum dqw_modulation)m, way == 1 ? -0.24 : 0.24, way == 2 ? -0.24 : 0.0);
            if (way == 3) j.off_rad = 0.12;
            dqw_estimator_config c = config_of(DQW_MODULATION_UNKNOWN);
            c.follow = way != 1;
            const dqw_monitor_config mc = {.estimator = c};
            static dqw_monitor o;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init(&o, &mc));
            const dqw_estimator *e = &o.estimator;
            CASE("%s, way %d", NAME[m], way);
            double found_s = 0.0;
            bool why = false;
            for (long k = 0; k < lrint(9 / RESTING_DT_S); k++) {
                bool made;
                const dqw_sample s = resting_sample(&j, k, &made);
                if (k % 30011 == 30010) dqw_monitor_missing(&o, k % 2 == 0 ? 1 : 0);
                if (dqw_monitor_sample(&o, &s, !made) & DQW_EVENT_BLOCK) (void)dqw_monitor_background(&o);
                if (found_s > 0.0) continue;
                if (dqw_estimator_modulation(e) != DQW_MODULATION_UNKNOWN) found_s = (double)k * RESTING_DT_S;
                HOLDS(e->stage.name != DQW_STAGE_IN_SERVICE && e->modulation < 4);
                // Nothing is told meanwhile.
                if (e->trial == 0 || e->trial == DQW_ESTIMATOR_SEEKS) continue;
                HOLDS(!dqw_estimator_read(e, DQW_R).usable);
                HOLDS(dqw_estimator_voltage_acts(e) == DQW_VOLTAGE_NOT_KNOWN);
                if (dqw_monitor_why(&o) == DQW_WHY_MODULATION) why = true;
            }
            CASE("%s, way %d: %d found at %g s, trial %d", NAME[m], way, (int)dqw_estimator_modulation(e), found_s,
                 e->trial);
            HOLDS(dqw_estimator_modulation(e) == (enum dqw_modulation)m && why);
            BETWEEN(3.0, found_s, 7.0);  // 0.8 s, then four rounds at most, or two and one
            HOLDS(e->stage.name == DQW_STAGE_IN_SERVICE && e->restarts == 0);
            for (int i = 0; i < 4; i++) {
                const double most = way == 3 ? 0.06 : 0.02;
                BETWEEN(-most, off_percent(e, &j, i), most);
            }
            BETWEEN(0.998, value_of(e, DQW_DEAD_TIME) / j.dead_V, 1.002);
        }
}

// Where nothing tells them apart all legs switch: no dead time, or none to be learned. A drive that does not move tells
// nothing at all.
static void test_what_is_not_found(void)
{
    for (int m = 0; m < 4; m++) {
        const resting_joint j = joint_of((enum dqw_modulation)m, 0.0, 0.0);
        const dqw_estimator_config c = config_of(DQW_MODULATION_UNKNOWN);
        const dqw_estimator e = learned(&j, &c, 8.0);
        CASE("%s: %d, trial %d", NAME[m], (int)dqw_estimator_modulation(&e), e.trial);
        HOLDS(dqw_estimator_modulation(&e) == DQW_MODULATION_CENTRED && e.trial == 0);
    }
    dqw_estimator_config c = config_of(DQW_MODULATION_UNKNOWN);
    dqw_estimator e;
    for (int way = 0; way < 3; way++) {
        c.dead_time_width_A = way == 0 ? 0.0f : 0.2f;
        c.angle = way != 1;
        c.settled = way == 2;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
        HOLDS(dqw_estimator_modulation(&e) == DQW_MODULATION_CENTRED);
    }
    c = config_of(DQW_MODULATION_UNKNOWN);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
    const dqw_sample rest = {.cosine = 1.0f};
    for (int k = 0; k < 100000; k++)
        if (dqw_estimator_sample(&e, &rest, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background(&e);
    HOLDS(dqw_estimator_modulation(&e) == DQW_MODULATION_UNKNOWN && e.trial == DQW_ESTIMATOR_SEEKS);
    for (int m = 0; m < DQW_MODULATION_UNKNOWN; m++) {
        c.modulation = (enum dqw_modulation)m;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
        HOLDS(dqw_estimator_modulation(&e) == c.modulation);
    }
}

// Blocks in which two modulations meet are not learned: the two after a change, and no other.
static void test_no_block_mixes(void)
{
    const resting_joint j = joint_of(DQW_MODULATION_CENTRED, 0.24, 0.0);
    const dqw_estimator_config c = config_of(DQW_MODULATION_UNKNOWN);
    dqw_estimator e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
    uint32_t changed = 0;
    uint8_t before = 0;
    int changes = 0;
    for (long k = 0; k < lrint(3 / RESTING_DT_S); k++) {
        bool made;
        const dqw_sample s = resting_sample(&j, k, &made);
        if ((dqw_estimator_sample(&e, &s, false) & DQW_EVENT_BLOCK) == 0) continue;
        const float shown = e.slow_sum_pu[0] + e.slow_sum_pu[1];
        (void)dqw_estimator_background(&e);
        const bool tries = e.trial != 0 && e.trial != DQW_ESTIMATOR_SEEKS;
        CASE("row %ld, trial %d: changed %u halves ago", k, e.trial, (unsigned)(e.number - changed));
        if (tries && changes > 0 && e.number - changed <= 2)
            HOLDS(e.slow_sum_pu[0] + e.slow_sum_pu[1] == shown);
        else if (tries && changes > 0 && e.modulation == before)
            HOLDS(e.slow_sum_pu[0] + e.slow_sum_pu[1] == shown + 1.0f);
        if (tries && e.modulation != before) {
            changes++;
            changed = e.number;
        }
        before = e.modulation;
    }
    HOLDS(changes > 50);
}

static void test_refusals(void)
{
    const dqw_estimator_config good = config_of(DQW_MODULATION_MASK);
    dqw_estimator e;
    dqw_estimator_config c = good;
    static const int none[] = {-1, DQW_MODULATIONS, DQW_MODULATIONS + 1};
    for (int i = 0; i < 3; i++) {
        c.modulation = (enum dqw_modulation)none[i];
        REFUSED(e, DQW_ERR_MODULATION, dqw_estimator_init(&e, &c));
    }
    c = good;
    static const float late[] = {2.001f, -2.001f, INFINITY, -INFINITY, NAN};
    for (int i = 0; i < 5; i++) {
        c.angle_late_s = late[i] * c.dt_s;
        REFUSED(e, DQW_ERR_ANGLE_LATE, dqw_estimator_init(&e, &c));
    }
    for (int way = -2; way <= 2; way++) {
        c.angle_late_s = (float)way * c.dt_s;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
    }
#if DQW_EFFECT_WEIGHTS > 0
    // The effects' laws see the currents as they come.
    static const dqw_effect_config list = {.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    c.effects = &list;
    c.effect_count = 1;
    REFUSED(e, DQW_ERR_ANGLE_LATE, dqw_estimator_init(&e, &c));
    c.angle_late_s = 0.0f;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
    // And so they are not turned.
    e.turn_cosine = 0.0f;
    e.turn_sine = 1.0f;
    dqw_estimator_block b = {.sum = {1.0f, 2.0f}};
    dqw_estimator_turn_block(&e, &b);
    HOLDS(b.sum[0] == 1.0f && b.sum[1] == 2.0f);
#endif
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_leg_that_rests);
    RUN_TEST(test_a_leg_that_rests_has_no_dead_time);
    RUN_TEST(test_dead_time_on_one_side);
    RUN_TEST(test_a_negative_dead_time);
    RUN_TEST(test_an_angle_that_is_off_or_late);
    RUN_TEST(test_a_block_is_turned);
    RUN_TEST(test_the_legs_that_switch_are_found);
    RUN_TEST(test_what_is_not_found);
    RUN_TEST(test_no_block_mixes);
    RUN_TEST(test_refusals);
    return UNITY_END();
}
