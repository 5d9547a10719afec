#include "app/monitor/notes.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/base/text.hpp"
#include "app/monitor/names.hpp"
#include "app/monitor/report.hpp"
#include "dqw_text.h"

namespace dqw {
namespace {

/// Up to this part of itself a parameter may be uncertain in service.
constexpr double kKnown = 0.1, kKnownObserved = 0.2;
constexpr std::size_t kMostTold = 5;

struct Help {
    int channel;
    const char* excitation;
};
const Help helps[] = {
    {DQW_WATCH_R, "a current of several levels, best at low speed"},
    {DQW_WATCH_LD, "a varying i_d: steps of its reference or a random binary voltage on v_d"},
    {DQW_WATCH_LQ, "a varying i_q: steps of torque or a random binary voltage on v_q"},
    {DQW_WATCH_PSI, "a turning machine"},
    {DQW_WATCH_MAP_D, "currents that bend the iron, in both directions of i_d"},
    {DQW_WATCH_MAP_Q, "currents that bend the iron, up to the largest i_q"},
};

std::string percents(const dqw_stage& stage)
{
    return fmt::format("{:.3g} % of the voltage base, threshold {:.3g} %", 1e-4 * stage.residual_ppm,
                       1e-4 * stage.threshold_ppm);
}

std::string reason(const dqw_stage& stage)
{
    switch (stage.back) {
    case DQW_BACK_NOT_CONVERGED: return "the coarse values did not settle";
    case DQW_BACK_THRESHOLD:
        return "the residual stayed above its threshold (" + percents(stage) +
               "): the model lacks something, dqwatch trace tells what";
    case DQW_BACK_LEFT_BAND: return "the residual rose above its threshold (" + percents(stage) + ")";
    case DQW_BACK_NONE: break;
    }
    return "";
}

}  // namespace

std::string why_no_service(const MonitorRun& run)
{
    if (run.served) return "";
    std::vector<std::string> unknown, help;
    const double known = run.observed ? kKnownObserved : kKnown;
    for (const Help& h : helps) {
        const MonitorReading& r = run.last[static_cast<std::size_t>(h.channel)];
        const MonitorSight& sight = run.sights[static_cast<std::size_t>(h.channel)];
        const bool of_no_map = dqw_watch_is_map(h.channel) && sight.why == DQW_WHY_NOT_ASKED;
        if (of_no_map || r.sd < known * r.value) continue;
        const std::string title = channel_named(h.channel).title;
        unknown.push_back(title);
        help.push_back(fmt::format("for {} {}", title, h.excitation));
    }
    if (run.end.stage.times_back > 0 && run.end.stage.back == DQW_BACK_THRESHOLD) return reason(run.end.stage);
    const bool lacks = run.end.blocks > 0 && 1e6 * run.end.residual_pu > run.end.stage.threshold_ppm;
    if (!unknown.empty())
        return fmt::format(
            "{} {} not known within {:.0f} %; {}", list(unknown), unknown.size() == 1 ? "is" : "are", 100.0 * known,
            lacks ? fmt::format(
                        "the model leaves {:.2g} % of the voltage base unexplained, dqwatch trace tells what it lacks",
                        100.0 * run.end.residual_pu)
                  : fmt::format("what would help: {}", fmt::join(help, "; ")));
    if (run.end.stage.times_back > 0) return reason(run.end.stage);
    return "the log ends before all stages are done; what would help: a longer log";
}

std::string why_not_watched(int channel, dqw_why why)
{
    std::string out = dqw_why_text(why);
    const bool by_angle = channel >= DQW_WATCH_DEAD_TIME && channel < DQW_WATCH_FRICTION;
    if (why == DQW_WHY_NOT_ASKED && by_angle) return out + ": there is no theta_e_rad or theta_m_rad";
    if (why == DQW_WHY_NOT_ASKED) return out + ": there is no J_kgm2";
    if (why != DQW_WHY_NOT_TAUGHT) return out;
    if (channel == DQW_WATCH_FRICTION) return out + ": reversals of the direction would, 32 of them";
    if (channel >= DQW_WATCH_OFFSET && channel < DQW_WATCH_FRICTION)
        return out + ": it turned too slowly or too fast to tell a ripple";
    const int taught_with = channel == DQW_WATCH_TEMPERATURE || channel == DQW_WATCH_DEAD_TIME ? int{DQW_WATCH_R}
                            : channel == DQW_WATCH_ANGLE                                       ? int{DQW_WATCH_PSI}
                                                                                               : channel;
    for (const Help& h : helps)
        if (h.channel == taught_with) out += fmt::format(": {} would", h.excitation);
    return out;
}

std::string way_back_text(double t_s, const dqw_stage& stage)
{
    return fmt::format("back to stage 1 at {:.3f} s: {}; the monitor learns anew", t_s, reason(stage));
}

std::vector<std::string> closing_notes(const MonitorRun& run)
{
    std::vector<std::string> notes;
    if (!run.served) notes.push_back("not in service: " + why_no_service(run));
    if (run.served && !run.watched)
        notes.emplace_back(
            "nothing was watched: the log ends before healthy values were taken; what would help: a longer log");
    if (run.end.stage.times_back > 1)
        notes.push_back(fmt::format("{} ways back to stage 1 in all", run.end.stage.times_back));
    if (run.watched && run.angle && !run.ripple_watched)
        notes.emplace_back("unlike phases and current sensors are not watched: the machine turned too slowly or too "
                           "fast to tell their ripple");
    if (run.watched && run.friction_wanted && !std::isfinite(run.healthy[DQW_WATCH_FRICTION].healthy))
        notes.emplace_back("friction was not watched: it takes longer in both directions of motion than this log has");
    for (std::size_t k = 0; k < run.relearned.size() && k < kMostTold; ++k)
        notes.push_back(relearned_text(run.relearned[k]));
    if (run.end.missed > 0) notes.push_back(fmt::format("{} lost", counted(run.end.missed, "block")));
    if (run.end.restarts > 0)
        notes.push_back(fmt::format("learning ran away and began again {}",
                                    run.end.restarts == 1 ? "once" : fmt::format("{} times", run.end.restarts)));
    return notes;
}

}  // namespace dqw
