// Naming of faults: every pattern, as the motor's equations give it, is told by its name and its phase; what is none
// stays unknown.
#include "dqw_fault.h"
#include "dqw_reading.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

#define R_OHM 0.5
#define L_H 1.2e-3

#define DEAD_V 0.4

static dqw_fault_machine machine = {(float)R_OHM, (float)L_H, 0.0f, false, (float)DEAD_V};

// What a change must exceed to mean something: 4 % of R, L_d, L_q, 1 % of the flux, 0.07 V, 0.02 rad; then both parts
// of 0.06 A, 3 % of R,
// 3 % of L, 0.1 % of 1/R.
static const double UNIT[DQW_SIGNS] = {0.013,
                                       0.013,
                                       0.013,
                                       0.004,
                                       0.023,
                                       0.0067,
                                       0.02,
                                       0.02,
                                       0.02,
                                       0.02,
                                       0.01 * R_OHM / 3,
                                       0.01 * R_OHM / 3,
                                       0.01 * L_H / 3,
                                       0.01 * L_H / 3,
                                       0.0003 / R_OHM,
                                       0.0003 / R_OHM};

typedef struct pattern {
    enum dqw_fault_name name;
    const char *text;
    bool phases;      ///< one for each phase
    bool both_signs;  ///< a change either way is this fault
} pattern;

static const pattern PATTERNS[] = {{DQW_FAULT_DEMAGNETISATION, "demagnetisation", false, false},
                                   {DQW_FAULT_TURN_SHORT, "turn short", true, false},
                                   {DQW_FAULT_PHASE_CONNECTION, "phase connection", true, false},
                                   {DQW_FAULT_CURRENT_OFFSET, "current offset", false, true},
                                   {DQW_FAULT_CURRENT_GAIN, "current gain", true, true},
                                   {DQW_FAULT_ENCODER_OFFSET, "encoder offset", false, true},
                                   {DQW_FAULT_INVERTER_FAULT, "inverter", false, false},
                                   {DQW_FAULT_RESISTANCE_RISE, "resistance rise", false, false},
                                   {DQW_FAULT_VOLTAGE_SCALE, "voltage scale", false, true}};

enum { PATTERNS_N = sizeof PATTERNS / sizeof PATTERNS[0] };

// What each fault does, phase by phase in the stator: phase n lies at angle a_n = n 120 degrees. A quantity x(n) = x
// that one phase has more makes x/3 for all, and x/3 turning with exp(-2j a) ... exp(2j a_n): its ripple's weight is
// x/3 exp(2j a_n).
static void change_of(enum dqw_fault_name name, int phase, double size, double at_rad, double change[])
{
    for (int i = 0; i < DQW_SIGNS; i++) change[i] = 0.0;
    const double twice = 2 * phase * 2 * PI / 3;
    switch (name) {
    case DQW_FAULT_DEMAGNETISATION: change[DQW_SIGN_PSI] = -size; break;
    case DQW_FAULT_ENCODER_OFFSET: change[DQW_SIGN_ANGLE] = size; break;
    case DQW_FAULT_INVERTER_FAULT: change[DQW_SIGN_DEAD_TIME] = size; break;
    case DQW_FAULT_RESISTANCE_RISE: change[DQW_SIGN_R] = size; break;
    case DQW_FAULT_VOLTAGE_SCALE:  // of all voltages: v = R i + L di/dt + w psi holds with all of them larger
        for (int i = DQW_SIGN_R; i <= DQW_SIGN_PSI; i++) change[i] = size;
        change[DQW_SIGN_DEAD_TIME] = size * DEAD_V;
        change[DQW_SIGN_MAP_D] = change[DQW_SIGN_MAP_Q] = size;
        break;
    case DQW_FAULT_CURRENT_OFFSET:
        change[DQW_SIGN_OFFSET_RE] = size * cos(at_rad);
        change[DQW_SIGN_OFFSET_IM] = size * sin(at_rad);
        break;
    case DQW_FAULT_PHASE_CONNECTION:  // `size` ohm in series with one phase
        change[DQW_SIGN_R] = size / 3 / R_OHM;
        change[DQW_SIGN_RESISTANCE_RE] = size / 3 * cos(twice);
        change[DQW_SIGN_RESISTANCE_IM] = size / 3 * sin(twice);
        break;
    case DQW_FAULT_CURRENT_GAIN:  // one sensor reads `size` of its current more: the machine seems to have less of everything
        for (int i = DQW_SIGN_R; i <= DQW_SIGN_LQ; i++) change[i] = -size / 3;
        // As at the mean speed: of -(R - j w L) the whole.
        const double X_ohm = (double)machine.w_e_rad_s * L_H;
        change[DQW_SIGN_RESISTANCE_RE] = -(R_OHM * cos(twice) + X_ohm * sin(twice)) * size / 3;
        change[DQW_SIGN_RESISTANCE_IM] = -(R_OHM * sin(twice) - X_ohm * cos(twice)) * size / 3;
        change[DQW_SIGN_REACTANCE_RE] = L_H * size / 3 * cos(twice);
        change[DQW_SIGN_REACTANCE_IM] = L_H * size / 3 * sin(twice);
        break;
    case DQW_FAULT_TURN_SHORT:  // `size` siemens across one phase: a third, shared by flux and ripple
        change[DQW_SIGN_PSI] = -R_OHM * size;
        change[DQW_SIGN_SHORT_RE] = size * cos(twice);
        change[DQW_SIGN_SHORT_IM] = size * sin(twice);
        break;
    default: TEST_FAIL();
    }
}

