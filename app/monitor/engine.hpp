// A condition monitor as the command runs it: that of lib/ in float, or that of port_q15/ in fixed point, with SI on
// the outside.
#ifndef DQW_APP_MONITOR_ENGINE_HPP
#define DQW_APP_MONITOR_ENGINE_HPP

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "app/monitor/readings.hpp"
#include "app/monitor/setup.hpp"
#include "dqw_fault.h"
#include "dqw_gate.h"
#include "dqw_model.h"
#include "dqw_monitor_q15.h"
#include "dqw_stage.h"

namespace dqw {

/// What a monitor says of itself, between two samples.
struct MonitorState {
    dqw_stage stage;
    dqw_gate gate;
    double residual_pu;  ///< of the voltage base
    std::uint32_t blocks, missed, restarts, witness_blocks, friction_looks;
};

/// An event, in halves of a window; value and deviation in the unit of its name.
struct MonitorTold {
    std::uint32_t half, since;
    dqw_monitor_channel parameter;
    double value, sd;
    dqw_fault_verdict fault;
};

class MonitorEngine {
public:
    MonitorEngine() = default;
    MonitorEngine(const MonitorEngine&) = delete;
    MonitorEngine& operator=(const MonitorEngine&) = delete;
    virtual ~MonitorEngine() = default;
    virtual void gap(std::uint32_t periods) = 0;
    /// True where a block waits for background().
    virtual bool sample(const dqw_sample& s) = 0;
    virtual std::optional<MonitorTold> background() = 0;
    /// Stage 1 again. Throws std::invalid_argument where the configuration is refused.
    virtual void define() = 0;
    /// Halves of a window since it began.
    virtual std::uint32_t halves() const = 0;
    virtual MonitorMeasures measures() const = 0;
    virtual MonitorState state() const = 0;
    /// What it could see now, in the units of the names.
    virtual MonitorSights sights() const = 0;
    /// What was learned as healthy, lib/'s own struct byte by byte; empty before it stands.
    virtual std::string store() const = 0;
    /// Gives it back, before the first sample; what it is refused for, empty where it is taken.
    virtual std::string restore(const std::string& stored) = 0;
    /// All of its state, for an engine of the same setup in the same build.
    virtual std::string image() const = 0;
    /// Goes on as the engine that gave it would. False where it is none of this engine's, which is then as it was.
    virtual bool take(std::string_view image) = 0;
};

/// Throws std::invalid_argument where the monitor refuses its configuration; `setup` stays in use as long as the
/// engine.
std::unique_ptr<MonitorEngine> monitor_engine(const MonitorSetup& setup, bool fixed_point);

/// With what it runs in fixed point. Throws std::invalid_argument for what that does not take.
dqw_monitor_q15_config q15_monitor_config(const MonitorSetup& setup);

/// What 1 of a channel's reading in fixed point is, in the unit that float reads it in.
double channel_unit_q15(const dqw_estimator_q15_config& c, int channel);

}  // namespace dqw
#endif
