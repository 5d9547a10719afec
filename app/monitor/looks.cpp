#include "app/monitor/looks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string>

#include "app/base/columns.hpp"
#include "app/base/text.hpp"
#include "app/monitor/names.hpp"
#include "dqw_fault.h"
#include "dqw_number.h"
#include "ref/fit/polled_looks.hpp"

namespace dqw {
namespace {

constexpr double kShortest_s = 10.0;  // of a look
constexpr double kMostLooks = 200.0;
constexpr std::size_t kHealthy = 5;                           // looks that a healthy value is the mean of, at least
constexpr double kHealthyPart = 0.1;                          // of all looks
constexpr double kBand[kLooked] = {0.04, 0.06, 0.06, 0.012};  // as dqw_monitor_config's
constexpr double kSure = 5.0;                                 // deviations
constexpr double kSpread = 3.0;
constexpr std::size_t kPatience = 5;  // looks
constexpr double kCoarse = 0.3;       // of the healthy value: no fault is told from so far
constexpr float kSureName = 0.65F;
// Copper; the magnets' flux, as a fall: ferrite loses 0.2 %/K, neodymium 0.12, so that 0.1 is what to expect and twice
// as much no fault. Heat that a healthy drive may gain, and lose, after its healthy values were taken.
constexpr double kAlpha_per_K = 0.0039, kBeta_per_K = 0.001, kSlack = 2.0;
constexpr double kHotter_K = 110.0, kColder_K = 80.0;
// A sensor lags behind its winding, or sits beside it: by so much; one that stands still, or jumps, is none.
constexpr double kLag_K = 60.0, kStill_K = 0.5, kJump_K = 15.0;
// By how much a machine differs from what its maker says, or who measured it before, of R, L_d, L_q, psi; at 20 C.
constexpr double kPlate[kLooked] = {0.1, 0.3, 0.3, 0.1}, kPlate_C = 20.0;
constexpr std::optional<double> Machine::*kNominal[kLooked] = {&Machine::R_ohm, &Machine::Ld_H, &Machine::Lq_H,
                                                               &Machine::psi_Wb};
constexpr double kSaturation = 0.3;  // of L, from no current to the largest
// Times the head's mean square, and of the voltage: the equations no longer hold. Saturation leaves some percent.
constexpr double kUnfit = 9.0, kUnfitPart = 0.05;
constexpr int kChannel[kLooked] = {DQW_WATCH_R, DQW_WATCH_LD, DQW_WATCH_LQ, DQW_WATCH_PSI};
enum { R, Ld, Lq, Psi };

/// How far a healthy parameter may be from its value, by heat or current.
struct Leeway {
    double low = 0.0, high = 0.0;
};

/// Does a temperature column follow anything, without steps that no heat makes?
bool is_believed(const std::vector<double>& column)
{
    if (column.empty()) return false;
    const auto [low, high] = std::minmax_element(column.begin(), column.end());
    double step = 0.0;
    for (std::size_t k = 1; k < column.size(); ++k) step = std::max(step, std::abs(column[k] - column[k - 1]));
    return *high - *low > kStill_K && step < kJump_K;
}

/// NaN without the column.
double mean_of(const std::vector<double>& x, const Log& log, double from_s, double to_s)
{
    if (x.empty()) return NAN;
    const auto row = [&](auto at) { return x.begin() + (at - log.t_s.begin()); };
    const auto from = row(std::lower_bound(log.t_s.begin(), log.t_s.end(), from_s)),
               to = row(std::upper_bound(log.t_s.begin(), log.t_s.end(), to_s));
    return std::accumulate(from, to, 0.0) / static_cast<double>(to - from);
}

class Watcher {
public:
    Watcher(const Log& log, const MonitorWatch& watch) : log_(log), watch_(watch), all_(looks_of(log))
    {
        const auto part = static_cast<std::size_t>(kHealthyPart * static_cast<double>(all_.looks.size()));
        healthy_looks_ = std::max(kHealthy, part);
        if (all_.looks.size() <= healthy_looks_)
            throw std::invalid_argument(
                fmt::format("{}: {} of {} s or more and 30 settled rows; healthy values take {}, and one more is to be "
                            "watched",
                            log.path, counted(all_.looks.size(), "look"), kShortest_s, healthy_looks_));
        for (std::size_t j = 0; j < kLooked; ++j)
            if (all_.head[j] < -2.0 * all_.head_sd[j])
                throw std::invalid_argument(
                    fmt::format("{}: {} is negative, as no machine has it: a sign or a column is probably wrong; fit "
                                "and columns say more",
                                log.path, channel_named(kChannel[j]).parameter));
        winding_ = is_believed(log.temp_winding_C), magnet_ = is_believed(log.temp_magnet_C);
    }

