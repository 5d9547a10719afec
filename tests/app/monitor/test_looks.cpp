// The watch over slow logs: what it names, what it lets pass, what it says of itself.
#include "app/monitor/looks.hpp"

#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "command.hpp"
#include "polled_drive.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using polled_drive::Drawn;
using polled_drive::polled;

namespace {

Drawn drive(unsigned seed)
{
    Drawn m;
    m.seed = seed, m.seconds = 200, m.noise_rad_s = 0.4, m.change_s = 110;
    return m;
}

/// Few of many under the sanitizers: they are ten times as slow, and all go the same way.
unsigned last(unsigned few, unsigned all) { return command::sanitized() ? few : all; }

dqw::MonitorRun watch(const Drawn& m) { return dqw::watch_looks(polled(m), {}); }

void healthy_drives_raise_nothing(void)
{
    for (unsigned seed = 1; seed <= last(6, 24); ++seed) {
        Drawn m = drive(seed);
        m.warm_K = seed % 3 == 0 ? 80.0 : seed % 3 == 1 ? -30.0 : 0.0, m.measures_heat = seed % 4 == 0;
        m.lost_V = seed % 2 == 0 ? 0.2 : 0.0, m.i_d_moves = seed % 5 != 0;
        const dqw::MonitorRun run = watch(m);
        TEST_ASSERT_TRUE(run.watched);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, run.events.size(), m.measures_heat ? "with heat" : "without");
    }
}

void lost_flux_is_named(void)
{
    for (unsigned seed = 31; seed <= last(32, 40); ++seed) {
        Drawn m = drive(seed);
        m.psi_fall = 0.2, m.warm_K = seed % 2 == 0 ? 40.0 : 0.0;
        const dqw::MonitorRun run = watch(m);
        TEST_ASSERT_EQUAL_size_t(1, run.events.size());
        const dqw::MonitorEvent& e = run.events[0];
        TEST_ASSERT_EQUAL_INT(DQW_FAULT_DEMAGNETISATION, e.fault.name);
        TEST_ASSERT_EQUAL_INT(DQW_WATCH_PSI, e.parameter);
        // The healthy value is the one before the ramp; two looks of 10 s tell it.
        TEST_ASSERT_DOUBLE_WITHIN(0.012 * m.psi_Wb, m.psi_at(30), e.reading.healthy);
        TEST_ASSERT_TRUE(e.since_s > 100 && e.since_s < 135);
        TEST_ASSERT_TRUE(e.t_s > 120 && e.t_s < 175);
    }
}

void resistance_beyond_a_measured_heat_is_named(void)
{
    Drawn m = drive(5);
    m.R_rise = 0.9, m.warm_K = 30, m.measures_heat = true;
    const dqw::MonitorRun run = watch(m);
    TEST_ASSERT_EQUAL_size_t(1, run.events.size());
    TEST_ASSERT_EQUAL_INT(DQW_FAULT_RESISTANCE_RISE, run.events[0].fault.name);
    // Without the column it is changed, but by what a mean does not tell; and the half of it may be heat.
    m.measures_heat = false;
    const dqw::MonitorRun more = watch(m);
    TEST_ASSERT_EQUAL_size_t(1, more.events.size());
    TEST_ASSERT_EQUAL_INT(DQW_FAULT_UNKNOWN, more.events[0].fault.name);
    m.R_rise = 0.3;
    TEST_ASSERT_EQUAL_size_t(0, watch(m).events.size());
}

/// 60 K of heat, whose sensor gets half as warm, stands still, breaks off, or lags by ten minutes: no fault of the
/// motor.
void a_sensor_that_is_off_is_no_fault(void)
{
    for (int kind = 0; kind < 4; ++kind) {
        Drawn m = drive(9);
        // The one that lags has a winding that warms by 70 K within 20 s.
        if (kind == 3)
            m.R_rise = 0.27;
        else
            m.warm_K = 60;
        dqw::Log log = polled(m);
        double lagging_K = 0.0;
        for (double t : log.t_s) {
            lagging_K += (m.R_rise / 0.0039 * m.grown(t) - lagging_K) / (600.0 * m.rate_Hz);
            log.temp_winding_C.push_back(kind == 0   ? std::round(25 + 0.5 * m.heat_K(t))
                                         : kind == 3 ? std::round(25 + lagging_K)
                                         : kind == 1 ? 25.0
                                         : t > 120   ? -1.0
                                                     : std::round(25 + m.heat_K(t)));
        }
        const dqw::MonitorRun run = dqw::watch_looks(log, {});
        TEST_ASSERT_EQUAL_size_t(0, run.events.size());
        TEST_ASSERT_EQUAL_size_t(kind == 0 || kind == 3 ? 2 : 3, run.notes.size());
        for (const std::string& note : run.notes)
            TEST_ASSERT_TRUE_MESSAGE(note.find("warning") == note.npos, note.c_str());
    }
}

