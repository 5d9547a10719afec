#include "app/page/assets.hpp"

// Their bytes, from asset_bytes.S.
extern "C" {
extern const char dqw_asset_dygraphs_js[], dqw_asset_dygraphs_js_end[];
extern const char dqw_asset_dygraphs_css[], dqw_asset_dygraphs_css_end[];
extern const char dqw_asset_dygraphs_licence[], dqw_asset_dygraphs_licence_end[];
extern const char dqw_asset_report_css[], dqw_asset_report_css_end[];
extern const char dqw_asset_report_js[], dqw_asset_report_js_end[];
}

namespace dqw {
namespace {

std::string_view between(const char* begin, const char* end) { return {begin, static_cast<std::size_t>(end - begin)}; }

/// A source map is a file that a browser would look for.
std::string_view without_source_map(std::string_view text)
{
    const std::size_t at = text.rfind("sourceMappingURL");
    if (at == std::string_view::npos) return text;
    return text.substr(0, text.rfind('\n', at));
}

}  // namespace

std::string_view dygraphs_js() { return without_source_map(between(dqw_asset_dygraphs_js, dqw_asset_dygraphs_js_end)); }
std::string_view dygraphs_css()
{
    return without_source_map(between(dqw_asset_dygraphs_css, dqw_asset_dygraphs_css_end));
}
std::string_view dygraphs_licence() { return between(dqw_asset_dygraphs_licence, dqw_asset_dygraphs_licence_end); }
std::string_view report_css() { return between(dqw_asset_report_css, dqw_asset_report_css_end); }
std::string_view report_js() { return between(dqw_asset_report_js, dqw_asset_report_js_end); }

}  // namespace dqw