    MonitorRun run()
    {
        run_.rows = log_.rows(), run_.begin_s = log_.t_s.front(), run_.end_s = log_.t_s.back();
        run_.stages.push_back({run_.begin_s, DQW_STAGE_ORDINAL});
        for (std::size_t n = 0; n < all_.looks.size(); ++n) {
            look(n);
            if (watch_.progress) watch_.progress(static_cast<double>(n + 1) / static_cast<double>(all_.looks.size()));
        }
        run_.end.stage.name = run_.stages.back().name;
        run_.averages = true;
        double worth = 0.0;
        for (const PolledLook& l : all_.looks) worth += l.rows;
        run_.notes.push_back(fmt::format(
            "{} log: {} looks of {:.3g} s, the first {} as healthy; its rows are worth {:.0f}, by how settled they are",
            name_of(log_.regime), all_.looks.size(),
            (run_.end_s - run_.begin_s) / static_cast<double>(all_.looks.size()), healthy_looks_, worth));
        if (log_.i_d_A.empty())
            run_.notes.emplace_back(
                "i_d_A is not in the log: a change of psi may be an i_d that came in, and is not named");
        if (!log_.temp_winding_C.empty() && !winding_)
            run_.notes.emplace_back("temp_winding_C stands still or jumps: it is not believed");
        if (all_.holds_dead_time && all_.known[R])
            run_.notes.emplace_back("R holds what dead time adds: a change of it is the winding's or the inverter's");
        return std::move(run_);
    }

private:
    static PolledLooks looks_of(const Log& log)
    {
        const double whole_s = log.t_s.back() - log.t_s.front(), least_s = std::max(kShortest_s, whole_s / kMostLooks);
        return polled_looks(log, least_s, std::max(kHealthyPart * whole_s, static_cast<double>(kHealthy) * least_s));
    }

    double value(std::size_t n, std::size_t j) const { return all_.head[j] + all_.looks[n].change[j]; }

    void look(std::size_t n)
    {
        const PolledLook& now = all_.looks[n];
        const bool watched = n >= taken_from_ + healthy_looks_;
        if (n == taken_from_ + healthy_looks_) {
            if (!run_.served) doubt_drift(n - 1);
            take_healthy(healthy_looks_);
            if (!run_.served) serve(), hold_against_plate();
        }
        MonitorPoint point{now.to_s, watched, {}};
        for (std::size_t j = 0; j < kLooked; ++j)
            if (all_.known[j] && log_tells(n, j))
                point.readings[channel(j)] = {value(n, j), deviation(n, j), watched ? healthy_[j] : NAN};
        if (watched && knows_heat() && looked_at(n, R))
            point.readings[DQW_WATCH_TEMPERATURE] = {rise_K(n), change_sd(n, R) / (kAlpha_per_K * healthy_[R]), NAN};
        run_.points.push_back(point);
        for (std::size_t j = 0; j < kLooked; ++j)
            if (std::isfinite(point.readings[channel(j)].value)) run_.last[channel(j)] = point.readings[channel(j)];
        if (const auto& K = point.readings[DQW_WATCH_TEMPERATURE]; std::isfinite(K.value))
            run_.last[DQW_WATCH_TEMPERATURE] = K;
        if (!watched) return;
        see(n);
        const int worst = out_of_band(n);
        out_for_ = worst >= 0 ? out_for_ + 1 : 0;
        if (out_for_ == 1) since_s_ = now.from_s;
        // Two looks running, some more where the change is still on its way and has no name; then all is taken anew.
        if (out_for_ < 2) return;
        const bool named = worst < static_cast<int>(kLooked) && name(n).name != DQW_FAULT_UNKNOWN;
        if (!named && out_for_ < kPatience) return;
        tell(n, worst);
        taken_from_ = n, out_for_ = 0;
    }