// The size of a fault whose change is `deviations` units long.
static double size_of(enum dqw_fault_name name, int phase, double deviations)
{
    double change[DQW_SIGNS];
    double sum = 0.0;
    change_of(name, phase, 1.0, 0.0, change);
    for (int i = 0; i < DQW_SIGNS; i++) sum += change[i] / UNIT[i] * (change[i] / UNIT[i]);
    return deviations / sqrt(sum);
}

static dqw_fault_verdict judge(const double change[], double noise, test_random *r)
{
    float x[DQW_SIGNS];
    float unit[DQW_SIGNS];
    for (int i = 0; i < DQW_SIGNS; i++) {
        unit[i] = (float)UNIT[i];
        x[i] = (float)(change[i] + (noise > 0.0 ? noise * UNIT[i] * random_normal(r) : 0.0));
    }
    return dqw_fault_name_it(x, unit, machine);
}

static void test_every_pattern_is_named_with_its_phase(void)
{
    static const double sizes[] = {1.0, 10.0, 1000.0};  // of a unit: naming has no threshold of its own
    static const float speeds_rad_s[] = {0.0f, 300.0f, -300.0f};
    test_random r = {1};
    for (int k = 0; k < PATTERNS_N; k++)
        for (int phase = 0; phase < (PATTERNS[k].phases ? 3 : 1); phase++)
            for (int s = 0; s < 18; s++) {
                machine.w_e_rad_s = speeds_rad_s[s / 6];
                const double sign = s % 6 < 3 ? 1.0 : -1.0;
                const double at_rad = random_uniform(&r, -PI, PI);
                double change[DQW_SIGNS];
                change_of(PATTERNS[k].name, phase, sign * size_of(PATTERNS[k].name, phase, sizes[s % 3]), at_rad,
                          change);
                const dqw_fault_verdict v = judge(change, 0.0, NULL);
                CASE("%s at %g rad/s, phase %d, %g units: name %d, phase %d, confidence %g", PATTERNS[k].text,
                     (double)machine.w_e_rad_s, phase, sign * sizes[s % 3], (int)v.name, v.phase, (double)v.confidence);
                if (sign > 0.0 || PATTERNS[k].both_signs) {
                    HOLDS(v.name == PATTERNS[k].name);
                    HOLDS(v.phase == phase);
                    BETWEEN(s % 3 == 0 ? 0.5 : 0.99, v.confidence, 1.00001);  // of one unit others explain a part
                } else {
                    HOLDS(v.name != PATTERNS[k].name);
                }
            }
    machine.w_e_rad_s = 0.0f;
}

