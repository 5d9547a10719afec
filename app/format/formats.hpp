// The list of formats, and which of them a file is.
#ifndef DQW_APP_FORMAT_FORMATS_HPP
#define DQW_APP_FORMAT_FORMATS_HPP

#include <optional>
#include <string>
#include <vector>

#include "app/format/format.hpp"

namespace dqw {

extern const Format vesc_tool, vesc_sampled, vesc_log, vesc_ros, tmotor_efficiency, tmotor_velocity, tmotor_pi,
    moteus_dyno, moteus_csv, moteus_stats, moteus_control, moteus_jsonl, mesc_log, mesc_status, openinverter_motor,
    openinverter_spot, openinverter_web, odrive, odrive_dyno, odrive_dyno_list, simplefoc, odri, float_control, floaty,
    plotjuggler, test_bench, tektronix, rigol, plain;

/// All formats, in the order in which they are tried; the last is dqwatch's own.
const std::vector<const Format*>& formats();

/// Throws std::invalid_argument that lists the names.
const Format& format_named(const std::string& name);

/// The format of a file that begins so. Throws InputError where it is nearly one, and says what differs, or where
/// numbers have no header and their number tells nothing.
const Format& format_of(const Head& head);

/// Throws the InputError that names what a file lacks of the format it is said to be.
void require_marks(const Format& format, const Head& head);

}  // namespace dqw
#endif
