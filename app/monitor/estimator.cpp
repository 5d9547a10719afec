#include "app/monitor/estimator.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <stdexcept>
#include <vector>

#include "app/base/effect_names.hpp"
#include "app/learn/parts.hpp"
#include "app/monitor/engine.hpp"
#include "app/monitor/image.hpp"
#include "app/q15/effect_q15.hpp"
#include "app/q15/fixed_point.hpp"
#include "app/q15/monitor_config.h"
#include "dqw_estimator_block.h"
#include "dqw_estimator_block_q15.h"
#include "dqw_text.h"

namespace dqw {
namespace {

void accept(dqw_status status, const char* who)
{
    if (status != DQW_OK)
        throw std::invalid_argument(fmt::format("the {} refuses its configuration: {}", who, dqw_status_text(status)));
}

/// Of lib/.
class FloatEstimator : public EstimatorEngine {
public:
    explicit FloatEstimator(const MonitorSetup& setup)
        : config_(setup.config.estimator), effects_(lists_of(setup.inputs))
    {
        config_.effects = effects_.data();
        config_.effect_count = static_cast<std::uint8_t>(effects_.size());
        config_.random = &lent_;
        dqw_estimator_random_init(&lent_);
        accept(dqw_estimator_init(&e_, &config_), "estimator");
    }

    void gap(std::uint32_t periods) override { dqw_estimator_missing(&e_, periods); }

    void take(const dqw_sample& s) override
    {
        (void)dqw_estimator_sample(&e_, &s, false);
        if (!e_.window.over.pending) return;
        (void)dqw_estimator_background(&e_);
        if (e_.stage.name != DQW_STAGE_DOMAIN) return;
        dqw_estimator_random_init(&lent_);
        accept(dqw_estimator_define(&e_, &config_), "estimator");
    }

    std::array<EstimatorReading, DQW_PARAMETERS> read() const override
    {
        std::array<EstimatorReading, DQW_PARAMETERS> all{};
        for (int i = 0; i < DQW_PARAMETERS; ++i) {
            const dqw_reading r = dqw_estimator_read(&e_, static_cast<dqw_parameter>(i));
            all[static_cast<std::size_t>(i)] = {static_cast<double>(r.value),
                                                r.sd < DQW_UNKNOWN ? static_cast<double>(r.sd) : INFINITY, r.usable};
        }
        return all;
    }

    EstimatorState state() const override
    {
        return {e_.stage.name, e_.gate, static_cast<double>(dqw_estimator_residual_pu(&e_)), e_.blocks,
                dqw_estimator_pole_pairs(&e_)};
    }

    std::string image() const override
    {
        std::string bytes;
        put_image(bytes, without_pointers(e_));
        put_image(bytes, without_pointers(lent_));
        return bytes;
    }

    bool take(std::string_view image) override
    {
        dqw_estimator e;
        dqw_estimator_random lent;
        if (!take_image(image, e) || !take_image(image, lent) || !image.empty()) return false;
        point_as(e, e_), point_as(lent, lent_);
        e_ = e, lent_ = lent;
        return true;
    }

private:
    dqw_estimator_config config_;
    const std::vector<dqw_effect_config> effects_;
    dqw_estimator_random lent_{};
    dqw_estimator e_{};
};

/// Of port_q15/.
class Q15Estimator : public EstimatorEngine {
public:
    explicit Q15Estimator(const MonitorSetup& setup)
        : config_(q15_monitor_config(setup).estimator), full_(full_scales(config_.scale))
    {
        for (const TraceInput& in : setup.inputs) effects_.push_back(effect_config_q15(in, full_, 1.0, 0.0));
        config_.effects = effects_.data();
        config_.effect_count = static_cast<std::uint8_t>(effects_.size());
        accept(dqw_estimator_init_q15(&e_, &config_), "fixed-point estimator");
    }

    void gap(std::uint32_t periods) override { dqw_estimator_missing_q15(&e_, periods); }

    void take(const dqw_sample& s) override
    {
        dqw_sample_q15 x;
        const bool good = fixed(s, full_, x);
        const std::uint32_t before = e_.gate.nonfinite;
        (void)dqw_estimator_sample_q15(&e_, &x, !good);
        // As the monitor's engine has it.
        if (!good && e_.gate.nonfinite == before) ++not_numbers_;
        if (!e_.window.over.pending) return;
        (void)dqw_estimator_background_q15(&e_);
        if (e_.stage.name == DQW_STAGE_DOMAIN) accept(dqw_estimator_define_q15(&e_, &config_), "fixed-point estimator");
    }

    std::array<EstimatorReading, DQW_PARAMETERS> read() const override
    {
        std::array<EstimatorReading, DQW_PARAMETERS> all{};
        for (int i = 0; i < DQW_PARAMETERS; ++i) {
            const dqw_reading_q15 r = dqw_estimator_read_q15(&e_, static_cast<dqw_parameter>(i));
            const double unit = unit_q15(config_, i);
            all[static_cast<std::size_t>(i)] = {si(r.value_q40, unit),
                                                r.sd_q40 == INT64_MAX ? INFINITY : si(r.sd_q40, unit), r.usable};
        }
        return all;
    }

    EstimatorState state() const override
    {
        dqw_gate gate = e_.gate;
        gate.saturated -= not_numbers_;
        gate.nonfinite += not_numbers_;
        return {e_.stage.name, gate, DQW_Q15_ROOM * dqw_estimator_residual_q28(&e_) * 0x1p-28, e_.blocks,
                dqw_estimator_pole_pairs_q15(&e_)};
    }

    std::string image() const override
    {
        std::string bytes;
        put_image(bytes, without_pointers(e_));
        put_image(bytes, not_numbers_);
        return bytes;
    }

    bool take(std::string_view image) override
    {
        dqw_estimator_q15 e;
        std::uint32_t not_numbers = 0;
        if (!take_image(image, e) || !take_image(image, not_numbers) || !image.empty()) return false;
        point_as(e, e_);
        e_ = e, not_numbers_ = not_numbers;
        return true;
    }

private:
    dqw_estimator_q15_config config_;
    std::vector<dqw_effect_q15_config> effects_;
    const FullScales full_;
    dqw_estimator_q15 e_{};
    std::uint32_t not_numbers_ = 0;
};

}  // namespace

const char* estimator_name(int parameter)
{
    static const char* const names[] = {"R_ohm",       "Ld_H",     "Lq_H",           "psi_Wb",
                                        "dead_time_V", "psi_q_Wb", "dead_constant_V"};
    static_assert(std::size(names) == DQW_PARAMETERS, "one for each");
    return names[parameter];
}

std::unique_ptr<EstimatorEngine> estimator_engine(const MonitorSetup& setup, bool fixed_point)
{
    if (fixed_point) return std::make_unique<Q15Estimator>(setup);
    return std::make_unique<FloatEstimator>(setup);
}

}  // namespace dqw
