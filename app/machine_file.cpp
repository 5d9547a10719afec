#include "machine_file.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "input_error.hpp"
#include "text.hpp"

// toml++ 3.3 asserts on a table header such as [=x]. That is bad input and no bug here: an exception, whatever NDEBUG says.
#undef NDEBUG
namespace {
struct BadHeader {};
[[noreturn]] void throw_bad_header() { throw BadHeader(); }
}  // namespace
#define TOML_ASSERT(expr) ((expr) ? void() : throw_bad_header())
#include <toml++/toml.h>

namespace dqw {
namespace {

/// What a nominal value may be.
enum class Range { positive, not_negative };

struct Nominal {
    const char* key;
    std::optional<double> Machine::*value;
    Range range;
};

// A reluctance machine has no magnet flux, and friction may be left out by writing 0.
const Nominal nominals[] = {
    {"R_ohm", &Machine::R_ohm, Range::positive},
    {"Ld_H", &Machine::Ld_H, Range::positive},
    {"Lq_H", &Machine::Lq_H, Range::positive},
    {"psi_Wb", &Machine::psi_Wb, Range::not_negative},
    {"J_kgm2", &Machine::J_kgm2, Range::positive},
    {"B_Nms_rad", &Machine::B_Nms_rad, Range::not_negative},
    {"torque_constant_Nm_A", &Machine::torque_constant_Nm_A, Range::positive},
};

class Reader {
public:
    explicit Reader(const std::string& path) { file_.path = path; }

    MachineFile read()
    {
        const std::string text = slurp();
        note_sources(text);
        toml::table root;
        try {
            root = toml::parse(text);
        } catch (const toml::parse_error& error) {
            throw InputError(file_.path, error.source().begin.line, fmt::format("not TOML: {}", error.description()));
        } catch (const BadHeader&) {
            throw InputError(file_.path, line_of_bad_header(text), "not TOML: a table header without a name; expected e.g. [machine]");
        }
        for (auto&& [key, node] : root) {
            if (key == "machine")
                read_machine(table(key.str(), node));
            else if (key == "log")
                read_log_table(table(key.str(), node));
            else if (key == "columns")
                read_columns(table(key.str(), node));
            else
                unknown_.push_back(std::string(key.str()));
        }
        if (!unknown_.empty()) file_.notes.push_back(fmt::format("{}: unknown and ignored: {}", file_.path, list(unknown_)));
        return std::move(file_);
    }

private:
    std::string slurp() const
    {
        struct stat info = {};
        if (::stat(file_.path.c_str(), &info) != 0)
            throw InputError(file_.path, 0, std::string("cannot be opened: ") + std::strerror(errno) + "; expected a machine file (TOML)");
        if (S_ISDIR(info.st_mode)) throw InputError(file_.path, 0, "is a directory; expected a machine file (TOML)");
        std::ifstream in(file_.path, std::ios::binary);
        if (!in) throw InputError(file_.path, 0, "cannot be read; expected a machine file (TOML)");
        // A machine file is some lines; whoever names a log by mistake is told so at once.
        std::string text(largest_bytes + 1, '\0');
        in.read(text.data(), static_cast<std::streamsize>(text.size()));
        text.resize(static_cast<std::size_t>(in.gcount()));
        if (text.size() > largest_bytes) throw InputError(file_.path, 1, "larger than 1 MiB; expected a machine file (TOML)");
        return text;
    }

    /// The first line that opens a bracket on something no key begins with.
    static std::size_t line_of_bad_header(const std::string& text)
    {
        std::istringstream in(text);
        std::size_t number = 1;
        for (std::string line; std::getline(in, line); ++number) {
            const auto bracket = line.find_first_not_of(" \t");
            if (bracket == line.npos || line[bracket] != '[') continue;
            const auto name = line.find_first_not_of("[ \t", bracket);
            if (name == line.npos || !(std::isalnum(static_cast<unsigned char>(line[name])) || std::strchr("_-\"'", line[name]))) return number;
        }
        return 1;
    }

    void note_sources(const std::string& text)
    {
        std::istringstream in(text);
        for (std::string line; std::getline(in, line);) {
            const std::string_view mark = "# Source:";
            if (line.compare(0, mark.size(), mark) != 0) continue;
            if (!line.empty() && line.back() == '\r') line.pop_back();
            file_.public_sources.emplace_back(trimmed(std::string_view(line).substr(mark.size())));
        }
    }

    [[noreturn]] void refuse(const toml::node& node, const std::string& what) const { throw InputError(file_.path, node.source().begin.line, what); }

