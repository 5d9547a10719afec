// The fixed-point estimator beside the float one and the truth: legs that rest, dead time on one side, an encoder that
// is off and one that is late; what the interrupt gathers of a leg that rests, and how a block and the weights are
// turned.
#include "dqw_estimator_block.h"
#include "dqw_estimator_block_q15.h"
#include "dqw_estimator_search.h"
#include "dqw_estimator_search_q15.h"
#include "dqw_monitor_q15.h"
#include "resting_joint.h"
#include "twin_estimator.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { MODULATIONS = 5 };
static const char *const MODULATION[MODULATIONS] = {"centred", "clamped low", "clamped high", "clamped 60", "mask"};

static void configure_resting(pair *p, enum dqw_modulation modulation)
{
    configure(p, 0.0, 0.2);
    p->fc.R_ohm = (float)(1.05 * RESTING_MACHINE[0]);
    p->fc.Ld_H = (float)(1.05 * RESTING_MACHINE[1]);
    p->fc.Lq_H = (float)(1.05 * RESTING_MACHINE[2]);
    p->fc.psi_Wb = (float)(1.05 * RESTING_MACHINE[3]);
    p->qc.R_uohm = (uint32_t)lrint(1e6 * (double)p->fc.R_ohm);
    p->qc.Ld_nH = (uint32_t)lrint(1e9 * (double)p->fc.Ld_H);
    p->qc.Lq_nH = (uint32_t)lrint(1e9 * (double)p->fc.Lq_H);
    p->qc.psi_nWb = (uint32_t)lrint(1e9 * (double)p->fc.psi_Wb);
    p->fc.modulation = p->qc.modulation = modulation;
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

// Both see the joint, whose commands that no leg makes are refused.
static void learn(pair *p, const resting_joint *j, double seconds)
{
    begin(p);
    const long rows = lrint(seconds / RESTING_DT_S);
    for (long k = 0; k < rows; k++) {
        bool made;
        const dqw_sample s = resting_sample(j, k, &made);
        const dqw_sample_q15 r = rounded(&s);
        if (dqw_estimator_sample(&p->f, &s, !made) & DQW_EVENT_BLOCK) (void)dqw_estimator_background(&p->f);
        if (dqw_estimator_sample_q15(&p->q, &r, !made) & DQW_EVENT_BLOCK) (void)dqw_estimator_background_q15(&p->q);
    }
    HOLDS(p->f.restarts == 0 && p->q.restarts == 0);
}

// Percent of the truth, and of the float estimator.
static void near(const pair *p, const resting_joint *j, double most, double apart)
{
    for (int i = 0; i < 4; i++) {
        CASE("%s, %g V and %g V, off %g rad, late %g s: %s", MODULATION[j->modulation], j->dead_V, j->constant_V,
             j->off_rad, j->late_s, NAME[i]);
        BETWEEN(-most, 100 * (q_value(p, i) / j->machine[i] - 1), most);
        BETWEEN(-apart, 100 * (q_value(p, i) / f_value(p, i) - 1), apart);
        // As noise makes it: what lasts may be just below notice in one of them.
        const double q_noise = ldexp((double)dqw_estimator_noise_sd_q24(&p->q, i), 16) * q_unit(p, i);
        BETWEEN(0.75, q_noise / (double)dqw_estimator_noise_sd(&p->f, i), 1.35);  // 0.80 to 1.09
    }
}

static void test_a_leg_that_rests_has_no_dead_time(void)
{
    for (int m = 0; m < MODULATIONS; m++)
        for (int way = 0; way < 4; way++) {
            // On both sides, overcompensated, on one side or the other.
            const double dead_V = way == 1 ? -0.24 : 0.24;
            const double constant_V = way < 2 || m == 0 ? 0.0 : way == 2 ? -0.24 : 0.24;
            const resting_joint j = joint_of((enum dqw_modulation)m, dead_V, constant_V);
            pair p;
            configure_resting(&p, j.modulation);
            learn(&p, &j, 2.0);
            near(&p, &j, 0.02, 0.01);                                    // 0.008, 0.001
            BETWEEN(0.998, q_value(&p, DQW_DEAD_TIME) / dead_V, 1.002);  // 1.0006
            BETWEEN(-0.004, (q_value(&p, DQW_DEAD_CONSTANT) - constant_V) / 0.24, 0.004);
            BETWEEN(-5e-4, (q_value(&p, DQW_DEAD_CONSTANT) - f_value(&p, DQW_DEAD_CONSTANT)) / 0.24, 5e-4);
            HOLDS(dqw_estimator_read_q15(&p.q, DQW_DEAD_TIME).usable);
            HOLDS(dqw_estimator_read_q15(&p.q, DQW_DEAD_CONSTANT).usable == (constant_V != 0.0));
            HOLDS((q_sd(&p, DQW_DEAD_CONSTANT) < 1e30) == (m != 0));
            if (m == 0 || way != 0) continue;
            p.qc.modulation = p.fc.modulation = DQW_MODULATION_CENTRED;
            learn(&p, &j, 2.0);
            BETWEEN(0.5, q_value(&p, DQW_DEAD_TIME) / dead_V, 0.75);
            BETWEEN(0.25, fabs(100 * (q_value(&p, DQW_R) / j.machine[0] - 1)), 2.0);
        }
}

static void test_an_angle_that_is_off_or_late(void)
{
    for (int way = 0; way < 6; way++) {
        resting_joint j = joint_of(way % 2 ? DQW_MODULATION_CLAMPED_60 : DQW_MODULATION_CENTRED, 0.24, 0.0);
        j.off_rad = way / 2 == 1 ? 0.0 : way % 2 ? -0.12 : 0.12;
        j.late_s = way / 2 == 0 ? 0.0 : 0.5 * RESTING_DT_S;
        pair p;
        configure_resting(&p, j.modulation);
        p.fc.angle_late_s = (float)j.late_s;
        p.qc.angle_late_ns = (int32_t)lrint(1e9 * j.late_s);
        p.fc.follow = p.qc.follow = true;
        const bool off = j.off_rad != 0.0;
        // What was learned before the turn counts for as long again.
        learn(&p, &j, off ? 8.0 : 4.0);
        near(&p, &j, off ? 0.08 : 0.02, off ? 0.05 : 0.02);  // 0.060, 0.025
        BETWEEN(-5e-4, q_value(&p, DQW_PSI_Q) / j.machine[3] - sin(j.off_rad), 5e-4);
        BETWEEN(-5e-4, (q_value(&p, DQW_PSI_Q) - f_value(&p, DQW_PSI_Q)) / j.machine[3], 5e-4);
        BETWEEN(-5e-4, ldexp(p.q.turn_sine_q30, -30) - (double)p.f.turn_sine, 5e-4);
        BETWEEN(-0.01, asin(ldexp(p.q.turn_sine_q30, -30)) + j.off_rad, 0.01);
    }
}

// Each pair's signals of dead time and of the leg that rests, as the float interrupt gathers them. Which leg it is may
// differ where two phases are alike.
static void test_what_a_pair_takes_of_a_leg_that_rests(void)
{
    for (int m = 0; m < MODULATIONS; m++)
        for (int next = 0; next < 2; next++) {
            pair p;
            configure_resting(&p, (enum dqw_modulation)m);
            p.fc.voltage_next = p.qc.voltage_next = next == 1;
            p.fc.half_window = p.qc.half_window = 100;
            begin(&p);
            test_random r = {(uint64_t)(5 + m)};
            double before[2][4] = {{0}};
            int unlike = 0;
            double rested = 0.0;
            for (int k = 0; k < 20000; k++) {
                const double theta = random_uniform(&r, -PI, PI) * 0.02 + 0.05 * k;
                dqw_sample s = dqw_sample_from_dq((float)random_uniform(&r, -20, 20),
                                                  (float)random_uniform(&r, -20, 20), (float)random_uniform(&r, -2, 2),
                                                  (float)random_uniform(&r, -2, 2),
                                                  (float)random_uniform(&r, -100, 100), (float)theta);
                s.resting = (uint8_t)(random_bits(&r) & 255);
                const dqw_sample_q15 q = rounded(&s);
                (void)dqw_estimator_sample(&p.f, &s, k % 50 == 49);
                (void)dqw_estimator_sample_q15(&p.q, &q, k % 50 == 49);
                if (p.q.window.at == 0) {
                    p.q.window.over.pending = p.f.window.over.pending = false;
                    memset(before, 0, sizeof before);
                    memset(p.q.window.part, 0, sizeof p.q.window.part);
                    memset(p.f.window.part, 0, sizeof p.f.window.part);
                    continue;
                }
                double off = 0.0;
                for (int i = 0; i < 4; i++) {
                    const double f = (double)p.f.window.part[p.f.window.over.now].cell[DQW_BLOCK_SIGNALS + i].sum;
                    const double x = ldexp(p.q.window.part[p.q.window.over.now].cell[DQW_BLOCK_Q15_SIGNALS + i].sum,
                                           -15);
                    const double one = x - before[1][i];
                    // What the window is told that it takes.
                    HOLDS(fabs(one) <= 4.0);
                    off = fmax(off, fabs(one - (f - before[0][i])));
                    if (i == 2) rested += one * one;
                    before[0][i] = f;
                    before[1][i] = x;
                }
                if (off > 5e-3) unlike++;
            }
            CASE("%s, next %d: %d unlike, %g", MODULATION[m], next, unlike, rested);
            HOLDS(unlike <= (m == 0 || m == 4 ? 0 : 20));
            HOLDS((rested > 1000) == (m != 0));
        }
}

// A block's sums to their last place, however full they are.
static void test_a_block_is_turned(void)
{
    test_random r = {31};
    for (int k = 0; k < 3000; k++) {
        pair p;
        configure_resting(&p, DQW_MODULATION_CENTRED);
        const bool late = k % 2 == 0;
        p.qc.angle_late_ns = late ? (int32_t)random_uniform(&r, -100000, 100000) : 0;
        if (k % 7 == 0) p.qc.scale.pole_pairs = 0;
        // Almost a radian in a period at full speed.
        if (k % 3 == 0 && k % 7 != 0) p.qc.scale.w_full_mrad_s = 4990000;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
        const double off = k % 5 == 0 ? 0.0 : random_uniform(&r, -PI, PI);
        p.q.turn_cosine_q30 = (int32_t)lrint(ldexp(cos(off), 30));
        p.q.turn_sine_q30 = (int32_t)lrint(ldexp(sin(off), 30));
        dqw_estimator_q15_block b = {.weight = (uint16_t)(1 + random_bits(&r) % 10100)};
        const double full = b.weight * 131072.0;
        for (int i = 0; i < DQW_PLAIN_Q15_SIGNALS; i++)
            b.sums[i] = (int32_t)(full * (k % 11 == 0 ? (random_bits(&r) % 2 ? 1 : -1) : random_uniform(&r, -1, 1)));
        b.sums[8] = (int32_t)(b.weight * 65532.0 * random_uniform(&r, -1, 1));
        for (int i = 0; i < 2; i++) b.v_step_q15[i] = (int32_t)random_uniform(&r, -3e6, 3e6);
        const double theta = random_uniform(&r, -PI, PI);
        b.with.cosine_q15 = (int16_t)lrint(32767 * cos(theta));
        b.with.sine_q15 = (int16_t)lrint(32767 * sin(theta));
        dqw_estimator_q15_block t = b;
        dqw_estimator_turn_block_q15(&p.q, &t);
        const double periods = p.q.pole_pairs == 0 ? 0.0 : p.qc.angle_late_ns / 50000.0;
        const double w = b.sums[8] / (65536.0 * b.weight);
        const double by = off + periods * w * p.qc.scale.w_full_mrad_s * 4e-3 * 5e-5;
        CASE("block %d, by %g, weight %d", k, by, b.weight);
        // The speed is good to 28 bits, its cosine and sine to 25: 3e-8 of 2 rad.
        const double most = 2.0 + (late ? 1e-7 * full : 4e-9 * full);
        for (int i = 0; i < DQW_PLAIN_Q15_SIGNALS + 2; i++) {
            if (i == 8) continue;
            const int32_t *from = i < 8 ? &b.sums[i & ~1] : i < 13 ? &b.sums[9 + ((i - 9) & ~1)] : b.v_step_q15;
            const int32_t *to = i < 8 ? &t.sums[i & ~1] : i < 13 ? &t.sums[9 + ((i - 9) & ~1)] : t.v_step_q15;
            BETWEEN(-most, to[0] - (cos(by) * from[0] + sin(by) * from[1]), most);
            BETWEEN(-most, to[1] - (cos(by) * from[1] - sin(by) * from[0]), most);
        }
        HOLDS(t.sums[8] == b.sums[8] && t.weight == b.weight);
        BETWEEN(-1.6, t.with.cosine_q15 - 32767 * cos(theta + by), 1.6);
        BETWEEN(-1.6, t.with.sine_q15 - 32767 * sin(theta + by), 1.6);
    }
    // What would not fit stops at the largest.
    pair p;
    configure_resting(&p, DQW_MODULATION_CENTRED);
    begin(&p);
    p.q.turn_cosine_q30 = p.q.turn_sine_q30 = 759250125;
    dqw_estimator_q15_block b = {.weight = 1,
                                 .sums = {INT32_MAX, INT32_MAX, INT32_MIN, INT32_MIN, INT32_MIN, INT32_MAX}};
    dqw_estimator_turn_block_q15(&p.q, &b);
    HOLDS(b.sums[0] == INT32_MAX && b.sums[2] == INT32_MIN && b.sums[5] == INT32_MAX && abs(b.sums[1]) < 8);
}

// Both have seen the voltage act so many periods late.
static void acts(pair *p, int periods)
{
    const int n = p->q.inputs;
    p->q.normal.a_q32[DQW_NORMAL_A(n, n)] = (int64_t)100 << 32;
    p->q.normal.b_q32[n] = (int64_t)(100 * periods) << 32;
    p->f.late_pu2 = 1.0f;
    p->f.late_error_pu2 = (float)periods;
    HOLDS(dqw_estimator_voltage_acts_q15(&p->q) == (periods ? DQW_VOLTAGE_NEXT : DQW_VOLTAGE_NOW));
    HOLDS(dqw_estimator_voltage_acts(&p->f) == (periods ? DQW_VOLTAGE_NEXT : DQW_VOLTAGE_NOW));
}

// The same of a late voltage of which the flux on the other axis is so much a part.
static void acts_with(pair *p, double part)
{
    const int n = p->q.inputs;
    dqw_normal_q15 *m = &p->q.normal;
    for (int i = 0; i <= n; i++)
        for (int j = i; j <= n; j++) m->a_q32[DQW_NORMAL_A(i, j)] = i == j ? (int64_t)1000 << 32 : 0;
    for (int i = 0; i < n; i++) m->b_q32[i] = 0;
    acts(p, 1);
    const double of_late = part * p->q.w_q24[DQW_PSI_Q] / 16777216.0;
    m->a_q32[DQW_NORMAL_A(DQW_PSI_Q, n)] = llrint(ldexp(1000 * of_late, 32));
    m->a_q32[DQW_NORMAL_A(n, n)] += llrint(ldexp(1000 * of_late * of_late, 32));
    p->f.late_w[DQW_PSI_Q] = (float)part * p->f.w_pu[DQW_PSI_Q];
    HOLDS(dqw_estimator_voltage_acts_q15(&p->q) == DQW_VOLTAGE_NEXT);
}

// The flux found on both axes is along one of them from then on, to a few last places; the flux on the other axis is
// told as it was. What was learned is as much less sure as in float; the sums stay around the weights.
static void test_the_weights_are_turned(void)
{
    test_random r = {41};
    for (int k = 0; k < 200; k++) {
        pair p;
        configure_resting(&p, DQW_MODULATION_CENTRED);
        // The same bases.
        begin(&p);
        for (long n = 0; n < 1000; n++) {
            const dqw_sample s = moving(n, 0.5, 0.003, &r);
            (void)step(&p, &s);
        }
        dqw_units_q15 u;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_units_of_q15(&p.qc, 4, &u));
        const double about = random_uniform(&r, 0.02, 0.4) * (k % 2 ? 1 : -1);
        const double had = k % 3 == 0 ? 0.0 : random_uniform(&r, -PI, PI);
        const int32_t psi = (int32_t)lrint(ldexp(cos(about), 24) * random_uniform(&r, 0.2, 3));
        const int32_t across = (int32_t)lrint(psi * tan(about));
        const double off = atan2(across, psi);
        p.q.turn_cosine_q30 = (int32_t)lrint(ldexp(cos(had), 30));
        p.q.turn_sine_q30 = (int32_t)lrint(ldexp(sin(had), 30));
        p.f.turn_cosine = (float)cos(had);
        p.f.turn_sine = (float)sin(had);
        p.q.w_q24[DQW_PSI] = psi;
        p.q.w_q24[DQW_PSI_Q] = across;
        for (int i = DQW_LD; i <= DQW_LQ; i++) p.q.w_q24[i] = (int32_t)ldexp(random_uniform(&r, 0.3, 3), 24);
        for (int i = 0; i < 6; i++)
            p.f.w_pu[i] = (float)(ldexp(p.q.w_q24[i], 16) * q_unit(&p, i) / (double)dqw_estimator_unit(&p.f, i));
        p.q.learned = p.f.learned = 63;
        p.q.blocks = p.f.blocks = 1000;
        p.q.cov_q40[DQW_PSI_Q] = (int64_t)1 << 30;
        p.f.gain.d[DQW_PSI_Q] = 1e-3f;
        for (int axis = 0; axis < 2; axis++) {
            p.q.error_q56[axis] = (int64_t)ldexp(1e-6, 56);
            p.f.error_pu2[axis] = 1e-6f;
        }
        const double tells = ldexp(dqw_estimator_value_q24(&p.q, DQW_PSI_Q), -24);
        int64_t cov[3];
        float var[3];
        for (int i = 0; i < 3; i++) {
            cov[i] = p.q.cov_q40[i];
            var[i] = dqw_gain_covariance(&p.f.gain, i, i);
        }
        // Not before it has lasted, and the weights were solved.
        p.q.across = p.f.across = 98;
        dqw_estimator_turn_on_q15(&p.q, &u, true);
        dqw_estimator_turn_on(&p.f);
        HOLDS(p.q.w_q24[DQW_PSI] == psi && p.q.across == 99 && p.f.across == 99);
        dqw_estimator_turn_on_q15(&p.q, &u, false);
        HOLDS(p.q.w_q24[DQW_PSI] == psi && p.q.across == 100);
        // Where it does not show any more it begins to last anew.
        pair other = p;
        other.q.w_q24[DQW_PSI_Q] = 0;
        other.f.w_pu[DQW_PSI_Q] = 0.0f;
        dqw_estimator_turn_on_q15(&other.q, &u, true);
        dqw_estimator_turn_on(&other.f);
        HOLDS(other.q.across == 0 && other.f.across == 0);
        // Nor where a voltage that acts in another period than is said leaves less than half of it.
        static const double parts[] = {1, 0.6, 0.4, 0};
        for (int m = 0; m < 4; m++) {
            other = p;
            acts_with(&other, parts[m]);
            dqw_estimator_turn_on_q15(&other.q, &u, true);
            dqw_estimator_turn_on(&other.f);
            CASE("%d: the voltage has %g of it", k, parts[m]);
            HOLDS(other.q.across == 0 && other.f.across == 0);
            HOLDS(other.q.w_q24[DQW_PSI_Q] == (parts[m] > 0.5 ? across : 0));
            HOLDS(other.f.w_pu[DQW_PSI_Q] == (parts[m] > 0.5 ? p.f.w_pu[DQW_PSI_Q] : 0.0f));
        }
        // Nor where it begins to show later than in three segments: then it is a change. What began before goes on.
        for (int way = 0; way < 4; way++) {
            const int segments = way % 2 + 2;
            const bool began = way >= 2;
            other = p;
            other.qc.follow = other.fc.follow = true;
            other.q.config = &other.qc, other.f.config = &other.fc;
            other.q.segment.segments = other.f.segment.segments = (uint16_t)segments;
            if (!began) other.q.across = other.f.across = 0;
            for (int n = 0; n < (began ? 1 : 100); n++) {
                dqw_estimator_turn_on_q15(&other.q, &u, true);
                dqw_estimator_turn_on(&other.f);
            }
            HOLDS((other.q.w_q24[DQW_PSI_Q] == 0) == (began || segments < 3));
            HOLDS((other.f.w_pu[DQW_PSI_Q] == 0.0f) == (began || segments < 3));
        }
        if (k % 2) acts(&p, 0);
        dqw_estimator_turn_on_q15(&p.q, &u, true);
        dqw_estimator_turn_on(&p.f);
        CASE("%d: off by %g rad from %g", k, off, had);
        HOLDS(p.q.w_q24[DQW_PSI_Q] == 0 && p.f.w_pu[DQW_PSI_Q] == 0.0f && p.q.across == 0);
        BETWEEN(-1.5, p.q.w_q24[DQW_PSI] - hypot(psi, across), 1.5);
        BETWEEN(-1e-8, ldexp(p.q.turn_cosine_q30, -30) - cos(had - off), 1e-8);
        BETWEEN(-1e-8, ldexp(p.q.turn_sine_q30, -30) - sin(had - off), 1e-8);
        BETWEEN(-1e-6, (double)p.f.turn_sine - sin(had - off), 1e-6);
        // As the angle came: what was told before.
        BETWEEN(-2e-6, ldexp(dqw_estimator_value_q24(&p.q, DQW_PSI_Q), -24) - tells, 2e-6);
        for (int i = 0; i < 3; i++) {
            const double unit = ldexp(1.0, 40) * q_unit(&p, i) / (double)dqw_estimator_unit(&p.f, i);
            const double more = ldexp((double)(p.q.cov_q40[i] - cov[i]), -40) * unit * unit;
            // The sums hold no more.
            const double most = 2097152.0 * unit * unit;
            BETWEEN(0.999, more / fmin((double)(dqw_gain_covariance(&p.f.gain, i, i) - var[i]), most), 1.001);
        }
        for (int i = 0; i < 6; i++) HOLDS(p.q.normal.b_q32[i] == 0);
    }
}

