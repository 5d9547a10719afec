#include "app/read/log_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/base/columns.hpp"
#include "app/base/text.hpp"
#include "app/read/csv.hpp"
#include "app/read/join.hpp"
#include "app/read/log_stream.hpp"
#include "app/read/machine_file.hpp"
#include "app/read/mapping.hpp"
#include "app/read/opening.hpp"
#include "app/read/row_parser.hpp"
#include "app/read/slow_channel.hpp"
#include "app/read/speed_of_angle.hpp"
#include "app/read/spikes.hpp"
#include "app/read/stamps.hpp"
#include "app/read/time_base.hpp"
#include "app/read/unit_warnings.hpp"

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
    case Regime::polled: return 8;
    }
    return 2;
}

Given given_of(const ReadOptions& options, const MachineFile& machine)
{
    const auto first = [](const std::optional<double>& a, const std::optional<double>& b) { return a ? a : b; };
    return {first(options.pole_pairs, machine.machine.pole_pairs), first(options.given.gear, machine.gear),
            first(options.given.v_dc_V, machine.v_dc_V), first(options.given.period_s, machine.period_s)};
}

MachineFile machine_of(const std::string& path, const ReadOptions& options)
{
    if (!options.machine_text.empty()) return read_machine_text("machine", options.machine_text);
    if (options.table && options.machine_file.empty()) return {};
    return machine_file_of(path, options.machine_file);
}

class LogReader {
public:
    LogReader(const std::string& path, const ReadOptions& options)
        : options_(options), path_(path), opening_(options.table ? Opening(path, *options.table) : Opening(path)),
          machine_(machine_of(path, options)), given_(given_of(options, machine_)), import_(opening_.head, given_),
          format_(format_for(opening_.head, opening_.json, options.format, machine_))
    {
        machine_.machine.pole_pairs = given_.pole_pairs;
    }

    Log read()
    {
        read_header();
        read_rows();
        return made_of_rows();
    }

    const Machine& machine() const { return machine_.machine; }
    const std::string& modulation() const { return machine_.modulation; }
    const std::vector<LeftOut>& left_out() const { return left_out_; }
    std::function<void(const std::string&)> said;  ///< gets what happens while rows come

    /// The log that the first `window_s` make, `fewest` rows at least; then() gives these rows again, and all others.
    Log begin(double window_s, std::size_t fewest)
    {
        window_s_ = window_s, fewest_ = fewest;
        read_header();
        read_rows();
        Log first = made_of_rows();
        log_ = std::move(raw_);
        for (std::size_t c = 0; c < column_count; ++c)
            if (!has_[c]) values(c) = {};
        tail_ = true;
        return first;
    }

    /// The rows that are there, one at least; false at the end.
    bool then(Log& out)
    {
        const std::size_t ahead = (import_.speed_from_angle ? slope_rows : 0) + (previous() ? 1 : 0);
        for (;;) {
            const std::size_t all = values(col_t).size();
            const std::size_t good = std::min(ended_ ? all : all - std::min(ahead, all), given_rows_ + most_at_once);
            if (given_rows_ < good && give(good, out)) return true;
            if (ended_ && given_rows_ >= all) return false;
            if (!ended_ && given_rows_ >= good) ended_ = !take_lines();
        }
    }

private:
    /// Rows on either side that the slope of an angle is made of.
    static constexpr std::size_t slope_rows = 10;
    static constexpr std::size_t most_at_once = 4096;

    bool previous() const { return machine_.voltage_previous || import_.voltage_previous; }

    /// Those that are there, one at least; false at the end.
    bool take_lines()
    {
        std::string_view line;
        const std::size_t before = rows_;
        for (std::size_t n = 0; n == 0 || (n < most_at_once && opening_.ready()); ++n) {
            if (!opening_.next(line)) return rows_ != before;
            if (line.find_first_not_of(" \t") == line.npos) continue;
            try {
                take_row(*parser_, parser_->parse(line, opening_.line_number()));
            } catch (const InputError& error) {
                leave_out(error);
            }
        }
        return true;
    }

    /// One bad row of a pipe is no end: the motor goes on.
    void leave_out(const InputError& error)
    {
        if (broken_rows_++ == 0 && said) said(std::string(error.what()) + "; left out, as are all others");
        count_left_out(left_out_, "it cannot be read", opening_.line_number());
    }