    const toml::table& table(std::string_view key, const toml::node& node) const
    {
        if (!node.is_table()) refuse(node, fmt::format("{} is not a table; expected [{}]", key, key));
        return *node.as_table();
    }

    double number(const std::string& key, const toml::node& node) const
    {
        if (!node.is_number()) refuse(node, fmt::format("{} is not a number; expected e.g. {} = 0.5", key, key));
        const double value = node.is_integer() ? static_cast<double>(node.as_integer()->get()) : node.as_floating_point()->get();
        if (!std::isfinite(value)) refuse(node, fmt::format("{} is not finite", key));
        return value;
    }

    std::string string(const std::string& key, const toml::node& node) const
    {
        if (!node.is_string()) refuse(node, fmt::format("{} is not a string; expected {} = \"…\"", key, key));
        return node.as_string()->get();
    }

    void read_machine(const toml::table& machine)
    {
        for (auto&& [key_, node] : machine) {
            const std::string key(key_.str());
            if (key == "name") {
                file_.machine.name = string(key, node);
                continue;
            }
            if (key == "pole_pairs") {
                const double p = number(key, node);
                if (!(p >= 1 && p <= 1000) || p != std::floor(p)) refuse(node, fmt::format("pole_pairs is {:g}; expected a positive integer", p));
                file_.machine.pole_pairs = p;
                continue;
            }
            const Nominal* nominal = nullptr;
            for (const Nominal& n : nominals)
                if (key == n.key) nominal = &n;
            if (!nominal) {
                unknown_.push_back("machine." + key);
                continue;
            }
            const double value = number(key, node);
            const bool zero_is_fine = nominal->range == Range::not_negative;
            if (value < 0 || (value == 0 && !zero_is_fine))
                refuse(node, fmt::format("{} is {:g}; expected a {} number", key, value, zero_is_fine ? "non-negative" : "positive"));
            file_.machine.*(nominal->value) = value;
        }
    }

    void read_log_table(const toml::table& log)
    {
        for (auto&& [key_, node] : log) {
            const std::string key(key_.str());
            if (key == "regime") {
                const std::string name = string(key, node);
                file_.regime = regime_named(name);
                if (!file_.regime) refuse(node, fmt::format("regime is {}; expected dynamic, steady, standstill or mechanical", shown(name)));
            } else if (key == "voltage_interval") {
                const std::string name = string(key, node);
                if (name != "next" && name != "previous") refuse(node, fmt::format("voltage_interval is {}; expected next or previous", shown(name)));
                file_.voltage_previous = name == "previous";
            } else {
                unknown_.push_back("log." + key);
            }
        }
    }

    void read_columns(const toml::table& map)
    {
        for (auto&& [key_, node] : map) {
            const std::string key(key_.str());
            const auto column = column_named(key);
            if (!column) {
                unknown_.push_back("columns." + key);
                continue;
            }
            ColumnSource& source = file_.sources[*column];
            source.line = node.source().begin.line;
            if (node.is_string())
                source.name = node.as_string()->get();
            else if (node.is_table())
                read_source(key, *node.as_table(), source);
            else
                refuse(node, fmt::format("columns.{} is neither a name nor {{ from = \"…\", scale = … }}", key));
            if (source.name.empty()) refuse(node, fmt::format("columns.{} names no column; expected from = \"name in the CSV\"", key));
        }
    }

    void read_source(const std::string& key, const toml::table& entry, ColumnSource& source)
    {
        source.name = key;
        for (auto&& [field_, node] : entry) {
            const std::string field(field_.str());
            if (field == "from") {
                source.name = string("from", node);
            } else if (field == "scale") {
                source.scale = number("scale", node);
                if (source.scale == 0) refuse(node, "scale is 0; expected the factor from the file's unit to SI");
            } else {
                unknown_.push_back("columns." + key + "." + field);
            }
        }
    }

    static constexpr std::size_t largest_bytes = std::size_t{1} << 20;
    MachineFile file_;
    std::vector<std::string> unknown_;
};

}  // namespace

MachineFile read_machine_file(const std::string& path) { return Reader(path).read(); }

MachineFile machine_file_of(const std::string& log_path, const std::string& chosen)
{
    if (!chosen.empty()) return read_machine_file(chosen);
    const std::filesystem::path beside = std::filesystem::path(log_path).replace_extension(".toml");
    std::error_code ignored;
    if (beside != std::filesystem::path(log_path) && std::filesystem::exists(beside, ignored)) return read_machine_file(beside.string());
    return {};
}

}  // namespace dqw
