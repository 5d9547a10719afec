// Which field of a file makes which column: what the format says, and over it what the machine file says.
#ifndef DQW_APP_READ_MAPPING_HPP
#define DQW_APP_READ_MAPPING_HPP

#include <string>

#include "app/format/formats.hpp"
#include "app/read/machine_file.hpp"

namespace dqw {

/// The format of the file: `name` where that is not empty, else by the head. Throws InputError.
const Format& format_for(const Head& head, const Format* json, const std::string& name, const MachineFile& machine);

/// What `format` makes of the file, with what the machine file tells of columns put over it; throws InputError.
void map_columns(Import& in, const Format& format, const MachineFile& machine);

/// Names of fields that make no column.
std::vector<std::string> unused_fields(const Import& in);

/// Names that are safe on a terminal, without quotes.
std::vector<std::string> shown_all(const std::vector<std::string>& names);

}  // namespace dqw
#endif