// Turned a thousand times it is still a direction, and what is told of the angle is the sum.
static void test_many_turns_keep_their_length(void)
{
    pair p;
    configure_resting(&p, DQW_MODULATION_CENTRED);
    begin(&p);
    dqw_units_q15 u;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_units_of_q15(&p.qc, 4, &u));
    test_random r = {43};
    double sum = 0.0;
    for (int k = 0; k < 20000; k++) {
        const double off = random_uniform(&r, 0.02, 0.3) * (random_bits(&r) % 2 ? 1 : -1);
        p.q.w_q24[DQW_PSI] = (int32_t)lrint(ldexp(cos(off), 24));
        p.q.w_q24[DQW_PSI_Q] = (int32_t)lrint(ldexp(sin(off), 24));
        p.q.learned = 63;
        p.q.blocks = 1000;
        p.q.cov_q40[DQW_PSI_Q] = 1;
        p.q.across = 99;
        dqw_estimator_turn_on_q15(&p.q, &u, true);
        sum -= off;
        CASE("turn %d", k);
        HOLDS(p.q.w_q24[DQW_PSI_Q] == 0);
        BETWEEN(-1e-8, hypot(p.q.turn_cosine_q30, p.q.turn_sine_q30) / 1073741824.0 - 1, 1e-8);
        const double apart = remainder(atan2(p.q.turn_sine_q30, p.q.turn_cosine_q30) - sum, 2 * PI);
        BETWEEN(-1e-5, apart, 1e-5);
    }
}