    static std::size_t channel(std::size_t j) { return static_cast<std::size_t>(kChannel[j]); }

    /// A look that lacks what teaches a weight has the whole log's value for it, and no own.
    bool log_tells(std::size_t n, std::size_t j) const
    {
        return all_.looks[n].sd[j] < kCoarse * std::abs(all_.head[j]) / kSure;
    }

    double deviation(std::size_t n, std::size_t j) const
    {
        return std::hypot(all_.looks[n].sd[j], all_.looks[n].lasting[j]);
    }

    void take_healthy(std::size_t looks)
    {
        for (std::size_t j = 0; j < kLooked; ++j) {
            double weights = 0.0, sum = 0.0, squares = 0.0, own = 0.0, lasting = 0.0, count = 0.0;
            for (std::size_t n = taken_from_; n < taken_from_ + looks; ++n) {
                const PolledLook& l = all_.looks[n];
                const double weight = 1.0 / std::max(l.sd[j] * l.sd[j], 1e-300);
                weights += weight, sum += weight * value(n, j), lasting += weight * l.lasting[j];
                own += l.sd[j] * l.sd[j], ++count;
            }
            healthy_[j] = sum / weights;
            for (std::size_t n = taken_from_; n < taken_from_ + looks; ++n)
                squares += std::pow(value(n, j) - healthy_[j], 2);
            spread_[j] = looks > 1 ? std::sqrt(std::max(0.0, (squares - own) / (count - 1.0))) : 0.0;
            healthy_sd_[j] = std::sqrt(1.0 / weights + std::pow(spread_[j], 2) / count);
            healthy_lasting_[j] = lasting / weights;
        }
        const double from_s = all_.looks[taken_from_].from_s, to_s = all_.looks[taken_from_ + looks - 1].to_s;
        winding_C_ = mean_of(log_.temp_winding_C, log_, from_s, to_s);
        magnet_C_ = mean_of(log_.temp_magnet_C, log_, from_s, to_s);
        hottest_K_ = 0.0, healthy_A_ = 0.0, unfit_ = kUnfit;
        for (std::size_t n = taken_from_; n < taken_from_ + looks; ++n) {
            healthy_A_ += all_.looks[n].i_A / static_cast<double>(looks);
            unfit_ = std::max(unfit_, 4.0 * all_.looks[n].worse);
        }
    }

    void serve()
    {
        const double to_s = all_.looks[taken_from_ + healthy_looks_ - 1].to_s;
        run_.served = run_.watched = true, run_.entered_s = run_.watched_from_s = to_s;
        run_.stages.push_back({to_s, DQW_STAGE_IN_SERVICE});
        for (std::size_t j = 0; j < kLooked; ++j)
            if (all_.known[j]) run_.healthy[channel(j)] = {healthy_[j], healthy_sd_[j], healthy_[j]};
    }

    static const char* parameter(std::size_t j) { return channel_named(kChannel[j]).parameter; }

    /// The last of the looks that shall be healthy against the first of them. Their equations are those of the head as
    /// a whole, which what moves has spoilt: a look's own residual is the noise.
    void doubt_drift(std::size_t last)
    {
        take_healthy(1);
        const auto own_sd = [&](std::size_t n, std::size_t j) {
            return all_.looks[n].sd[j] * std::sqrt(std::min(1.0, all_.looks[n].worse));
        };
        if (knows_heat())
            hottest_K_ = std::clamp(rise_K(last) + 2.0 * own_sd(last, R) / (kAlpha_per_K * healthy_[R]), 0.0,
                                    kHotter_K);
        int worst = -1;
        double most = 1.0;
        for (std::size_t j = 0; j < kLooked; ++j) {
            const double sure = kSure * std::hypot(own_sd(taken_from_, j), own_sd(last, j));
            const double ratio = std::abs(excess(last, j)) / std::max(kBand[j] * std::abs(healthy_[j]), sure);
            if (ratio > most) most = ratio, worst = static_cast<int>(j);
        }
        if (worst < 0) return;
        const auto j = static_cast<std::size_t>(worst);
        run_.notes.push_back(fmt::format(
            "warning: {} goes from {} to {} within the first {} looks, more than heat or current explain: what is "
            "taken as healthy may be a fault on its way",
            parameter(j), shown_as(j, healthy_[j]), shown_as(j, value(last, j)), healthy_looks_));
    }

