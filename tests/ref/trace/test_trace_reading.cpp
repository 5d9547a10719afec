// Records that say other than their columns: the simulator's log, changed by hand, and read.
#include <algorithm>
#include <cmath>
#include <complex>
#include <random>

#include "ref/trace/reading.hpp"
#include "ref/trace/rest.hpp"
#include "ref/trace/result.hpp"
#include "simulated.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::Log;
using dqw::Reading;

const Log& good()
{
    static const Log log = simulated("servo", {"duration_s=0.4"}, Beside::nothing);
    return log;
}

template <class Change> std::optional<Reading> read_of(Change change)
{
    std::vector<Log> logs{good()};
    change(logs[0]);
    return dqw::other_reading(*dqw::trace_setup(logs, {}));
}

void turn(std::vector<double>& x)
{
    for (double& v : x) v = -v;
}

void expect(const std::optional<Reading>& r, Reading::Kind kind, const char* how, double most)
{
    TEST_ASSERT_TRUE_MESSAGE(r.has_value(), how);
    TEST_ASSERT_TRUE_MESSAGE(r->kind == kind, r->how.c_str());
    TEST_ASSERT_EQUAL_STRING(how, r->how.c_str());
    TEST_ASSERT_TRUE_MESSAGE(r->part > 0.01 * most && r->part < most,
                             (r->how + ": " + std::to_string(r->part)).c_str());
}

void a_log_as_it_should_be_has_no_other_reading()
{
    TEST_ASSERT_FALSE(read_of([](Log&) {}).has_value());
}

void signs_and_columns_are_found()
{
    const auto signs = Reading::Kind::signs;
    expect(read_of([](Log& l) { turn(l.v_d_V); }), signs, "with the sign of v_d turned", 0.1);
    expect(read_of([](Log& l) { turn(l.i_q_A); }), signs, "with the sign of i_q turned", 0.1);
    expect(read_of([](Log& l) { turn(l.v_d_V), turn(l.i_d_A); }), signs, "with the signs of v_d and i_d turned", 0.1);
    // The residual is the same, and all of R, L_d and L_q negative.
    expect(read_of([](Log& l) { turn(l.i_d_A), turn(l.i_q_A); }), signs, "with the signs of i_d and i_q turned", 1.01);
    expect(read_of([](Log& l) { std::swap(l.v_d_V, l.v_q_V); }), signs, "with v_d and v_q exchanged", 0.1);
    expect(read_of([](Log& l) { std::swap(l.i_d_A, l.i_q_A); }), signs, "with i_d and i_q exchanged", 0.1);
}

// v_q, i_q and w turned together are the same machine seen with another order of phases.
/// Points of a machine whose i_d hardly moves: chance alone says on which side of zero L_d comes out.
Log points(unsigned seed, double i_d_A)
{
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Log log;
    log.path = "points", log.regime = dqw::Regime::steady, log.machine.pole_pairs = 5;
    for (int k = 0; k < 120; ++k) {
        const double w = 100 + 40 * (k % 8), i_q = 6 + k / 8 % 5, i_d = i_d_A * normal(random);
        log.t_s.push_back(k), log.w_m_rad_s.push_back(w), log.i_d_A.push_back(i_d), log.i_q_A.push_back(i_q);
        log.v_d_V.push_back(0.2 * i_d - 5 * w * 2e-4 * i_q + 0.1 * normal(random));
        log.v_q_V.push_back(0.2 * i_q + 5 * w * (1e-4 * i_d + 0.01) + 0.1 * normal(random));
    }
    return log;
}

/// Of such columns no law makes anything; what strong effects make of a log is another thing.
void turned_columns_are_misread()
{
    const auto misread = [](const Log& log) { return dqw::is_misread(*dqw::trace_setup({log}, {})); };
    const std::pair<const char*, void (*)(Log&)> changes[] = {
        {"v_d", [](Log& l) { turn(l.v_d_V); }},
        {"i_q", [](Log& l) { turn(l.i_q_A); }},
        {"both currents", [](Log& l) { turn(l.i_d_A), turn(l.i_q_A); }},
        {"currents exchanged", [](Log& l) { std::swap(l.i_d_A, l.i_q_A); }},
        {"the speed, beside an angle", [](Log& l) { turn(l.w_m_rad_s); }},
    };
    for (const auto& [what, change] : changes) {
        Log log = good();
        change(log);
        TEST_ASSERT_TRUE_MESSAGE(misread(log), what);
    }
    TEST_ASSERT_FALSE(misread(good()));
    const std::vector<std::string> strong[] = {{"nonideal.angle_offset_rad=0.7"},
                                               {"nonideal.dead_time_V=40", "nonideal.dead_time_width_A=0.2"},
                                               {"sensing.late_periods=0.9"},
                                               {"nonideal.iron_loss_S=0.1"},
                                               {"nonideal.turn_short=0.3"}};
    for (std::vector<std::string> settings : strong) {
        settings.push_back("duration_s=0.4");
        TEST_ASSERT_FALSE_MESSAGE(misread(simulated("servo", settings, Beside::nothing)), settings[0].c_str());
    }
}

