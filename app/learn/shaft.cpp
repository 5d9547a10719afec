#include "app/learn/shaft.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/learn/inputs.hpp"
#include "app/learn/residual.hpp"
#include "app/learn/signals.hpp"

namespace dqw {
namespace {

constexpr double kHalfWindow_s = 25e-3;
// Half a block may see this much of a cogging's own angle.
constexpr double kHalfAngle_rad = 1.5;

std::uint16_t half_window_of(double dt_s, const std::vector<TraceInput>& inputs, double w_m_rad_s)
{
    double span_s = kHalfWindow_s;
    int least = 10;
    for (const TraceInput& in : inputs)
        if (in.effect == "cogging_torque" && kHalfAngle_rad / (in.shape[0] * w_m_rad_s) < span_s) {
            span_s = kHalfAngle_rad / (in.shape[0] * w_m_rad_s);
            least = 3;
        }
    return half_window(span_s, dt_s, least);
}

void put(Result& result, const char* name, const ShaftValue& read, const char* why, const char* excitation)
{
    if (read.known)
        result.parameters.push_back({name, read.value, read.sd, false});
    else
        result.not_identifiable.push_back(
            {name,
             std::isfinite(read.sd) ? fmt::format("{}: {:.3g} with a deviation of {:.3g}", why, read.value, read.sd)
                                    : std::string(why),
             excitation});
}

}  // namespace

ShaftLogs shaft_logs(const std::vector<Log>& logs, const LearnOptions& options)
{
    ShaftLogs shaft;
    check_room(options.inputs);
    if (!options.inputs.empty()) shaft.inputs = completed(options.inputs, logs, {});
    shaft.torque_constant_Nm_A = logs.front().machine.torque_constant_Nm_A.value_or(0.0);
    for (const Log& log : logs) {
        shaft.torques.push_back(torque_of(log, shaft.torque_constant_Nm_A, shaft.source));
        for (double t : shaft.torques.back()) shaft.largest_torque_Nm = std::max(shaft.largest_torque_Nm, std::abs(t));
    }
    if (!(shaft.largest_torque_Nm > 1e-30)) shaft.largest_torque_Nm = 1.0;
    shaft.largest_w_rad_s = static_cast<double>(largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s));
    shaft.half_window = half_window_of(logs.front().dt_s, shaft.inputs, shaft.largest_w_rad_s);
    return shaft;
}

void report_shaft(const std::vector<Log>& logs, const LearnOptions& options, const ShaftLogs& shaft,
                  const ShaftRead& read, const dqw_gate& gate, Learned& learned)
{
    Result& result = learned.result;
    result.rows = all_rows(logs);
    result.regime = Regime::mechanical;
    result.notes.push_back("torque: " + shaft.source);
    const Asked asked{options.parameters, {"J_kgm2", "B_Nms_rad"}};
    if (asked("J_kgm2"))
        put(result, "J_kgm2", read.J_kgm2, "the speed hardly changes", "steps of torque that accelerate the machine");
    if (asked("B_Nms_rad"))
        put(result, "B_Nms_rad", read.B_Nms_rad, "no torque that grows with speed stands out",
            "several speeds, held long enough, in both directions");
    if (asked("torque_constant_Nm_A"))
        put(result, "torque_constant_Nm_A", read.torque_constant_Nm_A,
            "torque_Nm and i_q_A are not both logged, or hardly change",
            "a log with torque_Nm and i_q_A at several levels");
    note_gate(gate, 0, result);
    PlainModel& model = learned.model;
    model.J_kgm2 = read.J_kgm2.value;
    model.B_Nms_rad = read.B_Nms_rad.value;
    model.torque_constant_Nm_A = shaft.torque_constant_Nm_A;
    put_effects(read.inputs, learned);
    report_residual_of(logs, learned.inputs, model, nullptr, result);
}

}  // namespace dqw