    static std::string shown_as(std::size_t j, double value)
    {
        return fmt::format("{:.4g} {}", value, j == R ? "ohm" : j == Psi ? "Wb" : "H");
    }

    /// (E157)
    void hold_against_plate()
    {
        std::vector<std::string> differences;
        double hottest_K = kHotter_K;
        for (std::size_t j = 0; j < kLooked; ++j) {
            const std::optional<double>& plate = log_.machine.*kNominal[j];
            if (!all_.known[j] || !plate || !(*plate > 0.0)) continue;
            const double off = healthy_[j] / *plate - 1.0,
                         sd = std::hypot(healthy_sd_[j], healthy_lasting_[j]) / *plate;
            double low = 0.0, high = 0.0;
            if (j == R) {
                const double K = winding_ ? winding_C_ - kPlate_C : 0.0;
                low = kAlpha_per_K * (winding_ ? K - kLag_K : -kColder_K);
                high = all_.holds_dead_time ? HUGE_VAL : kAlpha_per_K * (winding_ ? K + kLag_K : kHotter_K);
                if (knows_heat()) hottest_K = std::clamp((off + kPlate[R] + 2.0 * sd) / kAlpha_per_K, 0.0, kHotter_K);
            } else if (j == Psi) {
                low = -kBeta_per_K * hottest_K, high = kBeta_per_K * kColder_K;
            }
            low -= kPlate[j], high += kPlate[j];
            differences.push_back(fmt::format("{} {:+.1f} %", parameter(j), 100.0 * off));
            if (std::abs(off - std::clamp(off, low, high)) <= kSure * sd) continue;
            run_.notes.push_back(fmt::format(
                "warning: {} is {} in the first looks, {:+.1f} % of the machine file's {}, more than heat and a "
                "maker's tolerance explain: what is taken as healthy may be none",
                parameter(j), shown_as(j, healthy_[j]), 100.0 * off, shown_as(j, *plate)));
        }
        run_.notes.push_back(
            differences.empty() ? "what is there in the first looks is taken as healthy, a fault too: R_ohm and psi_Wb "
                                  "under [machine] would be held against it"
                                : "the first looks beside the machine file: " + list(differences));
    }

    double change_sd(std::size_t n, std::size_t j) const
    {
        const PolledLook& l = all_.looks[n];
        return std::hypot(std::hypot(l.sd[j], healthy_sd_[j]), std::hypot(l.lasting[j], healthy_lasting_[j]));
    }

    double band(std::size_t j) const { return std::max(kBand[j] * std::abs(healthy_[j]), kSpread * spread_[j]); }

    /// What heat may make of R and flux, saturation of L: what the column says, give or take; else what a drive may.
    Leeway leeway(std::size_t n, std::size_t j) const
    {
        const PolledLook& l = all_.looks[n];
        const auto gained = [&](const std::vector<double>& column, double from_C) {
            return mean_of(column, log_, l.from_s, l.to_s) - from_C;
        };
        if (j == R) {
            const double per_K = kAlpha_per_K * healthy_[j];
            if (!winding_) return {-per_K * kColder_K, per_K * kHotter_K};
            const double K = gained(log_.temp_winding_C, winding_C_), up = std::max(0.0, K), down = std::max(0.0, -K);
            return {-per_K * std::min(kSlack * down + kLag_K, down + kColder_K),
                    per_K * std::min(kSlack * up + kLag_K, up + kHotter_K)};
        }
        if (j != Psi) {
            const double moved = std::abs(l.i_A - healthy_A_) / std::max({l.i_A, healthy_A_, 1e-12});
            return {-kSaturation * moved * healthy_[j], kSaturation * moved * healthy_[j]};
        }
        const double per_K = kBeta_per_K * healthy_[j];
        if (!magnet_) return {-per_K * (knows_heat() ? hottest_K_ : kHotter_K), per_K * kColder_K};
        const double K = gained(log_.temp_magnet_C, magnet_C_);
        return {-kSlack * per_K * std::max(0.0, K), kSlack * per_K * std::max(0.0, -K)};
    }