void chance_turns_no_sign()
{
    int negative = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
        const std::vector<Log> logs{points(seed, 0.02)};
        double xy = 0.0;  // the slope of v_q by w i_d, as chance has it
        for (std::size_t k = 0; k < logs[0].rows(); ++k)
            xy += logs[0].w_m_rad_s[k] * logs[0].i_d_A[k] *
                  (logs[0].v_q_V[k] - 0.2 * logs[0].i_q_A[k] - 0.05 * logs[0].w_m_rad_s[k]);
        negative += xy < 0.0;
        const auto r = dqw::other_reading(*dqw::trace_setup(logs, {}));
        TEST_ASSERT_FALSE_MESSAGE(r.has_value(), (std::to_string(seed) + ": " + (r ? r->how : "")).c_str());
    }
    TEST_ASSERT_TRUE(negative >= 5);
    std::vector<Log> logs{points(1, 5.0)};
    turn(logs[0].i_d_A), turn(logs[0].i_q_A);
    expect(dqw::other_reading(*dqw::trace_setup(logs, {})), Reading::Kind::signs,
           "with the signs of i_d and i_q turned", 1.01);
}

/// What remains goes with the angle that speed and time make, of rows a second apart.
void rows_without_an_angle_go_with_none()
{
    for (const bool column : {false, true}) {
        std::vector<Log> logs{points(1, 5.0)};
        double angle = 0.0;
        for (std::size_t k = 0; k < logs[0].rows(); ++k) {
            if (k > 0) angle += 2.5 * (logs[0].w_m_rad_s[k] + logs[0].w_m_rad_s[k - 1]);
            if (column) logs[0].theta_e_rad.push_back(std::remainder(angle, 2 * M_PI));
            logs[0].v_q_V[k] += 2 * std::cos(angle);
        }
        const auto setup = dqw::trace_setup(logs, {});
        dqw::Point at = setup->starts.front();
        at.base = Eigen::Vector4d(0.2, 1e-4, 2e-4, 0.01);
        int angles = 0;
        for (const auto& c : dqw::correlates(*setup, setup->full->report(at, 0), 0.1))
            angles += c.with.rfind("angle", 0) == 0 || c.with.rfind("signs", 0) == 0;
        TEST_ASSERT_TRUE(column ? angles > 0 : angles == 0);
    }
}

void an_order_of_phases_is_told_as_the_speed()
{
    expect(read_of([](Log& l) { turn(l.v_q_V), turn(l.i_q_A); }), Reading::Kind::signs, "with the sign of w_m turned",
           0.1);
}

void pole_pairs_come_out_where_nobody_gave_them()
{
    std::vector<Log> logs{good()};
    logs[0].machine.pole_pairs.reset();
    logs[0].theta_e_rad.clear(), logs[0].theta_m_rad.clear();
    turn(logs[0].v_d_V), turn(logs[0].i_d_A);
    auto setup = dqw::trace_setup(logs, {});
    if (setup->pole_pairs_known) TEST_IGNORE_MESSAGE("the fit finds them in spite of the signs");
    const auto r = dqw::other_reading(*setup);
    expect(r, Reading::Kind::signs, "with the signs of v_d and i_d turned", 1.01);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * *good().machine.pole_pairs, *good().machine.pole_pairs, r->pole_pairs);
}

void what_turns_is_a_product_where_nobody_knows_the_pole_pairs()
{
    std::vector<Log> logs{good()};
    auto setup = dqw::trace_setup(logs, {});
    setup->pole_pairs_known = false;
    dqw::Point at;
    at.base = Eigen::Vector4d(0.2, 1e-3, 1.5e-3, 0.05);
    const Eigen::VectorXd sd = 1e-3 * at.base;
    for (const dqw::Estimate& e : dqw::base_parameters(*setup, at, sd))
        TEST_ASSERT_EQUAL_MESSAGE(e.name != "R_ohm", e.times_pole_pairs, e.name.c_str());
    std::fill(logs[0].w_m_rad_s.begin(), logs[0].w_m_rad_s.end(), 0.0);
    for (const dqw::Estimate& e : dqw::base_parameters(*setup, at, sd))
        TEST_ASSERT_EQUAL_MESSAGE(e.name == "psi_Wb", e.times_pole_pairs, e.name.c_str());
}