/// L_q that falls by a fifth under twice the load, as iron's does, is no event.
void saturation_is_no_fault(void)
{
    Drawn m = drive(20);
    m.noise_rad_s = 0.2;
    dqw::Log log = polled(m);
    for (std::size_t k = 0; k < log.rows(); ++k) {
        // Past change_s twice the q current; the flux that L_q makes of it is a fifth less than it was per ampere.
        const bool loaded = log.t_s[k] > m.change_s;
        const double w = m.p * log.w_m_rad_s[k], i_q = log.i_q_A[k], more = loaded ? i_q : 0.0;
        log.v_q_V[k] += m.R_ohm * more, log.i_q_A[k] += more;
        if (loaded) log.v_d_V[k] += -w * 0.8 * m.Lq_H * 2.0 * i_q + w * m.Lq_H * i_q;
    }
    const dqw::MonitorRun run = dqw::watch_looks(log, {});
    TEST_ASSERT_TRUE(run.watched);
    for (const dqw::MonitorEvent& e : run.events) TEST_ASSERT_TRUE(e.parameter != DQW_WATCH_LQ);
    TEST_ASSERT_EQUAL_size_t(0, run.events.size());
}

/// A voltage that reads a fifth too small changes R, L and flux by one factor: no magnet has done that.
void the_voltages_scale_is_no_magnet(void)
{
    Drawn m = drive(12);
    dqw::Log log = polled(m);
    for (std::size_t k = 0; k < log.rows(); ++k)
        if (log.t_s[k] > m.change_s) log.v_d_V[k] *= 0.8, log.v_q_V[k] *= 0.8;
    const dqw::MonitorRun run = dqw::watch_looks(log, {});
    TEST_ASSERT_TRUE(run.events.size() >= 1);
    for (const dqw::MonitorEvent& e : run.events)
        TEST_ASSERT_TRUE(e.fault.name == DQW_FAULT_VOLTAGE_SCALE || e.fault.name == DQW_FAULT_UNKNOWN);
    // Nor does a speed of another scale: flux and L move, R does not.
    log = polled(m);
    for (std::size_t k = 0; k < log.rows(); ++k)
        if (log.t_s[k] > m.change_s) log.w_m_rad_s[k] *= 1.2;
    const dqw::MonitorRun speed = dqw::watch_looks(log, {});
    TEST_ASSERT_TRUE(speed.events.size() >= 1);
    for (const dqw::MonitorEvent& e : speed.events) TEST_ASSERT_EQUAL_INT(DQW_FAULT_UNKNOWN, e.fault.name);
}

/// Half a log, and a controller that begins to weaken the field: something changed, and it is not named.
void what_half_a_log_cannot_tell_is_not_named(void)
{
    for (const bool size : {false, true}) {
        Drawn m = drive(14);
        m.i_d_moves = false, m.noise_rad_s = 0.1;
        dqw::Log log = polled(m);
        for (std::size_t k = 0; k < log.rows(); ++k) {
            if (log.t_s[k] > m.change_s) log.v_q_V[k] -= m.p * log.w_m_rad_s[k] * m.Ld_H * 8.0;
            if (size) log.v_q_V[k] = std::hypot(log.v_d_V[k], log.v_q_V[k]);
        }
        log.v_d_V.clear(), log.i_d_A.clear(), log.v_q_is_size = size;
        const dqw::MonitorRun run = dqw::watch_looks(log, {});
        TEST_ASSERT_TRUE(run.events.size() >= 1);
        for (const dqw::MonitorEvent& e : run.events) TEST_ASSERT_EQUAL_INT(DQW_FAULT_UNKNOWN, e.fault.name);
    }
}

