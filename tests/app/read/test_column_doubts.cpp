// Columns in another unit, of another sign or scaling are told by physics; none of a right log is.
#include <functional>
#include <string>

#include "app/read/column_doubts.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static const double turn = 2 * 3.14159265358979323846;

struct Columns {
    std::vector<double> values[dqw::column_count];
    dqw::Regime regime = dqw::Regime::dynamic;
    bool of_size = false;

    void times(dqw::Column c, double factor)
    {
        for (double& v : values[c]) v *= factor;
    }
    std::vector<dqw::Doubt> doubts(const dqw::Machine& machine) const
    {
        dqw::SpeedProbe probe;
        for (std::size_t c = 0; c < dqw::column_count; ++c)
            if (!values[c].empty()) probe.column[c] = values[c].data();
        probe.rows = values[dqw::col_w_m].size();
        probe.median_dt_s = values[dqw::col_t].empty() ? 0 : values[dqw::col_t][1] - values[dqw::col_t][0];
        probe.regime = regime;
        probe.v_q_is_size = of_size;
        return dqw::column_doubts(probe, machine);
    }
};

static Columns moving(bool angle)
{
    const command::Machine m;
    Columns c;
    double theta = 0;
    for (std::size_t k = 0; k < 4000; ++k) {
        const auto r = m.row(k);
        const double values[] = {static_cast<double>(k) * m.dt_s, r.v_d_V, r.v_q_V, r.i_d_A, r.i_q_A, r.w_m_rad_s};
        for (std::size_t i = 0; i < 6; ++i) c.values[i].push_back(values[i]);
        if (angle) {
            c.values[dqw::col_theta_m].push_back(std::fmod(theta, turn));
            c.values[dqw::col_theta_e].push_back(std::fmod(m.p * theta, turn));
        }
        theta += r.w_m_rad_s * m.dt_s;
    }
    return c;
}

static Columns settled()
{
    Columns c;
    c.regime = dqw::Regime::steady;
    for (int k = 0; k < 60; ++k) {
        const double w = 50 + 10 * (k % 6), d = -(k % 4), q = 2 + k % 5, p = 4, R = 0.5, Ld = 2e-3, Lq = 3e-3,
                     psi = 0.05;
        const double values[] = {0, R * d - p * w * Lq * q, R * q + p * w * (Ld * d + psi), d, q, w};
        for (std::size_t i = 1; i < 6; ++i) c.values[i].push_back(values[i]);
    }
    return c;
}

/// Rows 20 ms apart, means at speeds that go on, and a dead time that means do not show apart from R.
static Columns polled(bool half, bool of_size)
{
    Columns c;
    c.regime = dqw::Regime::polled, c.of_size = of_size;
    for (int k = 0; k < 600; ++k) {
        const double t = 0.02 * k, w = 60 + 40 * std::sin(0.7 * t), before = 60 + 40 * std::sin(0.7 * (t - 0.02));
        const double d = half ? 0 : -1 - std::sin(0.9 * t), q = 3 + 2 * std::sin(2.3 * t), p = 4, R = 0.5, Ld = 2e-3,
                     Lq = 3e-3, psi = 0.05, lost = 0.4 / std::hypot(d, q), e = 0.5 * p * (w + before);
        const double v_d = (R + lost) * d - e * Lq * q, v_q = (R + lost) * q + e * (Ld * d + psi);
        const double values[] = {t, v_d, of_size ? std::hypot(v_d, v_q) : v_q, d, q, w};
        for (std::size_t i = 0; i < 6; ++i)
            if (!half || (i != dqw::col_v_d && i != dqw::col_i_d)) c.values[i].push_back(values[i]);
    }
    return c;
}

static dqw::Machine plate(bool parameters = true)
{
    dqw::Machine m;
    m.pole_pairs = 4;
    if (parameters) m.R_ohm = 0.5, m.Ld_H = 2e-3, m.Lq_H = 3e-3, m.psi_Wb = 0.05;
    return m;
}

