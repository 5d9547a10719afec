#include "app/cmd/version.hpp"

#include <ceres/version.h>
#include <fmt/format.h>
#include <sundials/sundials_config.h>
#include <toml++/toml.h>
#include <zlib.h>
#include <zstd.h>

#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "dqw_size.h"
#include "dqw_version.h"

namespace dqw {
namespace {

#if defined(__clang__)
constexpr const char* compiler = __VERSION__;
#elif defined(__GNUC__)
constexpr const char* compiler = "GCC " __VERSION__;
#else
constexpr const char* compiler = "not known";
#endif

}  // namespace

std::string version_text()
{
    const auto row = [](const char* name, const std::string& what) { return fmt::format("  {:<15}{}\n", name, what); };
    const auto dotted = [](int a, int b, int c) { return fmt::format("{}.{}.{}", a, b, c); };
    return fmt::format("dqwatch {}\nbuilt with\n", DQW_VERSION) + row("compiler", compiler) +
           row("SUNDIALS", SUNDIALS_VERSION) + row("Ceres", CERES_VERSION_STRING) +
           row("Eigen", dotted(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)) +
           row("CLI11", CLI11_VERSION) +
           row("nlohmann-json",
               dotted(NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH)) +
           row("toml++", dotted(TOML_LIB_MAJOR, TOML_LIB_MINOR, TOML_LIB_PATCH)) +
           row("fmt", dotted(FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100)) +
           row("zlib", ZLIB_VERSION) + row("zstd", ZSTD_VERSION_STRING) +
           row("lib/", fmt::format("room for {} weights of effects", DQW_EFFECT_WEIGHTS));
}

}  // namespace dqw