    /// Does a gap stand before row k of those that wait?
    bool gap_at(std::size_t k) const
    {
        if (std::find(log_.segments.begin(), log_.segments.end(), k) != log_.segments.end()) return true;
        return k > 0 && log_.t_s[k] - log_.t_s[k - 1] > base_.gap_s;
    }

    /// Rows up to `good` into `out`; false where none of them can be used.
    bool give(std::size_t good, Log& out)
    {
        make_speed();
        for (const ColumnInfo& column : columns) (out.*(column.values)).clear();
        out.segments.clear();
        out.dt_s = log_.dt_s;
        std::size_t given = 0;
        for (std::size_t k = given_rows_; k < good; ++k) {
            gap_ = gap_ || gap_at(k);
            if (previous() && (k + 1 == values(col_t).size() || gap_at(k + 1))) continue;
            if (gap_) out.segments.push_back(given);
            gap_ = false;
            for (std::size_t c = 0; c < column_count; ++c)
                if (has_[c]) {
                    const bool later = previous() && (c == col_v_d || c == col_v_q);
                    (out.*(columns[c].values)).push_back(values(c)[later ? k + 1 : k]);
                }
            ++given;
        }
        given_rows_ = good;
        forget(good - std::min(good, slope_rows));
        return given > 0;
    }