/// An encoder that slips by half a radian: the equations hold no longer, whatever the weights.
void equations_that_hold_no_longer_are_told(void)
{
    Drawn m = drive(16);
    dqw::Log log = polled(m);
    const double c = std::cos(0.5), s = std::sin(0.5);
    for (std::size_t k = 0; k < log.rows(); ++k) {
        if (!(log.t_s[k] > m.change_s)) continue;
        const double v_d = log.v_d_V[k], i_d = log.i_d_A[k];
        log.v_d_V[k] = c * v_d - s * log.v_q_V[k], log.v_q_V[k] = s * v_d + c * log.v_q_V[k];
        log.i_d_A[k] = c * i_d - s * log.i_q_A[k], log.i_q_A[k] = s * i_d + c * log.i_q_A[k];
    }
    const dqw::MonitorRun run = dqw::watch_looks(log, {});
    TEST_ASSERT_TRUE(run.events.size() >= 1);
    for (const dqw::MonitorEvent& e : run.events) TEST_ASSERT_EQUAL_INT(DQW_FAULT_UNKNOWN, e.fault.name);
}

void a_turned_sign_is_refused(void)
{
    dqw::Log log = polled(drive(18));
    for (double& w : log.w_m_rad_s) w = -w;
    try {
        (void)dqw::watch_looks(log, {});
        TEST_FAIL_MESSAGE("expected a refusal");
    } catch (const std::invalid_argument& e) {
        TEST_ASSERT_NOT_NULL(std::strstr(e.what(), "a sign or a column is probably wrong"));
    }
}

void the_windings_heat_is_read(void)
{
    Drawn m = drive(7);
    m.warm_K = 60;
    const dqw::MonitorRun run = watch(m);
    const dqw::MonitorReading& K = run.last[DQW_WATCH_TEMPERATURE];
    const double healthy_K = (m.R_at(0) + m.R_at(15) + m.R_at(25) + m.R_at(35) + m.R_at(50)) / 5,
                 rise_K = (m.R_at(195) / healthy_K - 1.0) / 0.0039;
    std::printf("winding %.1f +- %.1f K above, truth %.1f\n", K.value, K.sd, rise_K);
    TEST_ASSERT_DOUBLE_WITHIN(2 * K.sd + 1.0, rise_K, K.value);
    TEST_ASSERT_TRUE(K.sd > 2.0 && K.sd < 15.0 && rise_K > 25.0);
}

void what_is_not_watched_is_said(void)
{
    Drawn m = drive(3);
    m.fan = true;
    const dqw::MonitorRun run = watch(m);
    TEST_ASSERT_EQUAL_size_t(0, run.events.size());
    TEST_ASSERT_EQUAL_INT(DQW_WHY_UNSETTLED, run.sights[DQW_WATCH_PSI].why);
    TEST_ASSERT_NOT_NULL(std::strstr(run.sights[DQW_WATCH_PSI].said, "current follows the speed"));
    TEST_ASSERT_TRUE(DQW_WHY_IN_SERVICE != run.sights[DQW_WATCH_FRICTION].why);
    TEST_ASSERT_NOT_NULL(std::strstr(run.sights[DQW_WATCH_RESISTANCE].said, "averages"));
}

void a_log_of_a_minute_is_too_short(void)
{
    Drawn m = drive(3);
    m.seconds = 55;
    try {
        (void)watch(m);
        TEST_FAIL_MESSAGE("expected a refusal");
    } catch (const std::invalid_argument& e) {
        TEST_ASSERT_NOT_NULL(std::strstr(e.what(), "healthy values take 5, and one more is to be watched"));
    }
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(healthy_drives_raise_nothing);
    RUN_TEST(lost_flux_is_named);
    RUN_TEST(resistance_beyond_a_measured_heat_is_named);
    RUN_TEST(a_sensor_that_is_off_is_no_fault);
    RUN_TEST(saturation_is_no_fault);
    RUN_TEST(the_voltages_scale_is_no_magnet);
    RUN_TEST(what_half_a_log_cannot_tell_is_not_named);
    RUN_TEST(equations_that_hold_no_longer_are_told);
    RUN_TEST(a_turned_sign_is_refused);
    RUN_TEST(the_windings_heat_is_read);
    RUN_TEST(what_is_not_watched_is_said);
    RUN_TEST(a_log_of_a_minute_is_too_short);
    return UNITY_END();
}