static void a_right_log_is_not_doubted(void)
{
    for (const double nominal : {0.7, 1.0, 1.3}) {
        dqw::Machine m = plate();
        for (auto* x : {&m.R_ohm, &m.Ld_H, &m.Lq_H, &m.psi_Wb}) **x *= nominal;
        for (const Columns& c :
             {moving(true), moving(false), settled(), polled(false, false), polled(true, false), polled(true, true)}) {
            TEST_ASSERT_TRUE(c.doubts(m).empty());
            TEST_ASSERT_TRUE(c.doubts({}).empty());
        }
    }
}

using Damage = std::function<void(Columns&)>;

static Damage scaled(std::vector<dqw::Column> columns, double factor)
{
    return [=](Columns& c) {
        for (const auto column : columns) c.times(column, factor);
    };
}

static void what_is_wrong_is_named_with_the_correction(void)
{
    using namespace dqw;
    const std::vector<Column> i = {col_i_d, col_i_q}, v = {col_v_d, col_v_q}, vi = {col_v_d, col_v_q, col_i_d, col_i_q};
    const double deg = 360 / turn;
    const Damage exchange = [](Columns& c) {
        std::swap(c.values[col_v_d], c.values[col_v_q]);
        std::swap(c.values[col_i_d], c.values[col_i_q]);
    };
    const Damage of_torque = [](Columns& c) {
        for (const double x : c.values[col_i_q]) c.values[col_torque].push_back(0.3 * x);
        c.times(col_i_q, 1.5);
    };
    Columns taken_as_settled = moving(false);
    taken_as_settled.regime = Regime::steady;
    Machine of_five;
    of_five.pole_pairs = 5;
    const struct {
        const char* what;
        Columns log;
        Damage damage;
        Machine machine;
        const char *looks_like, *correction;
    } cases[] = {
        {"theta_e deg", moving(true), scaled({col_theta_e}, deg), {}, "deg", "unit = \"deg\""},
        {"theta_m 16 bits", moving(true), scaled({col_theta_m}, 65536 / turn), {}, "16-bit turns", "16-bit turns"},
        {"theta_e turns", moving(true), scaled({col_theta_e}, 1 / turn), {}, "turns", "unit = \"turns\""},
        {"pole pairs", moving(true), scaled({}, 1), of_five, "the angle of 4 pole pairs", ""},
        {"electrical, angle", moving(true), scaled({col_w_m}, 4), plate(false), "electrical speed", "electrical rad/s"},
        {"erpm, angle", moving(true), scaled({col_w_m}, 4 * 60 / turn), plate(false), "electrical rpm", "erpm"},
        {"turns/s, angle", moving(true), scaled({col_w_m}, 1 / turn), plate(false), "turns a second", "turns/s"},
        {"ms, angle", moving(true), scaled({col_t}, 1e3), plate(false), "ms", "unit = \"ms\""},
        {"us, angle", moving(true), scaled({col_t}, 1e6), plate(false), "µs", "unit = \"us\""},
        {"ms", moving(false), scaled({col_t}, 1e3), {}, "ms", "unit = \"ms\""},
        {"electrical", moving(false), scaled({col_w_m}, 4), plate(false), "electrical speed", "electrical rad/s"},
        {"electrical, plate", settled(), scaled({col_w_m}, 4), plate(), "electrical speed", "electrical rad/s"},
        {"erpm, plate", settled(), scaled({col_w_m}, 4 * 60 / turn), plate(), "electrical rpm", "erpm"},
        {"mA, plate", settled(), scaled(i, 1e3), plate(), "mA", "unit = \"mA\""},
        {"mA", moving(false), scaled(i, 1e3), {}, "mA", "unit = \"mA\""},
        {"mV, plate", moving(false), scaled(v, 1e3), plate(), "mV", "unit = \"mV\""},
        {"line to line", settled(), scaled(v, 1.7320508), plate(), "line to line", "0.57735"},
        {"power-invariant", moving(false), scaled(vi, 1.2247449), plate(), "power-invariant", "0.81650"},
        {"RMS", settled(), scaled(vi, 0.70710678), plate(), "RMS", "1.41421"},
        {"d turned", moving(false), scaled({col_v_d, col_i_d}, -1), {}, "the sign of v_d and i_d turned", ""},
        {"w turned", moving(false), scaled({col_w_m}, -1), {}, "the sign of w_m, or those of v_q and i_q", ""},
        {"w turned, angle", moving(true), scaled({col_w_m}, -1), {}, "a speed of the other sign", "scale = -1"},
        {"q turned, angle", moving(true), scaled({col_v_q, col_i_q}, -1), {}, "the sign of v_q and i_q turned", ""},
        {"i_q turned", settled(), scaled({col_i_q}, -1), {}, "the sign of i_q turned", ""},
        {"i_q of torque", settled(), of_torque, plate(), "torque over", "scale = 0.7"},
        {"exchanged", moving(false), exchange, {}, "d and q exchanged", ""},
        {"ms, taken as settled", taken_as_settled, scaled({col_t}, 1e3), {}, "ms", "unit = \"ms\""},
        {"polled ms", polled(false, false), scaled({col_t}, 1e3), {}, "ms", "unit = \"ms\""},
        {"polled us", polled(true, false), scaled({col_t}, 1e6), {}, "µs", "unit = \"us\""},
        {"polled d turned", polled(false, false), scaled({col_v_d, col_i_d}, -1), {}, "v_d and i_d turned", ""},
        {"polled electrical", polled(false, false), scaled({col_w_m}, 4), plate(), "electrical speed",
         "electrical rad"},
        {"polled lines", polled(false, false), scaled(v, 1.7320508), plate(), "line to line", "0.57735"},
        {"half lines", polled(true, false), scaled(v, 1.7320508), plate(), "line to line", "0.57735"},
        {"half RMS", polled(true, false), scaled(vi, 0.70710678), plate(), "RMS", "1.41421"},
        {"half invariant", polled(true, true), scaled(vi, 1.2247449), plate(), "power-invariant", "0.81650"},
        {"half erpm", polled(true, false), scaled({col_w_m}, 4 * 60 / turn), plate(), "electrical rpm", "erpm"},
        {"half turns/s", polled(true, true), scaled({col_w_m}, 1 / turn), plate(), "turns a second", "turns/s"},
        {"half mA", polled(true, false), scaled(i, 1e3), {}, "mA", "unit = \"mA\""},
        {"half mA, plate", polled(true, true), scaled(i, 1e3), plate(), "mA", "unit = \"mA\""},
        {"half mV", polled(true, false), scaled(v, 1e3), {}, "mV", "unit = \"mV\""},
        {"half i turned", polled(true, false), scaled({col_i_q}, -1), {}, "the sign of i_q turned", ""},
        {"half v turned", polled(true, false), scaled({col_v_q}, -1), {}, "the sign of v_q turned", ""},
        {"half w turned", polled(true, false), scaled({col_w_m}, -1), {}, "the sign of w_m turned", ""},
    };
    for (const auto& c : cases) {
        Columns log = c.log;
        c.damage(log);
        const auto doubts = log.doubts(c.machine);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(1, doubts.size(), c.what);
        TEST_ASSERT_TRUE_MESSAGE(doubts[0].looks_like.find(c.looks_like) != std::string::npos,
                                 (std::string(c.what) + ": " + doubts[0].looks_like).c_str());
        TEST_ASSERT_TRUE_MESSAGE(doubts[0].correction.find(c.correction) != std::string::npos, c.what);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_right_log_is_not_doubted);
    RUN_TEST(what_is_wrong_is_named_with_the_correction);
    return UNITY_END();
}
