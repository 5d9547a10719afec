// An estimator that is fed sample by sample: that of lib/ in float, or that of port_q15/, with SI on the outside.
#ifndef DQW_APP_MONITOR_ESTIMATOR_HPP
#define DQW_APP_MONITOR_ESTIMATOR_HPP

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "app/monitor/setup.hpp"
#include "dqw_gate.h"
#include "dqw_parameter.h"
#include "dqw_sample.h"
#include "dqw_stage.h"

namespace dqw {

/// The name in results of a parameter of the joint neuron, with its unit as suffix.
const char* estimator_name(int parameter);

struct EstimatorReading {
    double value, sd;  ///< sd infinite where nothing was learned
    bool usable;
};

struct EstimatorState {
    dqw_stage_name stage;
    dqw_gate gate;
    double residual_pu;        ///< of the voltage base
    std::uint32_t blocks;      ///< learned
    std::uint16_t pole_pairs;  ///< 0: not known
};

class EstimatorEngine {
public:
    EstimatorEngine() = default;
    EstimatorEngine(const EstimatorEngine&) = delete;
    EstimatorEngine& operator=(const EstimatorEngine&) = delete;
    virtual ~EstimatorEngine() = default;
    virtual void gap(std::uint32_t periods) = 0;
    /// Gathers a sample and learns the block that waits, if one does.
    virtual void take(const dqw_sample& s) = 0;
    virtual std::array<EstimatorReading, DQW_PARAMETERS> read() const = 0;
    virtual EstimatorState state() const = 0;
    /// As MonitorEngine has them.
    virtual std::string image() const = 0;
    virtual bool take(std::string_view image) = 0;
};

/// Throws std::invalid_argument where the estimator refuses its configuration; `setup` stays in use.
std::unique_ptr<EstimatorEngine> estimator_engine(const MonitorSetup& setup, bool fixed_point);

}  // namespace dqw
#endif