// L_d and the flux stand before one column there, of which least norm gives each half: one of them negative, as sure as
// their sum.
void one_operating_point_turns_no_sign()
{
    for (unsigned seed = 1; seed <= 20; ++seed) {
        std::mt19937 random(seed);
        std::uniform_real_distribution<double> noise(-0.15, 0.15);
        Log log;
        log.path = "point", log.regime = dqw::Regime::steady, log.machine.pole_pairs = 4;
        for (int k = 0; k < 1000; ++k) {
            log.t_s.push_back(k), log.w_m_rad_s.push_back(100), log.i_d_A.push_back(-1);
            log.v_d_V.push_back(-2.4 + noise(random)), log.v_q_V.push_back(21 + noise(random));
            log.i_q_A.push_back(2 + 1e-3 * noise(random));
        }
        const std::vector<Log> logs{log};
        const auto r = dqw::other_reading(*dqw::trace_setup(logs, {}));
        TEST_ASSERT_FALSE_MESSAGE(r.has_value(), (std::to_string(seed) + ": " + (r ? r->how : "")).c_str());
    }
}

void rows_apart_are_found()
{
    const auto rows = Reading::Kind::rows;
    const auto shift = [](std::vector<double>& x, int by) {
        if (by > 0)
            std::rotate(x.begin(), x.end() - by, x.end());
        else
            std::rotate(x.begin(), x.begin() - by, x.end());
    };
    for (int by : {1, 2, 3, -1, -2, -3}) {
        const char* const how[] = {
            "with each voltage taken from three rows before", "with each voltage taken from two rows before",
            "with each voltage taken from the row before",    "",
            "with each voltage taken from the row after",     "with each voltage taken from two rows after",
            "with each voltage taken from three rows after",
        };
        expect(read_of([&](Log& l) { shift(l.v_d_V, by), shift(l.v_q_V, by); }), rows, how[by + 3], 0.6);
    }
}

/// A vector of the log in a frame that is `part` of a period ahead.
void ahead(Log& l, std::vector<double>& d, std::vector<double>& q, double part)
{
    for (std::size_t k = 0; k < l.rows(); ++k) {
        const std::complex<double> z = std::complex<double>(d[k], q[k]) *
                                       std::polar(1.0, -part * *l.machine.pole_pairs * l.w_m_rad_s[k] * l.dt_s);
        d[k] = z.real(), q[k] = z.imag();
    }
}

void frames_are_found()
{
    const auto rows = Reading::Kind::rows;
    expect(read_of([](Log& l) { ahead(l, l.v_d_V, l.v_q_V, 0.5); }), rows,
           "with voltages that were turned by the angle at the end of their period, not in its middle", 0.6);
    expect(read_of([](Log& l) { ahead(l, l.v_d_V, l.v_q_V, -0.5); }), rows,
           "with voltages that were turned by the angle at the start of their period, not in its middle", 0.6);
    // A current of the row before, in this row's frame.
    expect(read_of([](Log& l) {
               for (auto* i : {&l.i_d_A, &l.i_q_A}) std::rotate(i->begin(), i->end() - 1, i->end());
               ahead(l, l.i_d_A, l.i_q_A, 1.0);
           }),
           rows, "with currents that were sampled one row before the one that they stand in", 0.6);
}

/// y = y' + a (i - y'): of a = 1/(1 + n), n rows late in the mean, in either frame; 1.2 and 4.8 are none that is tried.
void filtered_currents_are_found()
{
    const struct {
        double n;
        const char* how;
    } filters[] = {{1.0, "with the currents from before a filter of about 1 row"},
                   {1.2, "with the currents from before a filter of about 1.4 rows"},
                   {2.8, "with the currents from before a filter of about 2.8 rows"},
                   {4.8, "with the currents from before a filter of about 5.7 rows"}};
    for (const bool stator : {false, true})
        for (const auto& f : filters) {
            const auto r = read_of([&](Log& l) {
                std::complex<double> y(l.i_d_A[0], l.i_q_A[0]);
                for (std::size_t k = 1; k < l.rows(); ++k) {
                    if (stator) y *= std::polar(1.0, -*l.machine.pole_pairs * l.w_m_rad_s[k] * l.dt_s);
                    y += (std::complex<double>(l.i_d_A[k], l.i_q_A[k]) - y) / (1.0 + f.n);
                    l.i_d_A[k] = y.real(), l.i_q_A[k] = y.imag();
                }
            });
            expect(r, Reading::Kind::filter, f.how, 0.3);
        }
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(turned_columns_are_misread);
    RUN_TEST(chance_turns_no_sign);
    RUN_TEST(rows_without_an_angle_go_with_none);
    RUN_TEST(a_log_as_it_should_be_has_no_other_reading);
    RUN_TEST(signs_and_columns_are_found);
    RUN_TEST(an_order_of_phases_is_told_as_the_speed);
    RUN_TEST(pole_pairs_come_out_where_nobody_gave_them);
    RUN_TEST(what_turns_is_a_product_where_nobody_knows_the_pole_pairs);
    RUN_TEST(one_operating_point_turns_no_sign);
    RUN_TEST(rows_apart_are_found);
    RUN_TEST(frames_are_found);
    RUN_TEST(filtered_currents_are_found);
    return UNITY_END();
}