// Where the voltage is known to act in another period than is said, that turns the frame too, and nothing is turned;
// nor in stage 2's first blocks, of settled rows, without the weight, or of less than a hundredth.
static void test_what_is_not_turned(void)
{
    for (int way = 0; way < 7; way++) {
        pair p;
        configure_resting(&p, DQW_MODULATION_CENTRED);
        if (way == 1) p.qc.encoder_offset = false;
        if (way == 2) p.qc.settled = true;
        if (way == 3) p.qc.scale.pole_pairs = 0;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
        dqw_units_q15 u;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_units_of_q15(&p.qc, 4, &u));
        p.q.w_q24[DQW_PSI] = 1 << 24;
        p.q.w_q24[DQW_PSI_Q] = way == 4 ? 167000 : 200000;
        p.q.learned = way == 5 ? 31 : 63;
        p.q.blocks = way == 6 ? 499 : 500;
        p.q.cov_q40[DQW_PSI_Q] = 1;
        p.q.across = 99;
        dqw_estimator_turn_on_q15(&p.q, &u, true);
        CASE("way %d", way);
        HOLDS((p.q.w_q24[DQW_PSI_Q] == 0) == (way == 0));
    }
}

static void test_refusals(void)
{
    pair p;
    configure_resting(&p, DQW_MODULATION_MASK);
    dqw_estimator_q15 e;
    static const int none[] = {-1, DQW_MODULATIONS, DQW_MODULATIONS + 1};
    for (int i = 0; i < 3; i++) {
        p.qc.modulation = (enum dqw_modulation)none[i];
        REFUSED(e, DQW_ERR_MODULATION, dqw_estimator_init_q15(&e, &p.qc));
    }
    p.qc.modulation = DQW_MODULATION_MASK;
    static const int32_t late[] = {100001, -100001, INT32_MAX, INT32_MIN};
    for (int i = 0; i < 4; i++) {
        p.qc.angle_late_ns = late[i];
        REFUSED(e, DQW_ERR_ANGLE_LATE, dqw_estimator_init_q15(&e, &p.qc));
    }
    for (int way = -2; way <= 2; way++) {
        p.qc.angle_late_ns = way * 50000;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &p.qc));
    }
