#include "simulate.hpp"

#include <fmt/format.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <memory>
#include <string>
#include <vector>

#include "app/base/text.hpp"
#include "app/job/scenario.hpp"
#include "app/job/simulate.hpp"
#include "dqw_sim.h"
#include "error.hpp"
#include "guard.hpp"
#include "jobs.hpp"
#include "worker.hpp"

namespace nb = nanobind;

namespace dqw::python {
namespace {

using Samples = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

struct Column {
    const char* name;
    double dqw_sim_row::*value;
};
constexpr Column columns_of_row[] = {
    {"t_s", &dqw_sim_row::t_s},
    {"v_d_V", &dqw_sim_row::v_d_V},
    {"v_q_V", &dqw_sim_row::v_q_V},
    {"i_d_A", &dqw_sim_row::i_d_A},
    {"i_q_A", &dqw_sim_row::i_q_A},
    {"w_m_rad_s", &dqw_sim_row::w_m_rad_s},
    {"theta_e_rad", &dqw_sim_row::theta_e_rad},
    {"theta_m_rad", &dqw_sim_row::theta_m_rad},
    {"v_dc_V", &dqw_sim_row::v_dc_V},
    {"temp_winding_C", &dqw_sim_row::temp_winding_C},
    {"temp_magnet_C", &dqw_sim_row::temp_magnet_C},
    {"torque_Nm", &dqw_sim_row::torque_Nm},
};

dqw_sim_signal* signal_named(dqw_sim_profile& profile, const std::string& name)
{
    const std::pair<const char*, dqw_sim_signal*> all[] = {{"speed_rad_s", &profile.speed_rad_s},
                                                           {"i_d_A", &profile.i_d_A},
                                                           {"i_q_A", &profile.i_q_A},
                                                           {"v_d_V", &profile.v_d_V},
                                                           {"v_q_V", &profile.v_q_V},
                                                           {"load_Nm", &profile.load_Nm}};
    for (const auto& [known, signal] : all)
        if (name == known) return signal;
    raise_usage("no " + name + " in a profile; expected speed_rad_s, i_d_A, i_q_A, v_d_V, v_q_V or load_Nm");
}

/// The scenario that is asked for; arrays are kept here as long as it runs.
struct Asked {
    dqw_sim_scenario scenario;
    std::vector<std::string> notes;
    std::vector<Samples> kept;
};

/// As the command's, but for where all keys are named.
void set_value(dqw_sim_scenario& scenario, const std::string& setting)
{
    const std::string key = setting.substr(0, setting.find('='));
    dqw_sim_scenario scratch = scenario;
    if (dqw_sim_set(&scratch, key.c_str(), "") == DQW_SIM_ERR_KEY)
        throw UsageError("no key " + shown(key) + " of a drive; dqwatch.scenario_keys() names all");
    set(scenario, setting);
}

/// `cleared`: signals that begin from nothing before the settings; `tables`: (name, array, its period).
Asked asked_of(const nb::dict& asked, const nb::list& cleared, const nb::list& tables)
{
    Options options = options_of(asked, nb::list());
    Asked out;
    try {
        std::vector<std::string> settings;
        std::swap(settings, options.settings);
        out.scenario = scenario_asked(options, out.notes);
        for (const nb::handle name : cleared)
            *signal_named(out.scenario.profile, nb::cast<std::string>(name)) = dqw_sim_signal{};
        for (const std::string& setting : settings) set_value(out.scenario, setting);
    } catch (...) {
        raise_current();
    }
    for (const nb::handle item : tables) {
        const auto entry = nb::cast<nb::tuple>(item);
        dqw_sim_signal* signal = signal_named(out.scenario.profile, nb::cast<std::string>(entry[0]));
        out.kept.push_back(nb::cast<Samples>(entry[1]));
        signal->table = out.kept.back().data();
        signal->table_rows = out.kept.back().shape(0);
        signal->table_dt_s = nb::cast<double>(entry[2]);
    }
    return out;
}

nb::dict arrays_of(const std::vector<dqw_sim_row>& rows)
{
    nb::dict out;
    for (const Column& column : columns_of_row) {
        auto values = std::make_unique<std::vector<double>>();
        values->reserve(rows.size());
        for (const dqw_sim_row& row : rows) values->push_back(row.*(column.value));
        double* data = values->data();
        const nb::capsule owner(values.release(),
                                [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
        out[column.name] = nb::cast(nb::ndarray<nb::numpy, double, nb::ndim<1>>(data, {rows.size()}, owner));
    }
    return out;
}

nb::dict result_of(const Simulation& run, const std::vector<std::string>& notes)
{
    nb::dict out;
    out["json"] = text_of(simulation_json(run, "", "", notes));
    out["columns"] = arrays_of(run.rows);
    nb::list said;
    for (const std::string& note : notes) said.append(text_of(note));
    out["notes"] = said;
    return out;
}

nb::dict simulate_job(const nb::dict& asked, const nb::list& cleared, const nb::list& tables, const nb::object& told)
{
    const Asked what = asked_of(asked, cleared, tables);
    Simulation run;
    run_job(
        [&](const JobProgress& progress) {
            run = simulate(what.scenario, [&](double fraction) { progress("simulating", fraction); });
        },
        told, {});
    return result_of(run, what.notes);
}

nb::tuple tuple_of(const dqw_sim_row& r)
{
    return nb::make_tuple(r.t_s, r.v_d_V, r.v_q_V, r.i_d_A, r.i_q_A, r.w_m_rad_s, r.theta_e_rad, r.theta_m_rad,
                          r.v_dc_V, r.temp_winding_C, r.temp_magnet_C, r.torque_Nm);
}

/// A drive that Python steps.
class Stepper {
public:
    Stepper(const nb::dict& asked, const nb::list& cleared, const nb::list& tables)
        : asked_(asked_of(asked, cleared, tables))
    {
        if (dqw_sim_open(&asked_.scenario, &x_, &seen_, why_, sizeof why_) != DQW_SIM_OK)
            raise_usage(std::string(asked_.scenario.name) + ": " + why_);
    }
    ~Stepper() { dqw_sim_close(x_); }
    Stepper(const Stepper&) = delete;
    Stepper& operator=(const Stepper&) = delete;

    nb::tuple seen() const { return tuple_of(seen_); }

    nb::tuple step(double v_d_V, double v_q_V, double load_Nm, double speed_rad_s)
    {
        const Guard guard(busy_);
        if (failed_) raise_usage("this run has failed before; expected a new one");
        const dqw_sim_decision decision = {v_d_V, v_q_V, load_Nm, speed_rad_s};
        dqw_sim_row logged;
        const int status = dqw_sim_step(x_, &decision, &seen_, &logged, why_, sizeof why_);
        // A decision that is none has moved nothing.
        failed_ = status != DQW_SIM_OK && status != DQW_SIM_ERR_VALUE;
        if (status != DQW_SIM_OK) raise_usage(std::string(asked_.scenario.name) + ": " + why_);
        rows_.push_back(logged);
        return tuple_of(seen_);
    }

    nb::dict log()
    {
        const Guard guard(busy_);
        std::vector<dqw_sim_row> rows = rows_;
        if (!rows.empty()) dqw_sim_log_of(x_, rows.data(), rows.size());
        return arrays_of(rows);
    }

    double period_s() const { return asked_.scenario.drive.dt_s; }
    int pole_pairs() const { return asked_.scenario.machine.pole_pairs; }

private:
    Asked asked_;
    dqw_sim_stepper* x_ = nullptr;
    dqw_sim_row seen_{};
    std::vector<dqw_sim_row> rows_;
    char why_[400] = "";
    bool failed_ = false;
    Busy busy_{0};
};

nb::list scenarios()
{
    nb::list all;
    for (std::size_t i = 0; i < dqw_sim_scenario_count(); ++i) {
        const dqw_sim_scenario* s = dqw_sim_scenario_at(i);
        all.append(nb::make_tuple(s->name, s->regime, s->about));
    }
    return all;
}

nb::list keys()
{
    nb::list all;
    for (std::size_t i = 0; const char* key = dqw_sim_key_at(i); ++i) all.append(nb::str(key));
    return all;
}

/// The drive's period, by which a profile's arrays are laid out.
double scenario_period_s(const nb::dict& asked) { return asked_of(asked, nb::list(), nb::list()).scenario.drive.dt_s; }

}  // namespace

void bind_simulate(nb::module_& m)
{
    m.def("simulate", simulate_job, nb::arg("asked"), nb::arg("cleared"), nb::arg("tables"), nb::arg("told").none());
    m.def("scenario_period_s", scenario_period_s);
    m.def("scenarios", scenarios);
    m.def("scenario_keys", keys);
    nb::class_<Stepper>(m, "Stepper")
        .def(nb::init<const nb::dict&, const nb::list&, const nb::list&>())
        .def("step", &Stepper::step)
        .def("log", &Stepper::log)
        .def_prop_ro("seen", &Stepper::seen)
        .def_prop_ro("period_s", &Stepper::period_s)
        .def_prop_ro("pole_pairs", &Stepper::pole_pairs);
}

}  // namespace dqw::python
