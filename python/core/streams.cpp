#include "streams.hpp"

#include <fmt/format.h>
#include <nanobind/stl/string.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "app/base/input_error.hpp"
#include "app/job/monitor.hpp"
#include "app/monitor/estimator.hpp"
#include "app/monitor/image.hpp"
#include "app/monitor/report.hpp"
#include "app/monitor/session.hpp"
#include "app/monitor/setup_json.hpp"
#include "dqw_version.h"
#include "guard.hpp"
#include "jobs.hpp"
#include "stream_rows.hpp"
#include "table.hpp"
#include "worker.hpp"

namespace nb = nanobind;

namespace dqw::python {
namespace {

/// What a state must have been written by to be read here.
std::string build()
{
    const std::uint16_t one = 1;
    return fmt::format("dqwatch {}, {} {} {} {} {} {} bytes, {} endian", DQW_VERSION, sizeof(dqw_monitor),
                       sizeof(dqw_monitor_q15), sizeof(dqw_estimator_random), sizeof(void*), sizeof(MonitorReadings),
                       sizeof(MonitorSights), *reinterpret_cast<const unsigned char*>(&one) ? "little" : "big");
}

/// A monitor, and what it has told since it was asked.
class Monitor {
public:
    Monitor(const std::string& setup, bool fixed_point)
        : setup_(setup_of_json(setup)), engine_(monitor_engine(setup_, fixed_point)),
          times_(static_cast<double>(setup_.config.estimator.dt_s))
    {
        watch_.event = [this](const MonitorEvent& event) { told_.push_back(event_json(event)); };
    }

    void row(Row row)
    {
        const double missing = times_.take(row);
        if (!session_) session_ = std::make_unique<MonitorSession>(setup_, *engine_, watch_, row.t_s, 0);
        if (missing > 0.0) session_->gap(missing);
        const dqw_estimator_config& c = setup_.config.estimator;
        session_->take(row.t_s, static_cast<double>(c.dt_s), sample_of(row, c.angle));
    }

    std::vector<std::string> told()
    {
        if (session_) session_->forget();
        return std::move(told_);
    }

    std::string status() const { return status_json(*engine_); }
    std::string setup() const { return setup_json(setup_); }
    const Times& times() const { return times_; }

    std::string state() const
    {
        std::string bytes;
        put_image(bytes, times_.last_s());
        put_image(bytes, times_.rows());
        const std::string engine = engine_->image();
        put_image(bytes, static_cast<std::uint64_t>(engine.size()));
        return bytes + engine + (session_ ? session_->kept() : "");
    }

    bool take_state(std::string_view bytes)
    {
        double last_s = 0.0;
        std::uint64_t rows = 0, size = 0;
        if (!take_image(bytes, last_s) || !take_image(bytes, rows) || !take_image(bytes, size) || bytes.size() < size)
            return false;
        if (!engine_->take(bytes.substr(0, size))) return false;
        bytes.remove_prefix(size);
        session_.reset();
        times_.set(last_s, rows);
        if (bytes.empty()) return rows == 0;
        session_ = std::make_unique<MonitorSession>(setup_, *engine_, watch_, last_s, 0);
        return session_->take_kept(bytes);
    }

    Busy busy{0};

private:
    const MonitorSetup setup_;
    std::unique_ptr<MonitorEngine> engine_;
    MonitorWatch watch_;
    std::unique_ptr<MonitorSession> session_;
    std::vector<std::string> told_;
    Times times_;
};

class Estimator {
public:
    Estimator(const std::string& setup, bool fixed_point)
        : setup_(setup_of_json(setup)), engine_(estimator_engine(setup_, fixed_point)),
          times_(static_cast<double>(setup_.config.estimator.dt_s))
    {
    }

    void row(Row row)
    {
        const double missing = times_.take(row);
        if (missing > 0.0) engine_->gap(static_cast<std::uint32_t>(std::min(missing, 4e9)));
        engine_->take(sample_of(row, setup_.config.estimator.angle));
    }

    std::vector<std::string> told() const { return {}; }