// In whatever unit a change is given: of what lies in line with a pattern, the pattern leaves nothing.
static void test_a_pattern_explains_the_whole_of_itself(void)
{
    static const float units[] = {0.01f, 1.0f, 100.0f};
    for (int k = 0; k < 3; k++) {
        float change[DQW_SIGNS] = {0};
        float unit[DQW_SIGNS];
        for (int i = 0; i < DQW_SIGNS; i++) unit[i] = i == DQW_SIGN_PSI ? units[k] : 1e6f * units[k];
        change[DQW_SIGN_PSI] = -10.0f * units[k];
        const dqw_fault_verdict v = dqw_fault_name_it(change, unit, machine);
        CASE("unit %g", (double)units[k]);
        TEST_ASSERT_EQUAL_INT(DQW_FAULT_DEMAGNETISATION, v.name);
        BETWEEN(0.49, v.confidence, 1.00001);  // a short without its ripple explains it as well
    }
}

static void test_noise_on_every_sign_keeps_the_name(void)
{
    const int tries = scaled(3000);
    for (int k = 0; k < PATTERNS_N; k++)
        for (int phase = 0; phase < (PATTERNS[k].phases ? 3 : 1); phase++) {
            test_random r = {(uint64_t)(100 + 10 * k + phase)};
            int right = 0;
            int at_three = 0;
            for (int n = 0; n < tries; n++) {
                const double at_rad = random_uniform(&r, -PI, PI);
                double change[DQW_SIGNS];
                change_of(PATTERNS[k].name, phase, size_of(PATTERNS[k].name, phase, 10.0), at_rad, change);
                const dqw_fault_verdict v = judge(change, 1.0, &r);
                right += v.name == PATTERNS[k].name && v.phase == phase;
                change_of(PATTERNS[k].name, phase, size_of(PATTERNS[k].name, phase, 3.0), at_rad, change);
                const dqw_fault_verdict w = judge(change, 1.0, &r);
                at_three += w.name == PATTERNS[k].name && w.phase == phase;
            }
            CASE("%s, phase %d", PATTERNS[k].text, phase);
            BETWEEN(0.99, (double)right / tries, 1.0);
            // Three units among noise of one on 16 signs: it must not be sure.
            BETWEEN(0.05, (double)at_three / tries, 0.8);
        }
}

static void test_what_no_pattern_explains_is_unknown(void)
{
    // R of all phases; the inverter's loss, less of it; L_d; L_q; both L; R and flux both; flux up; two faults at once
    // with as much of each in R; a ripple that flux should have gone with.
    static const struct {
        const char *text;
        double z[DQW_SIGNS];
    } none[] = {{"R less", {[DQW_SIGN_R] = -10}},
                {"dead time less", {[DQW_SIGN_DEAD_TIME] = -10}},
                {"L_d", {[DQW_SIGN_LD] = -10}},
                {"L_q", {[DQW_SIGN_LQ] = 10}},
                {"the map on d", {[DQW_SIGN_MAP_D] = 10}},
                {"R, L and flux as of the voltage, and not the map",
                 {[DQW_SIGN_R] = 10,
                  [DQW_SIGN_LD] = 10,
                  [DQW_SIGN_LQ] = 10,
                  [DQW_SIGN_PSI] = 10,
                  [DQW_SIGN_MAP_D] = -20,
                  [DQW_SIGN_MAP_Q] = -20}},
                {"flux up", {[DQW_SIGN_PSI] = 10}},
                {"R and demagnetisation", {[DQW_SIGN_R] = 10, [DQW_SIGN_PSI] = -10}},
                {"dead time and offset, R", {[DQW_SIGN_R] = 10, [DQW_SIGN_DEAD_TIME] = 8, [DQW_SIGN_OFFSET_RE] = 8}},
                {"dead time and angle", {[DQW_SIGN_DEAD_TIME] = 10, [DQW_SIGN_ANGLE] = -10}},
                {"connection of phase c, and flux",
                 {[DQW_SIGN_RESISTANCE_RE] = -6, [DQW_SIGN_RESISTANCE_IM] = 10.4, [DQW_SIGN_PSI] = -10}},
                {"offset and angle", {[DQW_SIGN_OFFSET_IM] = 10, [DQW_SIGN_ANGLE] = 10}}};
    for (unsigned k = 0; k < sizeof none / sizeof none[0]; k++) {
        double change[DQW_SIGNS];
        for (int i = 0; i < DQW_SIGNS; i++) change[i] = none[k].z[i] * UNIT[i];
        const dqw_fault_verdict v = judge(change, 0.0, NULL);
        CASE("%s: name %d, confidence %g", none[k].text, (int)v.name, (double)v.confidence);
        HOLDS(v.name == DQW_FAULT_UNKNOWN);
        HOLDS(v.phase == 0);
        BETWEEN(0.4, v.confidence, 1.0);
    }
}

