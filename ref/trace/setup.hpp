// From logs to a model, its candidates, and what cannot be tested.
#ifndef DQW_REF_TRACE_SETUP_HPP
#define DQW_REF_TRACE_SETUP_HPP

#include <memory>
#include <optional>

#include "ref/model/column_noise.hpp"
#include "ref/model/electrical.hpp"
#include "ref/search/select.hpp"
#include "ref/trace/trace.hpp"

namespace dqw {

/// Everything that a trace works on. Models refer to the columns beside them, so this stays where it is.
struct TraceSetup {
    const std::vector<Log>* logs = nullptr;
    Regime regime = Regime::dynamic;
    double pole_pairs = 1.0;
    bool pole_pairs_known = true;  ///< else 1 stands for them
    double real_pole_pairs = 0.0;  ///< as the plain fit has them, where no whole number stands out
    double i_base_A = 1.0, span_s = 0.0, speed_base_rad_s = 0.0;
    std::size_t beyond_hexagon = 0;  ///< rows that are neither seen nor judged: no inverter on this link makes them
    std::string turns_apart;         ///< where the angle column does not turn with the speed: how
    bool one_speed = false;          ///< settled points that turn, all alike
    bool rotor_held = false;         ///< within a period the voltage turns with the rotor
    std::vector<TraceColumns> columns;
    std::vector<std::vector<double>> torque, angle;
    std::unique_ptr<Model> full;                ///< of all rows
    std::unique_ptr<ColumnNoise> column_noise;  ///< of a dynamic log; its draws are made when first asked for
    std::unique_ptr<Model> part;                ///< of windows spread over a long log, for the search; else null
    std::vector<Point> starts;
    std::vector<Candidate> candidates;
    std::vector<TraceRejected> untestable;
    double hat_noise_part = 0.0;  ///< of a mechanical log's slopes under hats
    std::vector<std::string> notes;

    const Model& search() const { return part ? *part : *full; }
};

/// How a regime's model is meant where there are two ways.
enum class Variant {
    usual,
    averaged,   ///< of a mechanical log: block means instead of predictions
    rotor_held  ///< of a dynamic log: within a period the voltage turns with the rotor instead of standing still
};

/// Throws std::invalid_argument (one line) where logs do not fit together or rows are too few to hold some out.
/// `only`: names of the effects to try; empty: all. `pole_pairs`: where no log says them; 0: found.
std::unique_ptr<TraceSetup> trace_setup(const std::vector<Log>& logs, const std::vector<std::string>& only,
                                        Variant variant = Variant::usual, double pole_pairs = 0.0);

/// The firmware's view of a term: its shape completed from the base parameters.
TraceInput input_of(const TraceSetup& setup, const Point& at, const Term& term);

}  // namespace dqw
#endif