#if DQW_EFFECT_WEIGHTS > 0
    static const dqw_effect_q15_config list = {.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    p.qc.effects = &list;
    p.qc.effect_count = 1;
    REFUSED(e, DQW_ERR_ANGLE_LATE, dqw_estimator_init_q15(&e, &p.qc));
    p.qc.angle_late_ns = 0;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &p.qc));
    e.turn_cosine_q30 = 0;
    e.turn_sine_q30 = 1 << 30;
    dqw_estimator_q15_block b = {.weight = 1, .sums = {1000, 2000}};
    dqw_estimator_turn_block_q15(&e, &b);
    HOLDS(b.sums[0] == 1000 && b.sums[1] == 2000);
#endif
}

// Nobody says which legs switch: both find it, and then learn as if it had been said. Where no dead time shows, all do.
static void test_the_legs_that_switch_are_found(void)
{
    for (int m = 0; m < 4; m++)
        for (int way = 0; way < 3; way++) {
            const resting_joint j = joint_of((enum dqw_modulation)m, way == 2 ? 0.0 : 0.24, way == 1 ? -0.24 : 0.0);
            pair p;
            configure_resting(&p, DQW_MODULATION_UNKNOWN);
            p.fc.follow = p.qc.follow = way == 1;
            begin(&p);
            HOLDS(dqw_estimator_modulation_q15(&p.q) == DQW_MODULATION_UNKNOWN);
            learn(&p, &j, 7.0);
            CASE("%s, way %d: %d, trial %d; float %d", MODULATION[m], way, (int)dqw_estimator_modulation_q15(&p.q),
                 p.q.trial, (int)dqw_estimator_modulation(&p.f));
            HOLDS(dqw_estimator_modulation_q15(&p.q) == (way == 2 ? DQW_MODULATION_CENTRED : (enum dqw_modulation)m));
            HOLDS(dqw_estimator_modulation(&p.f) == dqw_estimator_modulation_q15(&p.q));
            if (way == 2) continue;
            for (int i = 0; i < 4; i++) BETWEEN(-0.02, 100 * (q_value(&p, i) / j.machine[i] - 1), 0.02);
            BETWEEN(0.998, q_value(&p, DQW_DEAD_TIME) / j.dead_V, 1.002);
        }
    // Without dead time there is nothing to find.
    pair p;
    configure_resting(&p, DQW_MODULATION_UNKNOWN);
    for (int way = 0; way < 3; way++) {
        p.qc.dead_time_width_mA = way == 0 ? 0 : 200;
        p.qc.angle = way != 1;
        p.qc.settled = way == 2;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
        HOLDS(dqw_estimator_modulation_q15(&p.q) == DQW_MODULATION_CENTRED);
    }
    for (int m = 0; m < DQW_MODULATION_UNKNOWN; m++) {
        configure_resting(&p, (enum dqw_modulation)m);
        begin(&p);
        HOLDS(dqw_estimator_modulation_q15(&p.q) == (enum dqw_modulation)m);
    }
}