// The share that a name must explain: 60 % of the changes' squares.
static void test_a_foreign_part_takes_the_name_away_where_it_is_large(void)
{
    for (int percent = 0; percent <= 100; percent++) {
        if (percent == 60) continue;
        double change[DQW_SIGNS] = {0};
        change[DQW_SIGN_DEAD_TIME] = 10 * sqrt(percent / 100.0) * UNIT[DQW_SIGN_DEAD_TIME];
        change[DQW_SIGN_LD] = 10 * sqrt(1 - percent / 100.0) * UNIT[DQW_SIGN_LD];
        const dqw_fault_verdict v = judge(change, 0.0, NULL);
        CASE("%d %% dead time: name %d", percent, (int)v.name);
        HOLDS(v.name == (percent > 60 ? DQW_FAULT_INVERTER_FAULT : DQW_FAULT_UNKNOWN));
        if (percent > 60) BETWEEN(percent / 100.0 - 1e-3, v.confidence, percent / 100.0 + 1e-3);
    }
}

// Two patterns that lie 45 degrees apart: between them the confidence falls to half of what the name explains.
static void test_confidence_falls_where_two_names_fit(void)
{
    float unit[DQW_SIGNS];
    for (int i = 0; i < DQW_SIGNS; i++) unit[i] = (float)UNIT[i];
    unit[DQW_SIGN_SHORT_RE] = unit[DQW_SIGN_SHORT_IM] = (float)(UNIT[DQW_SIGN_PSI] / R_OHM);
    int close = 0;
    for (int quarter = -80; quarter <= 440; quarter++) {
        // 0: flux alone, which is demagnetisation; 45: a turn short.
        const double degree = (quarter + 0.25) / 4;
        const double angle = degree * PI / 180;
        float change[DQW_SIGNS] = {0};
        change[DQW_SIGN_PSI] = (float)(-10 * cos(angle)) * unit[DQW_SIGN_PSI];
        change[DQW_SIGN_SHORT_RE] = (float)(10 * sin(angle)) * unit[DQW_SIGN_SHORT_RE];
        const double magnet = cos(angle) > 0 ? pow(cos(angle), 2) : 0.0;
        const double turns = pow(cos(angle - PI / 4), 2);
        const double most = fmax(magnet, turns);
        if (fabs(most - 0.6) < 0.01) continue;
        const dqw_fault_verdict v = dqw_fault_name_it(change, unit, machine);
        CASE("%g degrees: flux alone explains %g, turns %g; name %d", degree, magnet, turns, (int)v.name);
        HOLDS(v.name == (most < 0.6       ? DQW_FAULT_UNKNOWN
                         : magnet > turns ? DQW_FAULT_DEMAGNETISATION
                                          : DQW_FAULT_TURN_SHORT));
        const double lead = fmin(100 * fabs(magnet - turns) / (2 + 0.01 * 100), 1.0);  // of 10 units, squared
        const double expected = most < 0.6 ? 1 - most : most * (0.5 + 0.5 * lead);
        BETWEEN(expected - 1e-3, v.confidence, expected + 1e-3);
        close += most >= 0.6 && lead < 1.0;
    }
    BETWEEN(6, close, 12);  // at 10 it is torn: 3 of 100 sin 45 sin 2 x, both ways
}

