// What a monitor has learned as healthy, in a file: it outlives the program that watched.
#ifndef DQW_APP_MONITOR_STORE_HPP
#define DQW_APP_MONITOR_STORE_HPP

#include <optional>
#include <string>
#include <vector>

#include "app/monitor/setup.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// What gives the healthy values their meaning, and themselves.
struct MonitorStore {
    std::string arithmetic;  ///< "float" or "q15"
    double dt_s = 0.0;
    Machine machine;  ///< bases, start values, pole pairs, inertia
    std::string modulation;
    double dead_time_width_A = 0.0, speed_lag_s = 0.0, voltage_error_V = 0.0;
    std::vector<TraceInput> inputs;
    std::string healthy;  ///< lib/'s own struct, byte by byte
};

/// With what `setup` runs.
MonitorStore store_of(const MonitorSetup& setup, const std::string& arithmetic, const std::string& healthy);

/// Text of schema dqwatch.store/1, one line with its check sum.
std::string store_text(const MonitorStore& store);

/// The file's; nothing where there is no file. Throws InputError: unreadable, no store, of another version, damaged.
std::optional<MonitorStore> read_store(const std::string& path);

/// Writes the whole file or none of it. Throws OutputError.
void write_store(const std::string& path, const MonitorStore& store);

/// What the store knows and nobody has said: period, bases, start values and modulation of `log`. Throws InputError,
/// with the store's `path`, where it belongs to another motor.
void take_from_store(const MonitorStore& store, const std::string& path, const std::string& arithmetic, Log& log);

/// Shapes of the effects as they were then. Throws InputError where the effects are others.
void take_from_store(const MonitorStore& store, const std::string& path, MonitorSetup& setup);

}  // namespace dqw
#endif
