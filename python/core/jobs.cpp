#include "jobs.hpp"

#include <fmt/format.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/base/learnable.hpp"
#include "app/base/parameters.hpp"
#include "app/base/text.hpp"
#include "app/job/columns.hpp"
#include "app/job/compare.hpp"
#include "app/job/estimate.hpp"
#include "app/job/monitor.hpp"
#include "app/job/trace.hpp"
#include "app/monitor/page.hpp"
#include "app/report/report.hpp"
#include "app/trace/page.hpp"
#include "error.hpp"
#include "table.hpp"
#include "worker.hpp"

namespace nb = nanobind;

namespace dqw::python {
namespace {

template <class T> void take(const nb::dict& asked, const char* key, T& to)
{
    if (asked.contains(key) && !nb::try_cast(asked[key], to))
        raise_usage(std::string(key) + " is " + nb::cast<std::string>(nb::repr(asked[key])) +
                    "; expected a value of another type, as help() has it");
}

template <class T> void take(const nb::dict& asked, const char* key, std::optional<T>& to)
{
    if (!asked.contains(key)) return;
    T value{};
    take(asked, key, value);
    to = value;
}

void check_positive(const char* name, const std::optional<double>& value)
{
    if (value && !(*value > 0.0 && std::isfinite(*value)))
        raise_usage(fmt::format("{} is {}; expected a number above 0", name, *value));
}

/// What the command's parser would refuse.
void check(const Options& o)
{
    if (o.pole_pairs && (*o.pole_pairs < 1 || *o.pole_pairs > 1000))
        raise_usage(fmt::format("pole_pairs is {}; expected 1 to 1000", *o.pole_pairs));
    check_positive("gear", o.gear);
    check_positive("v_dc_V", o.v_dc_V);
    check_positive("period_s", o.period_s);
    if (o.arith != "float" && o.arith != "q15")
        raise_usage("arithmetic is " + shown(o.arith) + "; expected float or q15");
    const auto names = [](const std::vector<std::string>& asked, const std::vector<std::string>& known,
                          const char* what) {
        for (const std::string& name : asked)
            if (std::find(known.begin(), known.end(), name) == known.end())
                raise_usage(fmt::format("no {} {}; expected of {}", what, shown(name), list(known, 99)));
    };
    names(o.parameters, known_parameters(), "parameter");
    names(o.effects, traced_names(), "effect");
}

nb::list texts(const std::vector<std::string>& all)
{
    nb::list out;
    for (const std::string& text : all) out.append(text_of(text));
    return out;
}

nb::dict estimation(const Options& asked, const nb::object& told, Estimation (*estimate)(const Options&))
{
    Estimation done;
    run_job(
        [&](const JobProgress& progress) {
            Options options = asked;
            options.progress = progress;
            done = estimate(options);
        },
        told, names_of(asked));
    nb::dict out;
    out["json"] = text_of(estimation_json(done));
    out["text"] = text_of(estimation_text(done));
    out["notes"] = texts(done.estimated.result.notes);
    out["q15_config"] = text_of(done.estimated.q15_config);
    return out;
}

nb::dict fit_job(const nb::dict& asked, const nb::list& tables, const nb::object& told)
{
    return estimation(options_of(asked, tables), told, fit_logs);
}

nb::dict learn_job(const nb::dict& asked, const nb::list& tables, const nb::object& told)
{
    return estimation(options_of(asked, tables), told, learn_logs);
}

nb::dict trace_job(const nb::dict& asked, const nb::list& tables, const nb::object& told)
{
    const Options wanted = options_of(asked, tables);
    std::string json, text, page, first;
    std::vector<std::string> notes;
    run_job(
        [&](const JobProgress& progress) {
            Options options = wanted;
            options.progress = progress;
            std::vector<std::string> said;
            const std::vector<Log> logs = logs_to_trace(options, said);
            const TraceReport report = trace_logs(logs, options, said);
            json = json_text(trace_json(report)), text = trace_text(report);
            page = report_page(report), first = report_page(report, Extent::first_screen);
            notes = report.trace.notes;
        },
        told, names_of(wanted));
    nb::dict out;
    out["json"] = text_of(json);
    out["text"] = text_of(text);
    out["page"] = text_of(page);
    out["first"] = text_of(first);
    out["notes"] = texts(notes);
    return out;
}

nb::dict compare_job(const nb::dict& asked, const nb::list& tables, const nb::object& told)
{
    const Options wanted = options_of(asked, tables);
    Comparison c;
    run_job(
        [&](const JobProgress& progress) {
            Options options = wanted;
            options.progress = progress;
            c = compare_log(log_to_compare(options), options);
        },
        told, names_of(wanted));
    nb::dict out;
    out["json"] = text_of(json_text(compare_json(c)));
    out["text"] = text_of(compare_text(c));
    out["page"] = text_of(compare_page(c));
    out["first"] = text_of(compare_page(c, Extent::first_screen));
    out["notes"] = texts(c.notes);
    return out;
}

nb::dict columns_job(const nb::dict& asked, const nb::list& tables, const nb::object& told)
{
    const Options wanted = options_of(asked, tables);
    if (wanted.logs.size() != 1) raise_usage(fmt::format("{} logs; expected one", wanted.logs.size()));
    std::string json, text;
    std::vector<std::string> notes;
    run_job(
        [&](const JobProgress& progress) {
            Options options = wanted;
            options.progress = progress;
            const Surveyed surveyed = survey_log(options);
            json = survey_json(surveyed), text = survey_text(surveyed), notes = surveyed.notes;
        },
        told, names_of(wanted));
    nb::dict out;
    out["json"] = text_of(json);
    out["text"] = text_of(text);
    out["notes"] = texts(notes);
    return out;
}

nb::dict monitor_job(const nb::dict& asked, const nb::list& tables, const nb::object& told)
{
    const Options wanted = options_of(asked, tables);
    Monitored done;
    std::string json, text;
    run_job(
        [&](const JobProgress& progress) {
            Options options = wanted;
            options.progress = progress;
            std::vector<std::string> said;
            const std::vector<Log> logs = logs_to_monitor(options, said);
            MonitorListener listener;
            listener.event = [&](const MonitorEvent& event) { json += event_json(event), text += event_text(event); };
            done = monitor_logs(logs, options, said, listener);
        },
        told, names_of(wanted));
    json += sensitivity_json(done.report.run), text += monitor_text(done.report.run);
    nb::dict out;
    out["json"] = text_of(json);
    out["text"] = text_of(text);
    out["page"] = text_of(monitor_page(done.report));
    out["first"] = text_of(monitor_page(done.report, Extent::first_screen));
    out["outcome"] = text_of(monitor_outcome(done.report.run));
    out["rows"] = done.report.run.rows;
    out["q15_header"] = text_of(done.q15_header);
    out["notes"] = texts(done.report.notes);
    return out;
}

}  // namespace

nb::object text_of(const std::string& bytes)
{
    return nb::steal(PyUnicode_DecodeUTF8(bytes.data(), static_cast<Py_ssize_t>(bytes.size()), "replace"));
}

std::vector<std::string> names_of(const Options& options)
{
    std::vector<std::string> names;
    for (const auto& entry : options.tables) names.push_back(entry.first);
    return names;
}

Options options_of(const nb::dict& asked, const nb::list& tables)
{
    Options o;
    take(asked, "logs", o.logs);
    take(asked, "pole_pairs", o.pole_pairs);
    take(asked, "gear", o.gear);
    take(asked, "v_dc_V", o.v_dc_V);
    take(asked, "period_s", o.period_s);
    take(asked, "format", o.format);
    take(asked, "machine_file", o.machine_file);
    take(asked, "machine_text", o.machine_text);
    take(asked, "config_file", o.config_file);
    take(asked, "config_text", o.config_text);
    take(asked, "parameters", o.parameters);
    take(asked, "effects", o.effects);
    take(asked, "arithmetic", o.arith);
    take(asked, "scenario", o.scenario);
    take(asked, "settings", o.settings);
    take(asked, "seed", o.seed);
    take(asked, "polled", o.polled);
    take(asked, "modulation", o.modulation);
    for (const nb::handle item : tables) {
        const auto pair = nb::cast<nb::tuple>(item);
        o.tables[nb::cast<std::string>(pair[0])] = nb::cast<TableHandle&>(pair[1]).table;
    }
    check(o);
    return o;
}

void bind_jobs(nb::module_& m)
{
    nb::class_<TableHandle>(m, "Table");
    m.def("arrays", [](const nb::list& columns) { return TableHandle{table_of_arrays(columns)}; });
    m.def("stream",
          [](const nb::object& capsule, std::size_t rows) { return TableHandle{table_of_stream(capsule, rows)}; });
    const auto job = [&m](const char* name, auto* function) {
        m.def(name, function, nb::arg("asked"), nb::arg("tables"), nb::arg("told").none());
    };
    job("fit", fit_job);
    job("learn", learn_job);
    job("trace", trace_job);
    job("compare", compare_job);
    job("monitor", monitor_job);
    job("columns", columns_job);
}

}  // namespace dqw::python