// A voltage that reads 3 % more, of which L_d says more or less: a scale as long as that leaves less than 16, with a map's
// weights 20, and a fiftieth of what the scale explains.
static void test_a_scale_leaves_little(void)
{
    for (int map = 0; map < 2; map++)
        for (int step = 0; step < 240; step++) {
            float x[DQW_SIGNS] = {0};
            float unit[DQW_SIGNS];
            double p[DQW_SIGNS] = {0};
            for (int i = DQW_SIGN_R; i <= DQW_SIGN_PSI; i++) p[i] = 1.0;
            p[DQW_SIGN_DEAD_TIME] = DEAD_V;
            p[DQW_SIGN_MAP_D] = p[DQW_SIGN_MAP_Q] = map;
            double zq = 0.0;
            double qq = 0.0;
            double zz = 0.0;
            for (int i = 0; i < DQW_SIGNS; i++) {
                const bool known = map || (i != DQW_SIGN_MAP_D && i != DQW_SIGN_MAP_Q);
                unit[i] = (float)(known ? UNIT[i] : 1e30);
                x[i] = (float)(0.03 * p[i] + (i == DQW_SIGN_LD ? 0.025 * step * UNIT[i] : 0.0));
                const double z = x[i] / unit[i];
                const double q = p[i] / unit[i];
                zq += z * q, qq += q * q, zz += z * z;
            }
            const double said = zq * zq / qq;
            const double left = zz - said;
            const double most = (map ? 20.0 : 16.0) + 0.02 * said;
            if (fabs(left / most - 1.0) < 0.02) continue;
            CASE("map %d, L_d %d steps: left %g of %g", map, step, left, most);
            HOLDS((dqw_fault_name_it(x, unit, machine).name == DQW_FAULT_VOLTAGE_SCALE) == (left < most));
        }
}

static void test_a_change_that_is_not_known_counts_for_nothing(void)
{
    // R's deviation is a million units: whatever it changed by, the ripple alone names the connection.
    double change[DQW_SIGNS];
    change_of(DQW_FAULT_PHASE_CONNECTION, 1, size_of(DQW_FAULT_PHASE_CONNECTION, 1, 20.0), 0.0, change);
    change[DQW_SIGN_R] = -0.3;
    float x[DQW_SIGNS];
    float unit[DQW_SIGNS];
    for (int i = 0; i < DQW_SIGNS; i++) {
        x[i] = (float)change[i];
        unit[i] = (float)(i == DQW_SIGN_R ? 1e6 * UNIT[i] : UNIT[i]);
    }
    const dqw_fault_verdict v = dqw_fault_name_it(x, unit, machine);
    TEST_ASSERT_EQUAL_INT(DQW_FAULT_PHASE_CONNECTION, v.name);
    TEST_ASSERT_EQUAL_UINT8(1, v.phase);
}

// With an observer's angle L_q is the observer's own: of a voltage that reads 10 % more it may say anything, and L_d and
// the flux say it. It is no scale where L_d or R contradicts, nor where an encoder's L_q does.
static void test_an_observers_L_q_does_not_contradict_a_scale(void)
{
    for (int encoder = 0; encoder < 2; encoder++)
        for (int against = 0; against < 3; against++) {
            float x[DQW_SIGNS] = {0};
            float unit[DQW_SIGNS];
            for (int i = 0; i < DQW_SIGNS; i++) unit[i] = (float)UNIT[i];
            for (int i = DQW_SIGN_R; i <= DQW_SIGN_PSI; i++) x[i] = 0.1f;
            x[DQW_SIGN_MAP_D] = x[DQW_SIGN_MAP_Q] = 0.1f;
            x[DQW_SIGN_DEAD_TIME] = 0.1f * (float)DEAD_V;
            const int other[] = {DQW_SIGN_LQ, DQW_SIGN_R, DQW_SIGN_LD};
            x[other[against]] = against == 0 ? 0.25f : 0.0f;
            const dqw_fault_verdict v = dqw_fault_name_it(
                x, unit, (dqw_fault_machine){(float)R_OHM, (float)L_H, 0.0f, encoder == 0, (float)DEAD_V});
            CASE("encoder %d, sign %d: name %d, confidence %g", encoder, other[against], (int)v.name,
                 (double)v.confidence);
            HOLDS((v.name == DQW_FAULT_VOLTAGE_SCALE) == (encoder == 0 && against == 0));
        }
    // Of itself it says nothing.
    float x[DQW_SIGNS] = {[DQW_SIGN_LQ] = 0.25f};
    float unit[DQW_SIGNS];
    for (int i = 0; i < DQW_SIGNS; i++) unit[i] = (float)UNIT[i];
    TEST_ASSERT_EQUAL_INT(
        DQW_FAULT_UNKNOWN,
        dqw_fault_name_it(x, unit, (dqw_fault_machine){(float)R_OHM, (float)L_H, 0.0f, true, 0.0f}).name);
}

