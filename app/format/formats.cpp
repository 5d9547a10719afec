#include "app/format/formats.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"
#include "app/format/proposal.hpp"

namespace dqw {
namespace {

std::vector<std::string> marks_missing(const Format& format, const Head& head)
{
    std::vector<std::string> missing;
    for (const char* mark : format.marks)
        if (!head.has(mark)) missing.push_back(shown(mark));
    return missing;
}

/// A file that has columns under their own names is dqwatch's, whatever else is in it. Currents alone are not enough:
/// moteus calls its set points so.
bool is_plain(const Head& head)
{
    std::size_t own = 0;
    bool telling = false;
    for (const std::string& field : head.fields) {
        const auto column = column_named(field);
        own += column.has_value();
        telling = telling || (column && *column != col_i_d && *column != col_i_q && *column != col_torque);
    }
    return own >= 2 && telling;
}

}  // namespace

const std::vector<const Format*>& formats()
{
    static const std::vector<const Format*> all = {
        &vesc_tool,
        &vesc_sampled,
        &vesc_log,
        &vesc_ros,
        &tmotor_efficiency,
        &tmotor_velocity,
        &tmotor_pi,
        &moteus_dyno,
        &moteus_csv,
        &moteus_stats,
        &moteus_control,
        &moteus_jsonl,
        &mesc_log,
        &mesc_status,
        &openinverter_motor,
        &openinverter_spot,
        &openinverter_web,
        &odrive,
        &odrive_dyno,
        &odrive_dyno_list,
        &simplefoc,
        &odri,
        &float_control,
        &floaty,
        &plotjuggler,
        &test_bench,
        &tektronix,
        &rigol,
        &plain,
    };
    return all;
}

const Format& format_named(const std::string& name)
{
    std::vector<std::string> names;
    for (const Format* format : formats()) {
        if (name == format->name) return *format;
        names.emplace_back(format->name);
    }
    throw std::invalid_argument("no format " + shown(name) + "; there are " + list(names, names.size()));
}

void require_marks(const Format& format, const Head& head)
{
    const auto missing = marks_missing(format, head);
    if (missing.empty()) return;
    throw InputError(head.path, head.line,
                     fmt::format("not {} ({}): {} missing", format.name, format.about, list(missing)));
}

const Format& format_of(const Head& head)
{
    if (is_plain(head)) return plain;
    for (const Format* format : formats()) {
        if (format == &plain) break;
        if (format->recognises ? format->recognises(head) : marks_missing(*format, head).empty()) {
            require_marks(*format, head);
            return *format;
        }
    }
    if (head.headerless)
        throw InputError(head.path, head.line,
                         fmt::format("{} a line and no header; expected a header, or --format NAME (simplefoc, "
                                     "odrive_dyno; dqwatch formats lists all)",
                                     counted(head.fields.size(), "number")));
    for (const Format* format : formats()) {
        const auto missing = marks_missing(*format, head);
        // Three of four marks, and three at least, one of them no common name: id, iq, vd, vq are nobody's.
        if (format->marks.size() < 4 || missing.size() * 4 > format->marks.size()) continue;
        if (std::all_of(format->marks.begin(), format->marks.end(),
                        [&](const char* mark) { return !head.has(mark) || is_common_name(mark); }))
            continue;
        throw InputError(head.path, head.line,
                         fmt::format("nearly {} ({}): {} missing; --format dqwatch reads it by [columns] of the "
                                     "machine file",
                                     format->name, format->about, list(missing)));
    }
    return plain;
}

}  // namespace dqw