    std::string status() const { return status_json(*engine_); }
    std::string setup() const { return setup_json(setup_); }
    const Times& times() const { return times_; }

    std::string state() const
    {
        std::string bytes;
        put_image(bytes, times_.last_s());
        put_image(bytes, times_.rows());
        return bytes + engine_->image();
    }

    bool take_state(std::string_view bytes)
    {
        double last_s = 0.0;
        std::uint64_t rows = 0;
        if (!take_image(bytes, last_s) || !take_image(bytes, rows) || !engine_->take(bytes)) return false;
        times_.set(last_s, rows);
        return true;
    }

    Busy busy{0};

private:
    const MonitorSetup setup_;
    std::unique_ptr<EstimatorEngine> engine_;
    Times times_;
};

template <class Work> auto translated(const Work& work, const std::vector<std::string>& tables = {})
{
    try {
        return work();
    } catch (...) {
        raise_current(tables);
    }
}

template <class Stream> nb::list told_by(Stream& stream)
{
    nb::list out;
    for (const std::string& line : stream.told()) out.append(text_of(line));
    return out;
}

template <class Stream> nb::list step(Stream& stream, const Row& row)
{
    const Guard guard(stream.busy);
    translated([&] { stream.row(row); });
    return told_by(stream);
}

template <class Stream> nb::list block(Stream& stream, const TableHandle& handle)
{
    const Guard guard(stream.busy);
    std::size_t number = 0;
    try {
        const nb::gil_scoped_release release;
        const RowColumns columns(*handle.table);
        while (const double* values = handle.table->next()) {
            stream.row(columns.of(values));
            ++number;
        }
    } catch (const std::invalid_argument& error) {
        raise_usage(fmt::format("row {} of the block: {}", number, error.what()));
    } catch (...) {
        raise_current();
    }
    return told_by(stream);
}

template <class Stream> void bind(nb::module_& m, const char* name)
{
    nb::class_<Stream>(m, name)
        .def("__init__", [](Stream* self, const std::string& setup,
                            bool fixed_point) { translated([&] { new (self) Stream(setup, fixed_point); }); })
        .def("step",
             [](Stream& s, double t_s, double v_d_V, double v_q_V, double i_d_A, double i_q_A, double w_m_rad_s,
                double theta_e_rad, double temp_winding_C, double temp_magnet_C) {
                 return step(s,
                             {t_s, v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s, theta_e_rad, temp_winding_C, temp_magnet_C});
             })
        .def("block", [](Stream& s, const TableHandle& table) { return block(s, table); })
        .def("status",
             [](Stream& s) {
                 const Guard guard(s.busy);
                 return s.status();
             })
        .def("setup", [](const Stream& s) { return s.setup(); })
        .def_prop_ro("rows", [](const Stream& s) { return s.times().rows(); })
        .def_prop_ro("t_s", [](const Stream& s) { return s.times().last_s(); })
        .def("state",
             [](Stream& s) {
                 const Guard guard(s.busy);
                 const std::string bytes = s.state();
                 return nb::bytes(bytes.data(), bytes.size());
             })
        .def("take_state", [](Stream& s, const nb::bytes& bytes) {
            const Guard guard(s.busy);
            return s.take_state(std::string_view(static_cast<const char*>(bytes.data()), bytes.size()));
        });
}

/// The configuration that the monitor takes for a log.
nb::object setup_job(const nb::dict& asked, const nb::list& tables, const nb::object& told)
{
    const Options wanted = options_of(asked, tables);
    std::string json;
    run_job(
        [&](const JobProgress& progress) {
            Options options = wanted;
            options.progress = progress;
            json = setup_json(setup_to_monitor(options));
        },
        told, names_of(wanted));
    return text_of(json);
}

}  // namespace

void bind_streams(nb::module_& m)
{
    m.attr("build") = build();
    bind<Monitor>(m, "MonitorStream");
    bind<Estimator>(m, "EstimatorStream");
    m.def("monitor_setup", &setup_job, nb::arg("asked"), nb::arg("tables"), nb::arg("told").none());
}

}  // namespace dqw::python