    /// The first `rows` of those that wait: nothing needs them any more.
    void forget(std::size_t rows)
    {
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c]) values(c).erase(values(c).begin(), values(c).begin() + static_cast<std::ptrdiff_t>(rows));
        given_rows_ -= rows;
        std::vector<std::size_t> left;
        for (const std::size_t s : log_.segments)
            if (s >= rows) left.push_back(s - rows);
        log_.segments = left;
    }

    Log made_of_rows()
    {
        make_speed();
        drop_motion();
        settle_slow_channels();
        if (window_s_ < HUGE_VAL) put_joins(), raw_ = log_;
        settle_regime();
        check_steps();
        refuse_motion_at_standstill();
        drop_spikes();
        check_size();
        check_period();
        find_segments();
        warn_of_units();
        turn_voltages();
        tell_what_was_left_out();
        log_.path = path_;
        log_.machine = machine_.machine;
        fill_survey();
        for (std::size_t c = 0; c < column_count; ++c)
            if (!keep_[c]) log_.*(columns[c].values) = {};
        raw_.dt_s = log_.dt_s;
        return std::move(log_);
    }

    std::vector<double>& values(std::size_t c) { return log_.*(columns[c].values); }

    void note(const std::string& text) const
    {
        if (options_.notes) options_.notes->push_back(path_ + ": " + text);
    }

    [[noreturn]] void refuse(const std::string& what) const { throw InputError(path_, opening_.line_number(), what); }

    /// A file's line; a table's row, from 0.
    std::string place(std::size_t line) const
    {
        return opening_.is_table() ? fmt::format("row {}", line < 2 ? 0 : line - 2) : fmt::format("line {}", line);
    }

    bool own_format() const { return &format_ == &plain; }

    void read_header()
    {
        if (options_.notes) options_.notes->insert(options_.notes->end(), machine_.notes.begin(), machine_.notes.end());
        import_.even = options_.given.period_s.has_value();
        map_columns(import_, format_, machine_);
        has_ = import_.has();
        for (std::size_t c = 0; c < column_count; ++c) in_file_[c] = import_.columns[c].has_value();
        if (!own_format() && !options_.survey) note(fmt::format("read as {} ({})", format_.name, format_.about));
        for (const std::string& text : import_.notes) note(text);
        note_idle_options();
        if (!opening_.head.units.empty() && own_format()) note("a line of units below the header");
        regime_ = hinted_regime();
        if (!options_.survey) require_columns();
        keep_ = has_;
        if (options_.plain_only) {
            const ColumnSet plain_columns = columns_of_plain_model(regime_.value_or(Regime::dynamic));
            for (std::size_t c = 0; c < column_count; ++c)
                keep_[c] = has_[c] && (plain_columns[c] || (options_.angle && c == col_theta_e));
        }
        whole_ = keep_;
        whole_[col_theta_e] = whole_[col_theta_e] || import_.speed_from_angle;
    }

    void note_idle_options() const
    {
        const auto& link = import_.columns[col_v_dc];
        const bool geared = std::any_of(import_.columns.begin(), import_.columns.end(), [](const auto& source) {
            return source && source->unit.find(" output") != std::string::npos;
        });
        if (options_.given.period_s && !import_.row_period_s)
            note("--period changes nothing: this format has a time of its own");
        if (options_.given.gear && !geared) note("--gear changes nothing: no column is of an output shaft");
        if (options_.given.v_dc_V && link && !link->expression.fields.empty())
            note("--v-dc changes nothing: the log has the link's voltage");
    }

    bool complete(Regime regime, const ColumnSet& columns_there) const
    {
        return missing_columns(regime, columns_there, machine_.machine.torque_constant_Nm_A.has_value()).empty();
    }

    /// What the machine file says, or the format where its columns are in the file; else what those columns tell.
    std::optional<Regime> hinted_regime() const
    {
        if (machine_.regime) return machine_.regime;
        if (import_.polled && complete(Regime::polled, in_file_)) return Regime::polled;
        if (import_.regime && (complete(*import_.regime, in_file_) || *import_.regime == Regime::mechanical))
            return import_.regime;
        return regime_of_columns(in_file_);
    }

    std::vector<std::string> missing() const
    {
        // Without time it is one of the two regimes that need none; the rows tell which.
        const Regime assumed = regime_.value_or(has_[col_t] ? Regime::dynamic : Regime::steady);
        auto names = missing_columns(assumed, has_, machine_.machine.torque_constant_Nm_A.has_value());
        for (std::string& name : names) {
            const auto column = column_named(name);
            if (!column) continue;
            if (import_.columns[*column] && !import_.columns[*column]->needs.empty()) {
                std::vector<std::string> how;
                for (const std::string& need : import_.columns[*column]->needs) how.push_back(how_to_give(need));
                name += fmt::format(" (made of {}, which needs {})", import_.columns[*column]->expression.text,
                                    list(how));
            }
        }
        return names;
    }

    /// Throws the InputError that says which columns are missing and which are there.
    void require_columns() const
    {
        if (!import_.no_log.empty()) throw InputError(path_, opening_.head.line, import_.no_log);
        const auto names = missing();
        if (names.empty()) return;
        const Regime assumed = regime_.value_or(has_[col_t] ? Regime::dynamic : Regime::steady);
        std::string what = fmt::format("missing column{} {}; a {} log needs {}, the file has {}",
                                       names.size() == 1 ? "" : "s", list(names), name_of(assumed),
                                       names.size() == 1 ? "it" : "them", list(shown_all(opening_.head.fields)));
        if (!own_format())
            what += fmt::format("; read as {}, dqwatch columns says more", format_.name);
        else if (!proposed_columns(opening_.head, in_file_).empty())
            what += "; dqwatch columns proposes which they are";
        throw InputError(path_, opening_.head.line, what);
    }

    void read_rows()
    {
        const std::uint64_t header_bytes = opening_.taken();
        parser_.emplace(path_, import_);
        RowParser& parser = *parser_;
        if (opening_.is_table()) return read_table(parser);
        std::size_t blank_lines = 0, blank_run = 0;
        std::string_view line;
        while (!enough() && opening_.next(line)) {
            if (line.find_first_not_of(" \t") == line.npos) {
                ++blank_run;
                continue;
            }
            blank_lines += blank_run;
            blank_run = 0;
            const RowValues* row = nullptr;
            try {
                row = parser.parse(line, opening_.line_number());
            } catch (const InputError&) {
                if (!is_cut(line)) throw;
                break;
            }
            take_row(parser, row);
            if (rows_ == 1000) reserve(opening_.taken() - header_bytes);
            tell_progress();
        }
        if (blank_lines) note(counted(blank_lines, "blank line") + " between rows skipped");
        check_rows();
    }

    /// A controller that lost power: the last row lacks cells, or its end. It is left out.
    bool is_cut(std::string_view line)
    {
        const std::size_t number = opening_.line_number();
        const bool may_be = opening_.was_unended() ||
                            split(line, import_.head.separator).size() < import_.head.fields.size();
        // A pipe may have more to come, for which nobody waits; behind a line without an end nothing comes.
        if (window_s_ < HUGE_VAL && !opening_.was_unended()) return false;
        if (!may_be || !opening_.was_last()) return false;
        ++rows_in_file_;
        count_left_out(left_out_, "the log ends within it", number);
        return true;
    }

    void read_table(RowParser& parser)
    {
        for (std::size_t f = 0; f < opening_.head.fields.size(); ++f)
            if (const std::string type = options_.table->no_numbers(f); parser.uses(f) && !type.empty())
                throw InputError(path_, opening_.head.line,
                                 fmt::format("column {} is of type {}; expected real numbers, such as float64",
                                             shown(opening_.head.fields[f]), type));
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c])
                values(c).reserve(whole_[c] ? options_.table->rows() : std::min(options_.table->rows(), probe_rows));
        while (const double* row = opening_.next()) {
            take_row(parser, parser.parse(row, opening_.line_number()));
            tell_progress();
        }
        check_rows();
    }

    void tell_progress() const
    {
        if (!options_.progress || rows_in_file_ % 65536 != 0) return;
        const auto all = static_cast<double>(opening_.in_all());
        options_.progress(all > 0.0 ? std::min(static_cast<double>(opening_.taken()) / all, 1.0) : 0.0);
    }

    void check_rows() const
    {
        if (rows_in_file_ == 0)
            throw InputError(path_, opening_.head.line, "a header and no data; expected at least one row below it");
        if (rows_ == 0)
            throw InputError(
                path_, left_out_.front().first_line,
                fmt::format("no row is left: {} ({})", left_out_.front().why, counted(left_out_.front().rows, "row")));
        if (stamps_.backward() * 10 > rows_in_file_)
            throw InputError(path_, stamps_.first_backward_line(),
                             fmt::format("{} of {} are not after the row before; expected time to increase from row to "
                                         "row{}",
                                         stamps_.backward(), counted(rows_in_file_, "stamp"),
                                         2 * stamps_.equal() > stamps_.backward() ? how_to_be_even() : ""));
    }

    std::string how_to_be_even() const
    {
        if (!own_format()) return "";
        return fmt::format("; {} takes rows that are even as S apart",
                           opening_.is_table() ? "period_s=S" : "--period S");
    }

    /// Stamps that are too coarse for their rows: what is left of these has another step.
    void check_steps() const
    {
        constexpr std::size_t one_in = 100;
        if (!own_format() || !timed() || stamps_.equal() * one_in <= rows_in_file_) return;
        throw InputError(path_, stamps_.first_equal_line(),
                         fmt::format("{} of {} are the row before's; expected time to increase from row to row{}",
                                     stamps_.equal(), counted(rows_in_file_, "stamp"), how_to_be_even()));
    }

    /// Of a pipe the window that makes the log.
    bool enough() const
    {
        return window_s_ < HUGE_VAL && rows_ >= fewest_ && has_[col_t] && !log_.t_s.empty() &&
               stamps_.last_s() - log_.t_s.front() >= window_s_;
    }

    /// A controller that starts anew, or a clock that is set: the rows go on, behind a gap of a length that nobody
    /// knows.
    void set_clock(double t_s)
    {
        constexpr double set_s = 1.0;
        if (!tail_ || !(stamps_.back_s(t_s) > set_s)) return;
        if (clocks_set_++ == 0 && said)
            said(fmt::format("{}:{}: the clock went back by {:.4g} s; the rows go on behind a gap", path_,
                             opening_.line_number(), stamps_.back_s(t_s)));
        stamps_.set(t_s, log_.dt_s);
        begin_anew();
    }

    void take_row(const RowParser& parser, const RowValues* parsed)
    {
        const std::size_t number = rows_in_file_++;
        if (!parsed && last_count_) last_count_ = *last_count_ + 1.0;
        if (!parsed) return count_left_out(left_out_, parser.left_out(), opening_.line_number());
        RowValues row = *parsed;
        if (import_.row_period_s)
            row[col_t] = *import_.row_period_s * (static_cast<double>(number) + lost_before(parser));
        if (rows_ == 0 && is_idle(row))
            return count_left_out(left_out_, "zeros before the first values", opening_.line_number());
        if (has_[col_t]) set_clock(row[col_t]);
        if (has_[col_t] && !stamps_.take(row[col_t], opening_.line_number())) {
            const bool back = stamps_.back_s(row[col_t]) > 0.0;
            if (back && own_format() && !import_.gaps && !tail_)
                refuse(fmt::format("t_s is {} after {}; expected time to increase from row to row", row[col_t],
                                   stamps_.last_s()));
            went_back_ = went_back_ || back;
            return count_left_out(left_out_, "its stamp is not after the row before", opening_.line_number());
        }
        if (has_[col_t] && !stamps_.finite())
            refuse(fmt::format("t_s jumps from {:g} to {:g}", stamps_.before_s(), row[col_t]));
        store_row(row);
    }

    /// What follows stamps that went back may be another recording.
    void begin_anew()
    {
        went_back_ = false;
        if (!tail_) return joins_s_.push_back(stamps_.last_s());
        const std::size_t next = values(col_t).size();
        if (log_.segments.empty() || log_.segments.back() != next) log_.segments.push_back(next);
    }

    /// Rows that its counter of 8 bits says are not in the file.
    double lost_before(const RowParser& parser)
    {
        constexpr double counts = 256.0;
        if (!import_.counter || !std::isfinite(parser.counter())) return lost_rows_;
        double step = std::fmod(parser.counter() - last_count_.value_or(parser.counter() - 1.0), counts);
        if (step < 0.0) step += counts;
        lost_rows_ += step - 1.0;
        last_count_ = parser.counter();
        return lost_rows_;
    }

    /// A link of 0 V, or currents and voltages of exactly 0 where the rows come from a host: nobody has answered yet.
    bool is_idle(const RowValues& row) const
    {
        if (has_[col_v_dc] && row[col_v_dc] == 0.0) return true;
        bool any = false;
        for (const Column c : {col_v_d, col_v_q, col_i_d, col_i_q, col_w_m}) {
            if (!has_[c] || (c == col_w_m && import_.speed_from_angle)) continue;
            any = true;
            if (row[c] != 0.0) return false;
        }
        return any && import_.host_clock;
    }

    void store_row(const RowValues& row)
    {
        if (went_back_) begin_anew();
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c] && (whole_[c] || rows_ < probe_rows))
                values(c).push_back(c == col_t ? stamps_.last_s() : row[c]);
        moves_ = moves_ || (has_[col_w_m] && row[col_w_m] != 0.0);
        if (!tail_ && rows_ + 2 + line_shift_ != opening_.line_number()) {
            line_shift_ = opening_.line_number() - rows_ - 2;
            line_shifts_.emplace_back(rows_, line_shift_);
        }
        ++rows_;
    }

    /// From the bytes of the first rows; a little more than needed, so that no vector doubles near its end.
    void reserve(std::uint64_t bytes)
    {
        if (opening_.in_all() == 0 || bytes == 0) return;
        const double estimate = 1.03 * static_cast<double>(opening_.in_all()) * static_cast<double>(rows_) /
                                static_cast<double>(bytes);
        const auto rows = static_cast<std::size_t>(estimate) + 1000;
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c]) values(c).reserve(whole_[c] ? rows : std::min(rows, probe_rows));
    }

    std::size_t line_of_row(std::size_t row) const
    {
        std::size_t shift = 0;
        for (const auto& [from, s] : line_shifts_)
            if (from <= row) shift = s;
        return row + 2 + shift;
    }

    void make_speed()
    {
        if (!import_.speed_from_angle || !given_.pole_pairs) return;
        log_.w_m_rad_s = slope_of_angle(log_.t_s, log_.theta_e_rad);
        for (double& w : log_.w_m_rad_s) w /= *given_.pole_pairs;
        moves_ = std::any_of(log_.w_m_rad_s.begin(), log_.w_m_rad_s.end(), [](double w) { return w != 0.0; });
    }

    void drop_motion()
    {
        if (!import_.settled_only || !has_[col_w_m]) return;
        const std::size_t dropped = keep_settled(log_);
        if (dropped == 0) return;
        left_out_.push_back({"in motion: its channels are not of one instant", dropped, opening_.head.line + 1});
        rows_ -= dropped;
        if (rows_ == 0) refuse("no settled row: speed or voltage differ from row to row throughout");
    }

    void settle_slow_channels()
    {
        for (const Column c : {col_v_dc, col_temp_winding, col_temp_magnet}) {
            if (!has_[c]) continue;
            const std::string trouble = settle_slow_channel(c, values(c), !own_format());
            if (trouble.empty()) continue;
            note(fmt::format("{} left out: {}", columns[c].name, trouble));
            values(c) = {};
            has_[c] = keep_[c] = false;
        }
    }

    void settle_regime()
    {
        clock_ = import_.host_clock ? Clock::host : regime_ == Regime::mechanical ? Clock::unknown : Clock::own;
        if (has_[col_t]) base_ = time_base_of(log_.t_s, clock_);
        log_.modulation = machine_.modulation;
        log_.v_q_is_size = import_.voltage_is_size && !has_[col_v_d];
        log_.observed = machine_.observed;
        log_.voltage_error_V = machine_.voltage_error_V;
        log_.voltage_scale = machine_.voltage_scale;
        const bool of_format = !machine_.regime && regime_ && !own_format();
        if (machine_.regime || of_format) {
            log_.regime = *regime_;
            if (of_format) regime_why_ = "what the format's rows are good for";
            return;
        }
        const auto [regime, why] = regime_of_rows();
        log_.regime = regime;
        regime_why_ = why;
        if (options_.survey && !complete(regime, has_)) return;
        note(fmt::format("regime taken as {}: {} ([log] regime in the machine file overrides)", name_of(regime), why));
    }

    std::pair<Regime, const char*> regime_of_rows() const
    {
        if (regime_ == Regime::mechanical) return {Regime::mechanical, "no voltages"};
        if (regime_ == Regime::polled) return {Regime::polled, "without v_d_V or i_d_A only means tell something"};
        if (!in_file_[col_w_m]) {
            if (!options_.survey && (theta_moves(log_.theta_e_rad) || theta_moves(log_.theta_m_rad)))
                throw InputError(path_, opening_.head.line,
                                 "missing column w_m_rad_s; the angle moves, so this is no standstill log");
            return {Regime::standstill, "no w_m_rad_s"};
        }
        if (has_[col_w_m] && !moves_) return {Regime::standstill, "w_m_rad_s is 0 throughout"};
        if (!has_[col_t]) return {Regime::steady, "no t_s"};
        if (!base_.regular) return {Regime::steady, "t_s has gaps throughout"};
        if (base_.median_s > 0.02) return {Regime::steady, "more than 20 ms from row to row"};
        return {Regime::dynamic, "an even time base"};
    }

    /// A log that says it stands still, and turns by a radian.
    void refuse_motion_at_standstill() const
    {
        if (log_.regime != Regime::standstill || !has_[col_w_m] || !has_[col_t]) return;
        const double poles = given_.pole_pairs.value_or(1.0);
        // Of a second each: a sensor's offset and noise turn nothing, and rows far apart tell no angle.
        constexpr double kLongest_s = 0.02, kSecond_s = 1.0;
        double turned_rad = 0.0, from_s = 0.0;
        for (std::size_t k = 1; k < std::min(log_.t_s.size(), log_.w_m_rad_s.size()); ++k) {
            const double dt_s = log_.t_s[k] - log_.t_s[k - 1];
            if (dt_s > kLongest_s || log_.t_s[k] - from_s > kSecond_s) turned_rad = 0.0, from_s = log_.t_s[k];
            if (dt_s > kLongest_s) continue;
            turned_rad += poles * log_.w_m_rad_s[k] * dt_s;
            if (std::abs(turned_rad) > 1.0)
                throw InputError(path_, line_of_row(k),
                                 "a standstill log, and by now w_m_rad_s has turned it by an electrical radian; drop "
                                 "[log] regime of the machine file, or the column");
        }
    }

    /// A row or two far beyond all others are a channel's, not a motor's: one of 40 000 spoils every fit.
    void drop_spikes()
    {
        // What watches rows from a pipe has a gate of its own.
        if (log_.regime != Regime::dynamic || window_s_ < HUGE_VAL) return;
        std::vector<std::size_t> rows;
        for (const Column c : {col_i_d, col_i_q, col_w_m})
            for (const std::size_t k : spikes_of(values(c), {&log_.v_d_V, &log_.v_q_V})) rows.push_back(k);
        std::sort(rows.begin(), rows.end());
        rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
        for (const std::size_t k : rows)
            count_left_out(left_out_, "ten times beyond all but a thousandth of the rows", line_of_row(k));
        if (rows.empty()) return;
        for (std::size_t c = 0; c < column_count; ++c) {
            std::vector<double>& x = values(c);
            std::size_t kept = 0, next = 0;
            for (std::size_t k = 0; k < x.size(); ++k)
                if (next < rows.size() && rows[next] == k)
                    ++next;
                else
                    x[kept++] = x[k];
            x.resize(kept);
        }
        shift_lines(rows);
        rows_ -= rows.size();
        if (has_[col_t]) base_ = time_base_of(log_.t_s, clock_);
    }

    /// The lines that rows stand in once `gone` are no rows any more.
    void shift_lines(const std::vector<std::size_t>& gone)
    {
        std::vector<std::pair<std::size_t, std::size_t>> shifts;
        std::size_t before = 0, shift = 0;
        const auto put = [&](std::size_t row) { shifts.emplace_back(row - before, shift + before); };
        for (const auto& [from, s] : line_shifts_) {
            for (; before < gone.size() && gone[before] < from; ++before, put(gone[before - 1] + 1)) {}
            shift = s;
            put(from);
        }
        while (before < gone.size()) ++before, put(gone[before - 1] + 1);
        line_shifts_ = std::move(shifts);
    }

    static bool theta_moves(const std::vector<double>& theta)
    {
        return !theta.empty() &&
               *std::max_element(theta.begin(), theta.end()) - *std::min_element(theta.begin(), theta.end()) > 0.1;
    }

    void check_size() const
    {
        const std::size_t fewest = fewest_rows(log_.regime);
        if (rows_ < fewest && !options_.survey)
            refuse(fmt::format("{} only; expected at least {} in a {} log", counted(rows_, "row"), fewest,
                               name_of(log_.regime)));
    }

    bool timed() const { return log_.regime == Regime::dynamic || log_.regime == Regime::mechanical; }

    /// No converter samples that fast: the time is in another unit, or something else.
    void check_period() const
    {
        constexpr double shortest_s = 1e-9;
        if (!has_[col_t] || !timed() || rows_ < 2 || !(base_.median_s < shortest_s)) return;
        throw InputError(path_, line_of_row(0),
                         fmt::format("t_s: {:.3g} s from row to row; expected seconds, 1 ns at least", base_.median_s));
    }

    void put_joins()
    {
        for (const double t_s : joins_s_) {
            const auto row = std::lower_bound(log_.t_s.begin(), log_.t_s.end(), t_s) - log_.t_s.begin();
            if (row > 0) log_.segments.push_back(static_cast<std::size_t>(row));
        }
        joins_s_.clear();
    }

    void find_segments()
    {
        log_.dt_s = base_.median_s;
        if (!has_[col_t] || (!timed() && !base_.regular)) return;
        put_joins();
        if (base_.gaps.empty()) return;
        log_.segments.insert(log_.segments.end(), base_.gaps.begin(), base_.gaps.end());
        std::sort(log_.segments.begin(), log_.segments.end());
        log_.segments.erase(std::unique(log_.segments.begin(), log_.segments.end()), log_.segments.end());
        if (!timed()) return;
        const std::size_t row = base_.gaps.front();
        note(fmt::format("{} in time, the longest {:.4g} s, the first before {} ({:.4g} s, usual {:.4g} s); a new "
                         "segment begins behind each",
                         counted(base_.gaps.size(), "gap"), base_.longest_gap_s, place(line_of_row(row)),
                         log_.t_s[row] - log_.t_s[row - 1], base_.median_s));
        std::size_t lone = 0;
        for (std::size_t s = 0; s < log_.segments.size(); ++s)
            lone += (s + 1 < log_.segments.size() ? log_.segments[s + 1] : rows_) - log_.segments[s] == 1;
        if (lone)
            note(counted(lone, "row") + " alone between gaps: without a neighbour, of no use to a " +
                 name_of(log_.regime) + " fit");
    }

    void warn_of_units()
    {
        if (!options_.notes || !has_[col_w_m] || !complete(log_.regime, has_)) return;
        SpeedProbe probe;
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c]) probe.column[c] = (log_.*(columns[c].values)).data();
        probe.rows = std::min(rows_, probe_rows);
        probe.median_dt_s = base_.median_s;
        probe.regime = log_.regime;
        probe.v_q_is_size = log_.v_q_is_size;
        const std::vector<std::string> warnings = unit_warnings(probe, import_, machine_);
        options_.notes->insert(options_.notes->end(), warnings.begin(), warnings.end());
        const std::string head = fmt::format("warning: {}: ", import_.head.path);
        if (!warnings.empty()) log_.doubt = warnings.front().substr(head.size());
    }

    void turn_voltages()
    {
        const bool interval_matters = log_.regime == Regime::dynamic ||
                                      (log_.regime == Regime::standstill && has_[col_t] && base_.regular);
        if (!(machine_.voltage_previous || import_.voltage_previous) || !interval_matters) return;
        for (std::size_t c = 0; c < column_count; ++c)
            if (!keep_[c]) values(c) = {};
        const std::size_t dropped = turn_voltage_interval(log_);
        log_.previous = true;
        note(fmt::format("voltage_interval previous: voltages moved up by one row; {} at the ends of segments dropped",
                         counted(dropped, "row")));
    }

    void tell_what_was_left_out()
    {
        unused_ = unused_fields(import_);
        if (stamps_.midnights()) note(counted(stamps_.midnights(), "midnight") + " passed: the clock goes on");
        if (options_.survey) return;
        for (const LeftOut& reason : left_out_)
            note(fmt::format("{} left out, the first at {}: {}", counted(reason.rows, "row"), place(reason.first_line),
                             reason.why));
        std::vector<std::string> unused;
        if (own_format()) unused = unused_;
        for (std::size_t c = 0; c < column_count; ++c)
            if (has_[c] && !keep_[c]) unused.push_back(columns[c].name);
        if (!unused.empty()) note("columns not used: " + list(unused));
    }

    void fill_survey()
    {
        if (!options_.survey) return;
        Survey& s = *options_.survey;
        s.format = format_.name, s.about = format_.about, s.voltage = import_.voltage;
        s.rows_in_file = rows_in_file_, s.rows_kept = log_.rows() ? log_.rows() : rows_;
        s.left_out = left_out_, s.unused = unused_;
        s.columns = surveyed_columns(import_, log_, has_);
        for (const std::string& need : import_.missing_given) s.missing.push_back(how_to_give(need));
        for (const std::string& name : missing()) s.missing.push_back(name);
        if (own_format() && !s.missing.empty()) s.proposed = proposed_columns(opening_.head, in_file_);
        const bool enough = rows_ >= fewest_rows(log_.regime);
        if (complete(log_.regime, has_) && enough)
            s.regime = name_of(log_.regime), s.regime_why = regime_why_;
        else
            s.regime_why = enough ? "columns are missing"
                                  : fmt::format("{} only; at least {} are needed", counted(rows_, "row"),
                                                fewest_rows(log_.regime));
    }

    const ReadOptions& options_;
    std::string path_;
    Opening opening_;
    MachineFile machine_;
    Given given_;
    Import import_;
    const Format& format_;
    ColumnSet in_file_ = {}, has_ = {}, keep_ = {}, whole_ = {};  // named, known, kept, and read to the end
    std::optional<Regime> regime_;                                // before the rows are seen
    Stamps stamps_;
    std::vector<LeftOut> left_out_;
    std::vector<std::string> unused_;
    std::string regime_why_ = "as the machine file says";
    std::size_t rows_ = 0, rows_in_file_ = 0;
    std::optional<double> last_count_;
    double lost_rows_ = 0.0;
    std::vector<double> joins_s_;  // stamps of rows that follow some that went back
    bool went_back_ = false;
    bool moves_ = false;
    std::size_t line_shift_ = 0;  // lines skipped so far
    std::vector<std::pair<std::size_t, std::size_t>> line_shifts_;
    TimeBase base_;
    Clock clock_ = Clock::own;
    Log log_;
    std::optional<RowParser> parser_;
    // Of a pipe: the rows of its window, those that wait in log_, what was counted of all others.
    Log raw_;
    double window_s_ = HUGE_VAL;
    std::size_t fewest_ = 0, given_rows_ = 0, broken_rows_ = 0, clocks_set_ = 0;
    bool tail_ = false, ended_ = false, gap_ = false;
};

}  // namespace

std::string format_of_file(const std::string& path)
{
    const Opening opening(path);
    return format_for(opening.head, opening.json, "", {}).name;
}

class LogStream::Impl : public LogReader {
public:
    using LogReader::LogReader;
};

LogStream::LogStream(const std::string& path, const ReadOptions& options)
    : options_(options), impl_(std::make_unique<Impl>(path, options_))
{
}
LogStream::~LogStream() = default;
const Machine& LogStream::machine() const { return impl_->machine(); }
const std::string& LogStream::modulation() const { return impl_->modulation(); }
Log LogStream::begin(double window_s, std::size_t fewest_rows) { return impl_->begin(window_s, fewest_rows); }
bool LogStream::next(Log& rows) { return impl_->then(rows); }
void LogStream::on_note(std::function<void(const std::string&)> said) { impl_->said = std::move(said); }
const std::vector<LeftOut>& LogStream::left_out() const { return impl_->left_out(); }

Log read_log(const std::string& path, const ReadOptions& options) { return LogReader(path, options).read(); }

}  // namespace dqw
