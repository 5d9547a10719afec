// dqw_model_config.h: what a trace found, for firmware.
#ifndef DQW_APP_FIRMWARE_MODEL_CONFIG_HPP
#define DQW_APP_FIRMWARE_MODEL_CONFIG_HPP

#include <string>
#include <vector>

#include "ref/trace/trace.hpp"

namespace dqw {

/// A header in C99 and C++11 that includes dqw.h alone: nominal values, the effects found with their start values, and
/// a function that puts both into a configuration. Also where no effect was found. `logs`: files that the trace read,
/// named in a comment.
std::string model_config_text(const TraceResult& trace, const std::vector<std::string>& logs = {});

/// A flux map's table as an array of that name.
std::string map_table_text(const std::string& name, const std::vector<std::int16_t>& map);

/// A file's name without its folder, that cannot end the comment it stands in.
std::string harmless(const std::string& path);

}  // namespace dqw
#endif
