#include "app/read/log_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/columns.hpp"
#include "app/base/text.hpp"
#include "app/read/header.hpp"
#include "app/read/line_source.hpp"
#include "app/read/machine_file.hpp"
#include "app/read/row_parser.hpp"
#include "app/read/speed_unit.hpp"
#include "app/read/time_base.hpp"

namespace dqw {
namespace {

/// Rows from which the unit of the speed is judged; columns that are not kept stay in memory this far.
constexpr std::size_t probe_rows = 1000000;

/// Fewer rows than this hold nothing to fit: two blocks of a dynamic log, one of a mechanical one.
std::size_t fewest_rows(Regime regime)
{
    switch (regime) {
    case Regime::dynamic: return 40;
    case Regime::mechanical: return 20;
    case Regime::steady: return 3;
    case Regime::standstill: return 2;
    }
    return 2;
}

class LogReader {
public:
    LogReader(const std::string& path, const ReadOptions& options)
        : options_(options), path_(path), source_(path), machine_(machine_file_of(path, options.machine_file))
    {
        if (options_.pole_pairs) machine_.machine.pole_pairs = options_.pole_pairs;
    }

    Log read()
    {
        read_header();
        read_rows();
        settle_regime();
        check_size();
        check_period();
        find_segments();
        warn_of_rpm();
        turn_voltages();
        name_unused();
        log_.path = path_;
        log_.machine = machine_.machine;
        for (std::size_t c = 0; c < column_count; ++c)
            if (!keep_[c]) log_.*(columns[c].values) = {};
        return std::move(log_);
    }

private:
    void note(const std::string& text) const
    {
        if (options_.notes) options_.notes->push_back(path_ + ": " + text);
    }

    [[noreturn]] void refuse(const std::string& what) const { throw InputError(path_, source_.line_number(), what); }

    void read_header()
    {
        if (options_.notes) options_.notes->insert(options_.notes->end(), machine_.notes.begin(), machine_.notes.end());
        std::string_view line;
        if (!source_.next(line)) throw InputError(path_, 1, "an empty file; expected a CSV log with a header line");
        header_ = parse_header(path_, line, machine_);
        has_ = header_.has();
        regime_ = machine_.regime ? machine_.regime : regime_of_columns(has_);
        // Without time it is one of the two regimes that need none; the rows tell which.
        require_columns(path_, header_, regime_ ? regime_ : has_[col_t] ? Regime::dynamic : Regime::steady, machine_);
        keep_ = has_;
        if (options_.plain_only) {
            const ColumnSet plain = columns_of_plain_model(regime_.value_or(Regime::dynamic));
            for (std::size_t c = 0; c < column_count; ++c)
                keep_[c] = has_[c] && (plain[c] || (options_.angle && c == col_theta_e));
        }
    }

    void read_rows()
    {
        const std::uint64_t header_bytes = source_.bytes_consumed();
        RowParser parser(path_, header_);
        std::size_t blank_lines = 0, blank_run = 0;
        std::string_view line;
        while (source_.next(line)) {
            if (line.find_first_not_of(" \t") == line.npos) {
                ++blank_run;
                continue;
            }
            blank_lines += blank_run;
            blank_run = 0;
            const RowValues& values = parser.parse(line, source_.line_number());
            if (has_[col_t]) check_time(values[col_t]);
            store_row(values);
            if (rows_ == 1000) reserve(source_.bytes_consumed() - header_bytes);
            if (options_.progress && rows_ % 65536 == 0 && source_.file_bytes())
                options_.progress(static_cast<double>(source_.bytes_consumed()) /
                                  static_cast<double>(source_.file_bytes()));
        }
        if (blank_lines) note(counted(blank_lines, "blank line") + " between rows skipped");
        if (rows_ == 0) throw InputError(path_, 1, "a header and no data; expected at least one row below it");
    }

    void check_time(double t_s)
    {
        if (rows_ > 0 && !(t_s > t_before_s_))
            refuse(fmt::format("t_s is {} after {}; expected time to increase from row to row", t_s, t_before_s_));
        if (!std::isfinite(t_s - t_before_s_)) refuse(fmt::format("t_s jumps from {:g} to {:g}", t_before_s_, t_s));
        t_before_s_ = t_s;
    }

    void store_row(const RowValues& values)
    {
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c] && (keep_[c] || rows_ < probe_rows)) (log_.*(columns[c].values)).push_back(values[c]);
        moves_ = moves_ || (has_[col_w_m] && values[col_w_m] != 0.0);
        if (rows_ + 2 + line_shift_ != source_.line_number()) {
            line_shift_ = source_.line_number() - rows_ - 2;
            line_shifts_.emplace_back(rows_, line_shift_);
        }
        ++rows_;
    }