    double excess(std::size_t n, std::size_t j) const
    {
        const Leeway h = leeway(n, j);
        const double change = value(n, j) - healthy_[j];
        return change - std::clamp(change, h.low, h.high);
    }

    /// R is the winding's alone.
    bool knows_heat() const { return all_.known[R] && !all_.holds_dead_time; }

    double rise_K(std::size_t n) const { return (value(n, R) - healthy_[R]) / (kAlpha_per_K * healthy_[R]); }

    bool looked_at(std::size_t n, std::size_t j) const { return all_.known[j] && log_tells(n, j); }

    int out_of_band(std::size_t n)
    {
        // The magnets may be as hot as the winding was, as far as that is known.
        if (looked_at(n, R) && knows_heat())
            hottest_K_ = std::clamp(rise_K(n) + 2.0 * change_sd(n, R) / (kAlpha_per_K * healthy_[R]), hottest_K_,
                                    kHotter_K);
        int worst = -1;
        double most = 1.0;
        for (std::size_t j = 0; j < kLooked; ++j) {
            if (!looked_at(n, j)) continue;
            const double ratio = std::abs(excess(n, j)) / std::max(band(j), kSure * change_sd(n, j));
            if (ratio > most) most = ratio, worst = static_cast<int>(j);
        }
        const PolledLook& l = all_.looks[n];
        const bool unfit = l.worse > unfit_ && all_.head_V * std::sqrt(2.0 * l.worse) > kUnfitPart * l.v_V;
        return worst < 0 && unfit ? static_cast<int>(kLooked) : worst;
    }

    /// What would be told now.
    void see(std::size_t n)
    {
        MonitorSights sights;
        for (MonitorSight& s : sights) s = {NAN, NAN, DQW_WHY_NOT_ASKED, "averages do not show it"};
        for (std::size_t j = 0; j < kLooked; ++j) {
            MonitorSight& s = sights[channel(j)];
            s = {NAN, NAN, DQW_WHY_NOT_TAUGHT, nullptr};
            if (!all_.known[j]) s = {NAN, NAN, DQW_WHY_UNSETTLED, why_unknown(j)};
            if (!looked_at(n, j)) continue;
            const Leeway h = leeway(n, j);
            s.least = std::max(band(j), kSure * change_sd(n, j)) + std::max(-h.low, h.high);
            s.band = band(j);
            s.why = s.least > kCoarse * std::abs(healthy_[j]) ? DQW_WHY_COARSE : DQW_WHY_IN_SERVICE;
        }
        sights[DQW_WATCH_RESIDUAL] = {all_.head_V * std::sqrt(unfit_), NAN, DQW_WHY_IN_SERVICE, nullptr};
        MonitorSight& heat = sights[DQW_WATCH_TEMPERATURE];
        if (looked_at(n, R) && knows_heat())
            heat = {kHotter_K, NAN, DQW_WHY_IN_SERVICE, nullptr};
        else
            heat = {NAN, NAN, DQW_WHY_UNSETTLED, "R alone is not known"};
        run_.sights = sights, run_.sights_s = all_.looks[n].to_s;
    }

    const char* why_unknown(std::size_t j) const
    {
        if (all_.follows && (j == R || j == Psi))
            return "the current follows the speed: load that changes apart from the speed would tell";
        return nullptr;
    }