// Meanwhile nothing is told nor judged, the monitor says why, and no block mixes two modulations; time jumps now and
// then.
static void test_while_it_is_found(void)
{
    const resting_joint j = joint_of(DQW_MODULATION_CLAMPED_HIGH, 0.24, 0.0);
    pair p;
    configure_resting(&p, DQW_MODULATION_UNKNOWN);
    const dqw_monitor_q15_config c = {.estimator = p.qc};
    static dqw_monitor_q15 o;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init_q15(&o, &c));
    const dqw_estimator_q15 *e = &o.estimator;
    uint32_t changed = 0;
    uint8_t before = 0;
    int changes = 0;
    bool why = false;
    for (long k = 0; k < lrint(8 / RESTING_DT_S); k++) {
        bool made;
        const dqw_sample s = resting_sample(&j, k, &made);
        const dqw_sample_q15 q = rounded(&s);
        if (k % 30011 == 30010) dqw_monitor_missing_q15(&o, k % 2 == 0 ? 1 : 0);
        if ((dqw_monitor_sample_q15(&o, &q, false) & DQW_EVENT_BLOCK) == 0) continue;
        const uint32_t shown = e->residual.began + e->residual.began_before;
        (void)dqw_monitor_background_q15(&o);
        if (e->trial == 0) continue;
        HOLDS(e->stage.name != DQW_STAGE_IN_SERVICE && e->modulation < 4);
        if (e->trial == DQW_ESTIMATOR_SEEKS_Q15) continue;
        CASE("row %ld, trial %d: changed %u halves ago", k, e->trial, (unsigned)(e->number - changed));
        HOLDS(!dqw_estimator_read_q15(e, DQW_R).usable);
        HOLDS(dqw_estimator_voltage_acts_q15(e) == DQW_VOLTAGE_NOT_KNOWN);
        if (dqw_monitor_why_q15(&o) == DQW_WHY_MODULATION) why = true;
        if (changes > 0 && e->number - changed <= 2) HOLDS(e->residual.began + e->residual.began_before == shown);
        if (e->modulation != before) {
            changes++;
            changed = e->number;
        }
        before = e->modulation;
    }
    CASE("%d changes, modulation %d", changes, (int)dqw_estimator_modulation_q15(e));
    HOLDS(changes > 100 && why && dqw_estimator_modulation_q15(e) == DQW_MODULATION_CLAMPED_HIGH);
    HOLDS(e->stage.name == DQW_STAGE_IN_SERVICE);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_leg_that_rests_has_no_dead_time);
    RUN_TEST(test_an_angle_that_is_off_or_late);
    RUN_TEST(test_what_a_pair_takes_of_a_leg_that_rests);
    RUN_TEST(test_a_block_is_turned);
    RUN_TEST(test_the_weights_are_turned);
    RUN_TEST(test_many_turns_keep_their_length);
    RUN_TEST(test_what_is_not_turned);
    RUN_TEST(test_refusals);
    RUN_TEST(test_the_legs_that_switch_are_found);
    RUN_TEST(test_while_it_is_found);
    return UNITY_END();
}