// A flux 8 % less of which neither L says anything: whether it is the magnet's or the voltage's, R and dead time tell,
// both of them 8 % less or neither. R that comes down as the dead time goes up, as one is taken for the other, is no
// voltage's scale; and of what is hardly known neither name is sure.
static void test_R_and_dead_time_tell_a_magnet_from_a_voltage(void)
{
    static const struct {
        double R, dead_time, wider;
        enum dqw_fault_name name;
        bool sure;
    } cases[] = {{0, 0, 1, DQW_FAULT_DEMAGNETISATION, true},
                 {-0.08, -0.08, 1, DQW_FAULT_VOLTAGE_SCALE, true},
                 {-0.08, 0.11, 1, DQW_FAULT_DEMAGNETISATION, true},
                 {0, 0, 10, DQW_FAULT_DEMAGNETISATION, false},
                 {-0.08, -0.08, 10, DQW_FAULT_VOLTAGE_SCALE, false}};
    machine.observed = true;
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        float x[DQW_SIGNS] = {0};
        float unit[DQW_SIGNS];
        for (int i = 0; i < DQW_SIGNS; i++) unit[i] = (float)UNIT[i];
        unit[DQW_SIGN_LD] = unit[DQW_SIGN_LQ] = unit[DQW_SIGN_MAP_D] = unit[DQW_SIGN_MAP_Q] = DQW_UNKNOWN;
        unit[DQW_SIGN_R] = (float)(0.03 * cases[k].wider);
        unit[DQW_SIGN_DEAD_TIME] = (float)(0.04 * DEAD_V * cases[k].wider);
        x[DQW_SIGN_PSI] = -0.08f;
        x[DQW_SIGN_R] = (float)cases[k].R;
        x[DQW_SIGN_DEAD_TIME] = (float)(cases[k].dead_time * DEAD_V);
        const dqw_fault_verdict v = dqw_fault_name_it(x, unit, machine);
        CASE("R %g, dead time %g: name %d, confidence %g", cases[k].R, cases[k].dead_time, (int)v.name,
             (double)v.confidence);
        HOLDS(v.name == cases[k].name);
        HOLDS((v.confidence > 0.8f) == cases[k].sure);
    }
    machine.observed = false;
}

static void test_zeros_and_no_numbers_are_unknown_without_confidence(void)
{
    const double zeros[DQW_SIGNS] = {0};
    dqw_fault_verdict v = judge(zeros, 0.0, NULL);
    TEST_ASSERT_EQUAL_INT(DQW_FAULT_UNKNOWN, v.name);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, v.confidence);
    static const double bad[] = {NAN, INFINITY, -INFINITY, 1e38};
    for (int b = 0; b < 4; b++)
        for (int i = 0; i < DQW_SIGNS; i++) {
            double change[DQW_SIGNS];
            change_of(DQW_FAULT_DEMAGNETISATION, 0, 0.1, 0.0, change);
            change[i] = bad[b];
            v = judge(change, 0.0, NULL);
            CASE("sign %d is %g: name %d, confidence %g", i, bad[b], (int)v.name, (double)v.confidence);
            HOLDS(v.name == DQW_FAULT_UNKNOWN && v.confidence == 0.0f && v.phase == 0);
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_pattern_is_named_with_its_phase);
    RUN_TEST(test_a_pattern_explains_the_whole_of_itself);
    RUN_TEST(test_noise_on_every_sign_keeps_the_name);
    RUN_TEST(test_what_no_pattern_explains_is_unknown);
    RUN_TEST(test_a_foreign_part_takes_the_name_away_where_it_is_large);
    RUN_TEST(test_confidence_falls_where_two_names_fit);
    RUN_TEST(test_a_scale_leaves_little);
    RUN_TEST(test_a_change_that_is_not_known_counts_for_nothing);
    RUN_TEST(test_an_observers_L_q_does_not_contradict_a_scale);
    RUN_TEST(test_R_and_dead_time_tell_a_magnet_from_a_voltage);
    RUN_TEST(test_zeros_and_no_numbers_are_unknown_without_confidence);
    return UNITY_END();
}