    /// From the bytes of the first rows; a little more than needed, so that no vector doubles near its end.
    void reserve(std::uint64_t bytes)
    {
        if (source_.file_bytes() == 0) return;
        const double estimate = 1.03 * static_cast<double>(source_.file_bytes()) * static_cast<double>(rows_) /
                                static_cast<double>(bytes);
        const auto rows = static_cast<std::size_t>(estimate) + 1000;
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c]) (log_.*(columns[c].values)).reserve(keep_[c] ? rows : std::min(rows, probe_rows));
    }

    std::size_t line_of_row(std::size_t row) const
    {
        std::size_t shift = 0;
        for (const auto& [from, s] : line_shifts_)
            if (from <= row) shift = s;
        return row + 2 + shift;
    }

    void settle_regime()
    {
        if (has_[col_t]) base_ = time_base_of(log_.t_s);
        log_.modulation = machine_.modulation;
        log_.observed = machine_.observed;
        log_.voltage_error_V = machine_.voltage_error_V;
        if (machine_.regime) {
            log_.regime = *machine_.regime;
            if (machine_.polled) note("a polled log, read as steady: rows in motion mislead");
            return;
        }
        const auto [regime, why] = regime_of_rows();
        log_.regime = regime;
        note(fmt::format("regime taken as {}: {} ([log] regime in the machine file overrides)", name_of(regime), why));
    }

    std::pair<Regime, const char*> regime_of_rows() const
    {
        if (regime_ == Regime::mechanical) return {Regime::mechanical, "no voltages"};
        if (!has_[col_w_m]) {
            if (theta_moves(log_.theta_e_rad) || theta_moves(log_.theta_m_rad))
                throw InputError(path_, 1, "missing column w_m_rad_s; the angle moves, so this is no standstill log");
            return {Regime::standstill, "no w_m_rad_s"};
        }
        if (!moves_) return {Regime::standstill, "w_m_rad_s is 0 throughout"};
        if (!has_[col_t]) return {Regime::steady, "no t_s"};
        if (!base_.regular) return {Regime::steady, "t_s has gaps throughout"};
        if (base_.median_s > 0.02) return {Regime::steady, "more than 20 ms from row to row"};
        return {Regime::dynamic, "an even time base"};
    }

    static bool theta_moves(const std::vector<double>& theta)
    {
        return !theta.empty() &&
               *std::max_element(theta.begin(), theta.end()) - *std::min_element(theta.begin(), theta.end()) > 0.1;
    }

    void check_size() const
    {
        const std::size_t fewest = fewest_rows(log_.regime);
        if (rows_ < fewest)
            refuse(fmt::format("{} only; expected at least {} in a {} log", counted(rows_, "row"), fewest,
                               name_of(log_.regime)));
    }

    bool timed() const { return log_.regime == Regime::dynamic || log_.regime == Regime::mechanical; }

    /// No converter samples that fast: the time is in another unit, or something else.
    void check_period() const
    {
        constexpr double shortest_s = 1e-9;
        if (!has_[col_t] || !timed() || !(base_.median_s < shortest_s)) return;
        throw InputError(path_, line_of_row(0),
                         fmt::format("t_s: {:.3g} s from row to row; expected seconds, 1 ns at least", base_.median_s));
    }

    void find_segments()
    {
        log_.dt_s = base_.median_s;
        if (!has_[col_t] || base_.gaps.empty() || (!timed() && !base_.regular)) return;
        log_.segments.insert(log_.segments.end(), base_.gaps.begin(), base_.gaps.end());
        if (!timed()) return;
        const std::size_t row = base_.gaps.front();
        note(fmt::format("{} in time, the longest {:.4g} s, the first before line {} ({:.4g} s, usual {:.4g} s); a new "
                         "segment begins behind each",
                         counted(base_.gaps.size(), "gap"), base_.longest_gap_s, line_of_row(row),
                         log_.t_s[row] - log_.t_s[row - 1], base_.median_s));
        std::size_t lone = 0;
        for (std::size_t s = 0; s < log_.segments.size(); ++s)
            lone += (s + 1 < log_.segments.size() ? log_.segments[s + 1] : rows_) - log_.segments[s] == 1;
        if (lone)
            note(counted(lone, "row") + " alone between gaps: without a neighbour, of no use to a " +
                 name_of(log_.regime) + " fit");
    }

    void warn_of_rpm() const
    {
        SpeedProbe probe;
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c]) probe.column[c] = (log_.*(columns[c].values)).data();
        probe.rows = std::min(rows_, probe_rows);
        probe.median_dt_s = base_.median_s;
        probe.regime = log_.regime;
        const auto evidence = evidence_of_rpm(probe, machine_.machine);
        if (!evidence || !options_.notes) return;
        options_.notes->push_back(
            fmt::format("warning: {}: w_m_rad_s: the numbers look like rpm, not rad/s: {}; if so, put "
                        "w_m_rad_s = {{ from = {}, scale = 0.104720 }} under [columns] of the machine file",
                        path_, *evidence, shown(header_.fields[header_.field_of[col_w_m]], 200)));
    }

    void turn_voltages()
    {
        const bool interval_matters = log_.regime == Regime::dynamic ||
                                      (log_.regime == Regime::standstill && has_[col_t] && base_.regular);
        if (!machine_.voltage_previous || !interval_matters) return;
        for (std::size_t c = 0; c < column_count; ++c)
            if (!keep_[c]) log_.*(columns[c].values) = {};
        const std::size_t dropped = turn_voltage_interval(log_);
        note(fmt::format("voltage_interval previous: voltages moved up by one row; {} at the ends of segments dropped",
                         counted(dropped, "row")));
    }

    void name_unused() const
    {
        std::vector<std::string> unused = header_.unused;
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c] && !keep_[c]) unused.push_back(columns[c].name);
        if (!unused.empty()) note("columns not used: " + list(unused));
    }

    const ReadOptions& options_;
    std::string path_;
    LineSource source_;
    MachineFile machine_;
    Header header_;
    ColumnSet has_ = {}, keep_ = {};
    std::optional<Regime> regime_;  // before the rows are seen
    double t_before_s_ = 0.0;
    std::size_t rows_ = 0;
    bool moves_ = false;
    std::size_t line_shift_ = 0;  // lines skipped so far
    std::vector<std::pair<std::size_t, std::size_t>> line_shifts_;
    TimeBase base_;
    Log log_;
};

}  // namespace

Log read_log(const std::string& path, const ReadOptions& options) { return LogReader(path, options).read(); }

}  // namespace dqw
