// Two flux maps of one machine as a page: both, and where they differ.
#ifndef DQW_APP_TRACE_MAPS_PAGE_HPP
#define DQW_APP_TRACE_MAPS_PAGE_HPP

#include <array>
#include <string>

#include "app/report/compare_maps.hpp"

namespace dqw {

/// One file that opens offline; `files` are the maps' own.
std::string maps_page(const std::array<std::string, 2>& files, const FluxMap& first, const FluxMap& second);

}  // namespace dqw
#endif