    /// By (E64), of what changed as a whole; what heat or current may make of it is in its deviation.
    dqw_fault_verdict name(std::size_t n) const
    {
        float change[DQW_SIGNS] = {}, unit[DQW_SIGNS];
        std::fill(unit, unit + DQW_SIGNS, DQW_UNKNOWN);
        constexpr int sign[kLooked] = {DQW_SIGN_R, DQW_SIGN_LD, DQW_SIGN_LQ, DQW_SIGN_PSI};
        for (std::size_t j = 0; j < kLooked; ++j) {
            if (!looked_at(n, j)) continue;
            const Leeway h = leeway(n, j);
            const double unsure = std::hypot(std::max(band(j) / kSure, change_sd(n, j)),
                                             0.5 * std::max(-h.low, h.high));
            change[sign[j]] = static_cast<float>((value(n, j) - healthy_[j]) / healthy_[j]);
            unit[sign[j]] = static_cast<float>(unsure / healthy_[j]);
        }
        dqw_fault_verdict verdict = dqw_fault_name_it(
            change, unit, {static_cast<float>(all_.head[R]), static_cast<float>(all_.head[Lq]), 0.0f, false, 0.0f});
        if (verdict.confidence < kSureName || !is_sure(n, verdict.name)) verdict.name = DQW_FAULT_UNKNOWN;
        if (verdict.name == DQW_FAULT_UNKNOWN) verdict = rise_of_R(n);
        return verdict;
    }

    /// Of half a log an i_d that comes in looks like flux that goes; of the speed's scale like the voltage's, but for
    /// R.
    bool is_sure(std::size_t n, dqw_fault_name name) const
    {
        if (log_.i_d_A.empty()) return false;
        if (name != DQW_FAULT_VOLTAGE_SCALE) return true;
        if (!looked_at(n, R) || !looked_at(n, Psi)) return false;
        const double off = (value(n, R) - healthy_[R]) / healthy_[R] - (value(n, Psi) - healthy_[Psi]) / healthy_[Psi];
        return std::abs(off) <
               3.0 * std::hypot(change_sd(n, R) / healthy_[R], change_sd(n, Psi) / healthy_[Psi]) + kBand[R];
    }

    /// R beyond what its sensor says and beyond every heat, all else within: a connection's, or the winding's.
    dqw_fault_verdict rise_of_R(std::size_t n) const
    {
        const dqw_fault_verdict unknown = {DQW_FAULT_UNKNOWN, 0.5F, 0};
        if (!looked_at(n, R) || !knows_heat() || !winding_) return unknown;
        for (std::size_t j = Ld; j < kLooked; ++j)
            if (looked_at(n, j) && std::abs(excess(n, j)) > std::max(band(j), kSure * change_sd(n, j))) return unknown;
        const double beyond = rise_K(n) - kHotter_K, sd_K = change_sd(n, R) / (kAlpha_per_K * healthy_[R]);
        if (!(beyond > kSure * sd_K)) return unknown;
        // The sensor may be the one that is wrong.
        return {DQW_FAULT_RESISTANCE_RISE, 0.8F, 0};
    }

    void tell(std::size_t n, int worst)
    {
        const bool unfit = worst == static_cast<int>(kLooked);
        const auto j = static_cast<std::size_t>(worst);
        MonitorEvent event{all_.looks[n].to_s, since_s_, DQW_WATCH_RESIDUAL, {}, {DQW_FAULT_UNKNOWN, 0.5F, 0}};
        if (unfit)
            event.reading = {all_.head_V * std::sqrt(all_.looks[n].worse), NAN, all_.head_V};
        else
            event = {event.t_s,
                     since_s_,
                     static_cast<dqw_monitor_channel>(kChannel[j]),
                     {value(n, j), change_sd(n, j), healthy_[j]},
                     name(n)};
        run_.events.push_back(event);
        ++run_.event_count;
        if (watch_.event) watch_.event(event);
    }

    const Log& log_;
    const MonitorWatch& watch_;
    const PolledLooks all_;
    MonitorRun run_;
    std::size_t healthy_looks_ = kHealthy, taken_from_ = 0;
    std::array<double, kLooked> healthy_{}, healthy_sd_{}, healthy_lasting_{}, spread_{};
    double winding_C_ = NAN, magnet_C_ = NAN, hottest_K_ = 0.0, since_s_ = 0.0;
    bool winding_ = false, magnet_ = false;
    double healthy_A_ = 0.0, unfit_ = kUnfit;
    std::size_t out_for_ = 0;
};

}  // namespace

MonitorRun watch_looks(const Log& log, const MonitorWatch& watch) { return Watcher(log, watch).run(); }

}  // namespace dqw
