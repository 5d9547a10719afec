// MESC: `log -fl`, arrays of the fast loop in one JSON object, and `status json`, one object a line.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"
#include "app/format/formats.hpp"
#include "app/format/json.hpp"

namespace dqw {
namespace {

const char* const arrays[] = {"time",          "Vbus.V.y1",  "Iu.I_phase.y1", "Iv.I_phase.y1",
                              "Iw.I_phase.y1", "Vd.V_dq.y1", "Vq.V_dq.y1",    "angle.misc.y1"};

bool log_to_csv(const std::string& path, const std::string& text, CsvText& csv)
{
    // The array of the hall sensor stands behind the object: only the object's line is JSON.
    const JsonLine line = first_object(text);
    if (!line.object.is_object() || !line.object.contains("time") || !line.object["time"].is_array()) return false;
    std::size_t rows = line.object["time"].size();
    std::string header;
    for (const char* name : arrays) {
        const auto found = line.object.find(name);
        if (found == line.object.end() || !found->is_array())
            throw InputError(path, line.number,
                             fmt::format("nearly a file of MESC's log -fl: no array {}", shown(name)));
        if (found->size() != rows)
            throw InputError(path, line.number,
                             fmt::format("{} has {}, time has {}; expected as many", shown(name),
                                         counted(found->size(), "value"), rows));
        header += (header.empty() ? "" : ",") + std::string(name);
    }
    csv.add(header, line.number);
    for (std::size_t k = 0; k < rows; ++k) {
        std::string row;
        for (const char* name : arrays) row += (row.empty() ? "" : ",") + json_cell(line.object[name][k]);
        csv.add(row, line.number);
    }
    return true;
}

void describe_log(Import& in)
{
    in.take(col_t, "time", "s");
    in.take(col_v_dc, "Vbus.V.y1", "V");
    in.take(col_theta_e, "angle.misc.y1", "16-bit turns");
    in.take_park(col_i_d, col_i_q,
                 clarke_of_phases({in.field("Iu.I_phase.y1"), in.field("Iv.I_phase.y1"), in.field("Iw.I_phase.y1")}));
    in.take(col_v_d, "Vd.V_dq.y1", "V");
    in.take(col_v_q, "Vq.V_dq.y1", "V");
    in.speed_from_angle = true;
    in.regime = Regime::dynamic;
    in.voltage = "phase, peak, commanded; acts from its row on";
}

bool status_to_csv(const std::string& path, const std::string& text, CsvText& csv)
{
    const JsonLine first = first_object(text);
    if (!first.object.is_object() || !first.object.contains("ehz")) return false;
    return objects_to_csv(path, text, csv);
}

void describe_status(Import& in)
{
    in.take(col_v_dc, "vbus", "V");
    in.take(col_w_m, "ehz", "Hz");
    in.take(col_i_d, "id", "A");
    in.take(col_i_q, "iq", "A");
    in.take(col_v_d, "Vd", "V");
    in.take(col_v_q, "Vq", "V");
    in.take(col_temp_winding, "TMOT", "K");
    in.drop("error", is_not_zero, "error is not 0");
    in.row_period_s = in.given.period_s.value_or(0.1);
    in.host_clock = true;
    in.polled = true;
    in.voltage = "phase, peak, commanded, instants; currents are smoothed";
    in.notes.push_back("no time in the file: rows are taken 0.1 s apart, as the firmware writes them, unless --period "
                       "says otherwise");
}

}  // namespace

const Format mesc_log = {"mesc_log", "MESC, log -fl", {"time", "Iu.I_phase.y1", "Vd.V_dq.y1", "angle.misc.y1"},
                         nullptr,    describe_log,    log_to_csv};
const Format mesc_status = {"mesc_status", "MESC, status json", {"ehz", "id", "iq", "Vd", "Vq"},
                            nullptr,       describe_status,     status_to_csv};

}  // namespace dqw
