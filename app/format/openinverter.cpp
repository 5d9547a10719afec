// openinverter: the decoded binary log, whose rows hold more fields than its header, and the web interface's log.csv.
#include <cmath>

#include "app/format/formats.hpp"

namespace dqw {
namespace {

// 65536/√3 less 200 digits, of 65536 for the whole link.
constexpr double modmax_share = 37637.0 / 65536.0;
constexpr double usual_rate_Hz = 8789.0;

bool is_motor(const Head& head) { return head.has("Time(s)") && head.has("count") && head.has("angle"); }

void describe_motor(Import& in)
{
    Head& head = in.head;
    const std::size_t named = head.fields.size();
    const std::size_t written = head.rows.empty() ? named : head.rows.front().size();
    const std::size_t fields = written - (head.trailing_separator && written > named ? 1 : 0);
    // Sums and other hidden fields stand before the last two, and only in the rows.
    if (fields > named && named >= 2) in.insert_fields(named - 2, fields - named, "(hidden)");
    in.row_period_s = in.given.period_s.value_or(1 / usual_rate_Hz);
    in.take(col_theta_e, "angle", "deg");
    in.take(col_i_q, "iq", "A");
    in.take(col_i_d, "id", "A");
    for (const auto& [column, name] : {std::pair(col_v_d, "ud"), std::pair(col_v_q, "uq")})
        in.take(column, scaled(in.field(name), modmax_share, "% · 37637/65536"), "% of v_dc");
    in.counter = head.find("count");
    in.speed_from_angle = true;
    in.regime = Regime::dynamic;
    in.voltage = "phase, peak, commanded, in % of modmax (37637)";
    in.notes.push_back("rows are taken one period apart, 8789 Hz unless --period says otherwise, and those that count "
                       "lacks are a gap: the stamps have too few digits, and lost messages are not in them");
}

bool is_web(const Head& head) { return head.has("Timestamp") && (head.has("udc") || head.has("uq")); }

bool is_spot(const Head& head) { return head.has("Time(s)") && !head.has("count") && head.has("udc"); }

void describe_web(Import& in)
{
    const auto take = [&](Column column, const std::string& name, const char* unit) {
        return in.take(column, name, unit) || in.take(column, name + " (avg)", unit);
    };
    if (!take(col_t, "Timestamp", "s")) take(col_t, "Time(s)", "s");
    take(col_i_d, "id", "A");
    take(col_i_q, "iq", "A");
    take(col_v_dc, "udc", "V");
    if (!take(col_w_m, "fstat", "Hz")) take(col_w_m, "speed", "rpm");
    take(col_temp_winding, "tmpm", "C");
    for (const auto& [column, name] : {std::pair(col_v_d, "ud"), std::pair(col_v_q, "uq")}) {
        std::size_t f = in.head.find(name);
        if (f == Head::none) f = in.head.find(std::string(name) + " (avg)");
        if (f != Head::none) in.take(column, scaled(in.field(f), 1.0 / 65536.0, "/65536"), "v_dc");
    }
    in.host_clock = true;
    in.regime = Regime::steady;
    in.voltage = "phase, peak, commanded, in digits of 65536; mean of the samples of a row";
}

}  // namespace

const Format openinverter_motor = {"openinverter_motor",
                                   "openinverter, binary log decoded (_motor_data.csv)",
                                   {"Time(s)", "count", "angle", "uq", "ud", "iq", "id"},
                                   is_motor,
                                   describe_motor};
const Format openinverter_spot = {"openinverter_spot",
                                  "openinverter, binary log decoded (_spot_values.csv)",
                                  {"Time(s)", "udc"},
                                  is_spot,
                                  describe_web};
const Format openinverter_web = {
    "openinverter_web", "openinverter, web interface's log.csv", {"Timestamp"}, is_web, describe_web};

}  // namespace dqw
