// What the monitor itself says of a log, which the command does not print in full: of each channel value, deviation,
// usable and sensitivity, and why it does not watch; set up and fed as `dqwatch monitor` does. Options: --until T (the
// log's rows before T s alone), --q15.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>

#include "app/job/logs.hpp"
#include "app/job/monitor.hpp"
#include "app/learn/inputs.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/signals.hpp"
#include "app/monitor/engine.hpp"
#include "app/monitor/setup.hpp"
#include "app/q15/fixed_point.hpp"
#include "dqw_estimator_random.h"
#include "dqw_text.h"

namespace {

void accept(dqw_status status)
{
    if (status != DQW_OK) throw std::invalid_argument(dqw_status_text(status));
}

struct Float {
    dqw_monitor_config config;
    dqw_monitor m{};
    dqw_estimator_random lent{};
    explicit Float(const dqw::MonitorSetup& setup) : config(setup.config)
    {
        config.estimator.random = &lent;
        dqw_estimator_random_init(&lent);
        accept(dqw_monitor_init(&m, &config));
    }
    void gap(std::uint32_t periods) { dqw_monitor_missing(&m, periods); }
    void step(const dqw_sample& s)
    {
        (void)dqw_monitor_sample(&m, &s, false);
        (void)dqw_monitor_background(&m);
        if (m.estimator.stage.name != DQW_STAGE_DOMAIN) return;
        dqw_estimator_random_init(&lent);
        accept(dqw_monitor_define(&m, &config));
    }
    dqw_why why() const { return dqw_monitor_why(&m); }
    dqw_reading read(int channel) const { return dqw_monitor_read(&m, static_cast<dqw_monitor_channel>(channel)); }
    double sensitivity(int channel) const
    {
        return static_cast<double>(dqw_monitor_sensitivity(&m, static_cast<dqw_monitor_channel>(channel)));
    }
};

struct Fixed {
    dqw_monitor_q15_config config;
    dqw::FullScales full;
    dqw_monitor_q15 m{};
    explicit Fixed(const dqw::MonitorSetup& setup)
        : config(dqw::q15_monitor_config(setup)), full(dqw::full_scales(config.estimator.scale))
    {
        accept(dqw_monitor_init_q15(&m, &config));
    }
    void gap(std::uint32_t periods) { dqw_monitor_missing_q15(&m, periods); }
    void step(const dqw_sample& s)
    {
        dqw_sample_q15 x;
        const bool good = dqw::fixed(s, full, x);
        (void)dqw_monitor_sample_q15(&m, &x, !good);
        (void)dqw_monitor_background_q15(&m);
        if (m.estimator.stage.name == DQW_STAGE_DOMAIN) accept(dqw_monitor_define_q15(&m, &config));
    }
    dqw_why why() const { return dqw_monitor_why_q15(&m); }
    dqw_reading read(int channel) const
    {
        const dqw_reading_q15 r = dqw_monitor_read_q15(&m, static_cast<dqw_monitor_channel>(channel));
        const double unit = dqw::channel_unit_q15(config.estimator, channel);
        const auto sd = [&](std::int64_t x) {
            return x == INT64_MAX ? DQW_UNKNOWN : static_cast<float>(dqw::si(x, unit));
        };
        return {static_cast<float>(dqw::si(r.value_q40, unit)), sd(r.sd_q40), sd(r.sd_change_q40), r.usable};
    }
    double sensitivity(int channel) const
    {
        const std::int64_t least = dqw_monitor_sensitivity_q15(&m, static_cast<dqw_monitor_channel>(channel));
        return least == INT64_MAX ? INFINITY : dqw::si(least, dqw::channel_unit_q15(config.estimator, channel));
    }
};

std::string number(double x) { return std::fabs(x) < 3e38 ? fmt::format("{:.7g}", x) : "null"; }

template <class Monitor> void run(const dqw::Log& log, const dqw::MonitorSetup& setup, double until_s)
{
    Monitor monitor(setup);
    std::vector<dqw::TraceInput> inputs = setup.inputs;
    if (setup.config.estimator.angle) inputs.push_back({"dead_time", {}, {}});
    const dqw::SampleSource sample(log, setup.config.estimator.pole_pairs, inputs);
    bool gap = false;
    std::size_t done = 0;
    dqw::walk(
        log, done, log.rows(), {}, [&] { gap = true; },
        [&](std::size_t k, bool) {
            if (!(log.t_s[k] < until_s)) return;
            const double lost = gap && k > 0 ? std::round((log.t_s[k] - log.t_s[k - 1]) / log.dt_s) - 1.0 : 0.0;
            if (gap) monitor.gap(static_cast<std::uint32_t>(lost));
            gap = false;
            monitor.step(sample(k));
        });
    std::string text = fmt::format("{{\"why\": \"{}\", \"modulation\": {}", dqw_why_text(monitor.why()),
                                   static_cast<int>(setup.config.estimator.modulation));
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; ++channel) {
        const dqw_reading r = monitor.read(channel);
        text += fmt::format(
            ", \"{}\": {{\"value\": {}, \"sd\": {}, \"sd_change\": {}, \"usable\": {}, \"sensitivity\": {}}}",
            dqw_parameter_text(static_cast<dqw_monitor_channel>(channel)), number(static_cast<double>(r.value)),
            number(static_cast<double>(r.sd)), number(static_cast<double>(r.sd_change)), r.usable,
            number(monitor.sensitivity(channel)));
    }
    fmt::print("{}}}\n", text);
}

}  // namespace

int main(int argc, char** argv)
{
    double until_s = INFINITY;
    bool q15 = false;
    dqw::Options options;
    for (int i = 1; i < argc; ++i) {
        if (std::strcmp(argv[i], "--q15") == 0)
            q15 = true;
        else if (std::strcmp(argv[i], "--until") == 0 && i + 1 < argc)
            until_s = std::atof(argv[++i]);
        else
            options.logs.emplace_back(argv[i]);
    }
    try {
        std::vector<std::string> notes;
        const std::vector<dqw::Log> logs = dqw::logs_to_monitor(options, notes);
        const dqw::MonitorSetup setup = dqw::monitor_setup(logs, {});
        q15 ? run<Fixed>(logs.front(), setup, until_s) : run<Float>(logs.front(), setup, until_s);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "campaign_reads: %s\n", error.what());
        return 3;
    }
    return 0;
}
