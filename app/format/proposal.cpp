#include "app/format/proposal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/base/text.hpp"
#include "app/format/unit.hpp"

namespace dqw {
namespace {

/// A name as people write it, without case, spaces and signs, and the unit that it then is in.
struct CommonName {
    Column column;
    const char* name;
    const char* unit;
};

// The likelier of a column first.
const CommonName common_names[] = {
    {col_t, "t", "s"},
    {col_t, "time", "s"},
    {col_t, "timestamp", "s"},
    {col_v_d, "vd", "V"},
    {col_v_d, "ud", "V"},
    {col_v_d, "voltaged", "V"},
    {col_v_d, "vdref", "V"},
    {col_v_d, "udref", "V"},
    {col_v_d, "vdcmd", "V"},
    {col_v_q, "vq", "V"},
    {col_v_q, "uq", "V"},
    {col_v_q, "voltageq", "V"},
    {col_v_q, "vqref", "V"},
    {col_v_q, "uqref", "V"},
    {col_v_q, "vqcmd", "V"},
    {col_i_d, "id", "A"},
    {col_i_d, "currentd", "A"},
    {col_i_q, "iq", "A"},
    {col_i_q, "currentq", "A"},
    {col_w_m, "omegam", "rad/s"},
    {col_w_m, "wm", "rad/s"},
    {col_w_m, "rpm", "rpm"},
    {col_w_m, "speed", "rad/s"},
    {col_w_m, "velocity", "rad/s"},
    {col_w_m, "omega", "rad/s"},
    {col_w_m, "w", "rad/s"},
    {col_w_m, "omegae", "electrical rad/s"},
    {col_w_m, "we", "electrical rad/s"},
    {col_w_m, "erpm", "erpm"},
    {col_theta_e, "thetae", "rad"},
    {col_theta_e, "electricalangle", "rad"},
    {col_theta_e, "elecangle", "rad"},
    {col_theta_e, "elecdeg", "deg"},
    {col_theta_e, "theta", "rad"},
    {col_theta_m, "thetam", "rad"},
    {col_theta_m, "mechangle", "rad"},
    {col_theta_m, "mechdeg", "deg"},
    {col_theta_m, "position", "rad"},
    {col_v_dc, "vdc", "V"},
    {col_v_dc, "udc", "V"},
    {col_v_dc, "vbus", "V"},
    {col_v_dc, "busvoltage", "V"},
    {col_temp_winding, "tempwinding", "C"},
    {col_temp_winding, "motortemp", "C"},
    {col_temp_winding, "temperature", "C"},
    {col_temp_winding, "temp", "C"},
    {col_torque, "torque", "Nm"},
};

/// Of all phases, or alpha and beta.
struct PhaseNames {
    std::vector<const char*> names;
    const char* kind;  ///< of [columns]; empty: phases
};
const std::vector<PhaseNames> phase_currents = {{{"ialpha", "ibeta"}, "alpha_beta"},
                                                {{"ia", "ib", "ic"}, ""},
                                                {{"iu", "iv", "iw"}, ""},
                                                {{"ia", "ib"}, ""},
                                                {{"iu", "iv"}, ""}};
const std::vector<PhaseNames> phase_voltages = {
    {{"valpha", "vbeta"}, "alpha_beta"}, {{"va", "vb", "vc"}, ""}, {{"vu", "vv", "vw"}, ""}};

struct Field {
    std::string written, name, unit;  ///< as in the file; as CommonName has it; what it says of its unit
};

/// "Id [A]", "speed_rpm", "i_d (measured)".
Field read(const Head& head, std::size_t f)
{
    Field out;
    out.written = head.fields[f];
    std::string text(trimmed(out.written));
    const std::size_t open = text.find_last_of("[(");
    if (open != std::string::npos && open > 0 && (text.back() == ']' || text.back() == ')'))
        out.unit = trimmed(text.substr(open + 1, text.size() - open - 2)), text.resize(open);
    else if (f < head.units.size())
        out.unit = head.units[f];
    for (const char c : text)
        if (std::isalnum(static_cast<unsigned char>(c)))
            out.name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    for (const std::string end : {"measured", "meas", "actual", "act", "feedback", "fb"})
        if (out.name.size() > end.size() + 1 && out.name.compare(out.name.size() - end.size(), end.size(), end) == 0) {
            out.name.resize(out.name.size() - end.size());
            break;
        }
    return out;
}

/// Of a unit what is left where it stands behind a name: rad/s as rad_s.
std::string squeezed(const std::string& unit)
{
    std::string out;
    for (const char c : unit)
        if (std::string_view(" /_.").find(c) == std::string_view::npos) out += c;
    return out;
}

/// In other letters' case, but not in another size: MV is no mV.
bool is_written(const std::string& said, const std::string& unit)
{
    return equal_ignoring_case(squeezed(said), squeezed(unit)) && (said.front() != 'M' || unit.front() != 'm');
}

/// As the unit's own name is written; empty where it is none.
std::string unit_of(Column column, const std::string& said)
{
    static const std::pair<const char*, const char*> others[] = {{"1/min", "rpm"},  {"min-1", "rpm"}, {"min^-1", "rpm"},
                                                                 {"r/min", "rpm"},  {"U/min", "rpm"}, {"°", "deg"},
                                                                 {"\u03bcs", "µs"}, {"sec", "s"}};
    for (const auto& [other, unit] : others)
        if (is_unit(column, unit) && equal_ignoring_case(other, said)) return unit;
    if (!said.empty())
        for (const std::string& unit : unit_names(column))
            if (is_unit(column, unit) && is_written(said, unit)) return unit;
    return "";
}

/// Of a speed whose name says that it is electrical, or the shaft's: its unit is so as well, or none that is known.
std::string unit_of_speed(const CommonName& common, const std::string& unit)
{
    const std::string of_name = common.unit, name = common.name;
    if (common.column != col_w_m || unit.empty()) return unit;
    if (of_name == "electrical rad/s" || of_name == "erpm") {
        if (unit == "rad/s") return "electrical rad/s";
        if (unit == "rpm") return "erpm";
        return unit == "Hz" || unit == "erpm" || unit == "electrical rad/s" ? unit : "";
    }
    const bool shaft = name == "omegam" || name == "wm" || name == "rpm";
    return shaft && unit == "Hz" ? "turns/s" : unit;
}

/// Whether a field has this name, with or without a unit behind it.
bool is_called(const Field& field, Column column, const std::string& name, std::string& unit)
{
    if (field.name.compare(0, name.size(), name) != 0) return false;
    const std::string behind = field.name.substr(name.size());
    unit = behind.empty() ? unit_of(column, field.unit) : unit_of(column, behind);
    return behind.empty() || !unit.empty();
}

std::string quoted(const std::string& text) { return nlohmann::json(text).dump(); }

/// Can TOML name it? No byte of it is a control's.
bool can_be_named(const std::string& name) { return printable(name) == name; }

/// What is wrong with a unit that is taken as SI, or as the name says.
std::string doubt_of(const Field& field, const std::string& unit)
{
    if (!unit.empty()) return "";
    if (field.unit.empty()) return "the header says no unit";
    return (can_be_named(field.unit) ? shown(field.unit) : "what the header says") + " is no unit that is known";
}

/// Names of phases that are all there.
bool propose_phases(const std::vector<Field>& fields, Column column, const char* key, const PhaseNames& phases,
                    std::vector<ProposedColumn>& out)
{
    std::string from, unit, first, doubt;
    for (const char* name : phases.names) {
        const auto found = std::find_if(fields.begin(), fields.end(),
                                        [&](const Field& f) { return is_called(f, column, name, unit); });
        if (found == fields.end()) return false;
        if (from.empty()) first = unit, doubt = doubt_of(*found, unit);
        // [columns] has one unit for all of them.
        if (unit != first || doubt_of(*found, unit) != doubt) return false;
        from += (from.empty() ? "" : ", ") + quoted(found->written);
    }
    const std::string kind = *phases.kind ? fmt::format(", kind = \"{}\"", phases.kind) : "";
    out.push_back({key,
                   fmt::format("{{ from = [{}]{}, unit = \"{}\" }}", from, kind,
                               first.empty() ? unit_names(column).front() : first),
                   doubt, ""});
    return true;
}

}  // namespace

std::vector<ProposedColumn> proposed_columns(const Head& head, const ColumnSet& has)
{
    std::vector<Field> fields;
    for (std::size_t f = 0; f < head.fields.size(); ++f)
        if (can_be_named(head.fields[f])) fields.push_back(read(head, f));
    std::vector<ProposedColumn> out;
    ColumnSet found{};
    for (const CommonName& common : common_names) {
        if (has[common.column] || found[common.column]) continue;
        for (const Field& field : fields) {
            std::string unit;
            if (!is_called(field, common.column, common.name, unit)) continue;
            // Twice there, it cannot be asked for.
            if (std::count(head.fields.begin(), head.fields.end(), field.written) > 1) continue;
            found[common.column] = true;
            unit = unit_of_speed(common, unit);
            std::string doubt = doubt_of(field, unit);
            const bool of_name = std::string(common.unit) != unit_names(common.column).front();
            if (of_name && field.unit.empty()) doubt.clear();
            out.push_back({columns[common.column].name,
                           fmt::format("{{ from = {}, unit = \"{}\" }}", quoted(field.written),
                                       unit.empty() ? common.unit : unit),
                           std::move(doubt), ""});
            break;
        }
    }
    const bool angle = has[col_theta_e] || found[col_theta_e] || has[col_theta_m] || found[col_theta_m];
    // A single one beside all phases is something else: Id of a row.
    const auto try_phases = [&](Column d, Column q, const char* key, const std::vector<PhaseNames>& all) {
        if (has[d] || has[q] || (found[d] && found[q])) return;
        for (const PhaseNames& phases : all) {
            if (!propose_phases(fields, d, key, phases, out)) continue;
            out.erase(std::remove_if(out.begin(), out.end(),
                                     [&](const ProposedColumn& p) {
                                         return p.name == columns[d].name || p.name == columns[q].name;
                                     }),
                      out.end());
            if (!angle) out.back().needs = columns[col_theta_e].name;
            return;
        }
    };
    try_phases(col_i_d, col_i_q, "i_dq_A", phase_currents);
    try_phases(col_v_d, col_v_q, "v_dq_V", phase_voltages);
    return out;
}

bool is_common_name(const std::string& field)
{
    Head head;
    head.fields = {field};
    return !proposed_columns(head, {}).empty();
}

}  // namespace dqw
