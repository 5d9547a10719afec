#include "app/report/datasheet.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/base/parameters.hpp"

namespace dqw {
namespace {

constexpr double kRpm = 9.549296585513721;  // rpm in a rad/s
// Copper; magnets lose from half to twice as much as here, by their kind.
constexpr double kAlpha_per_K = 0.0039, kBeta_per_K = 0.001, kOfKind = 0.5;
constexpr double kTold_K = 50.0;  // the largest deviation

/// Of line-to-line peak volts: turning at w_m, two lines have sqrt(3) p psi w_m.
double Kv_of(double pole_pairs, double psi_Wb) { return kRpm / (std::sqrt(3.0) * pole_pairs * psi_Wb); }

double Kt_of(double pole_pairs, double psi_Wb) { return 1.5 * pole_pairs * psi_Wb; }

struct Known {
    const Estimate *R, *Ld, *Lq, *psi, *p;
    explicit Known(const Result& r)
        : R(find_estimate(r.parameters, "R_ohm")), Ld(find_estimate(r.parameters, "Ld_H")),
          Lq(find_estimate(r.parameters, "Lq_H")), psi(find_estimate(r.parameters, "psi_Wb")),
          p(find_estimate(r.parameters, "pole_pairs"))
    {
        if (psi && !(psi->value > 0.0)) psi = nullptr;
        if (p && !(p->value > 0.0)) p = nullptr;
    }
    void drop_what_is_not_usable()
    {
        for (const Estimate** e : {&R, &Ld, &Lq, &psi})
            if (*e && !why_not_usable(**e).empty()) *e = nullptr;
    }
    double L_H() const { return Ld && Lq ? 0.5 * (Ld->value + Lq->value) : (Lq ? Lq : Ld)->value; }
};

// mcconf's names and units: datatypes.h and confgenerator of vedderb/bldc; L is the mean of both axes and the
// difference L_q - L_d, foc_precalc_values in foc_math.c there.
std::vector<std::string> vesc(const Known& k)
{
    std::vector<std::string> out = {fmt::format("si_motor_poles {:.0f}", 2.0 * k.p->value)};
    if (k.R) out.push_back(fmt::format("foc_motor_r {:.4g}", k.R->value));
    if (k.Ld || k.Lq) out.push_back(fmt::format("foc_motor_l {:.4g}", k.L_H()));
    if (k.Ld && k.Lq) out.push_back(fmt::format("foc_motor_ld_lq_diff {:.4g}", k.Lq->value - k.Ld->value));
    if (k.psi) out.push_back(fmt::format("foc_motor_flux_linkage {:.4g}", k.psi->value));
    return out;
}

// mjbots/moteus, moteus_tool.py, firmware of ABI 0x010a and later; earlier ones took v_per_hz.
std::vector<std::string> moteus(const Known& k)
{
    std::vector<std::string> out = {fmt::format("conf set motor.poles {:.0f}", 2.0 * k.p->value)};
    if (k.R) out.push_back(fmt::format("conf set motor.resistance_ohm {:.4g}", k.R->value));
    if (k.psi) out.push_back(fmt::format("conf set motor.Kv {:.4g}", Kv_of(k.p->value, k.psi->value)));
    return out;
}

// odriverobotics/ODrive, firmware 0.5: Motor::Config_t in motor.hpp; torque_constant is 8.27/Kv in its documentation.
std::vector<std::string> odrive(const Known& k)
{
    const std::string at = "odrv0.axis0.motor.config.";
    std::vector<std::string> out = {fmt::format("{}pole_pairs = {:.0f}", at, k.p->value)};
    if (k.R) out.push_back(fmt::format("{}phase_resistance = {:.4g}", at, k.R->value));
    if (k.Ld || k.Lq) out.push_back(fmt::format("{}phase_inductance = {:.4g}", at, k.L_H()));
    if (k.psi) out.push_back(fmt::format("{}torque_constant = {:.4g}", at, Kt_of(k.p->value, k.psi->value)));
    return out;
}

// simplefoc/Arduino-FOC, BLDCMotor.cpp: pole pairs, phase resistance, KV, phase inductance, in this order; the voltage
// it expects is w_m / (sqrt(3) KV), so KV is of line-to-line peak volts.
std::vector<std::string> simplefoc(const Known& k)
{
    const auto known = [](bool is, double value) {
        return is ? fmt::format("{:.4g}f", value) : std::string("NOT_SET");
    };
    const bool L = k.Ld || k.Lq;
    return {fmt::format("BLDCMotor motor({:.0f}, {}, {}, {});", k.p->value, known(k.R, k.R ? k.R->value : 0.0),
                        known(k.psi, k.psi ? Kv_of(k.p->value, k.psi->value) : 0.0), known(L, L ? k.L_H() : 0.0))};
}

}  // namespace

std::vector<Estimate> datasheet_numbers(const Result& result, const Machine& nominal)
{
    const Known k(result);
    std::vector<Estimate> out;
    if (k.p && k.psi) {
        const double Kv = Kv_of(k.p->value, k.psi->value), Kt = Kt_of(k.p->value, k.psi->value);
        const double part = k.psi->sd / k.psi->value;
        out.push_back({"Kv_rpm_V", Kv, Kv * part, false});
        out.push_back({"Kt_Nm_A", Kt, Kt * part, false});
    }
    if (k.R) out.push_back({"R_line_to_line_ohm", 2.0 * k.R->value, 2.0 * k.R->sd, false});
    const auto warmer = [&](const char* name, const Estimate* e, const std::optional<double>& cold, double per_K,
                            double unsure) {
        if (!e || !cold || !(*cold > 0.0)) return;
        const double K = (e->value / *cold - 1.0) / per_K, sd = std::hypot(e->sd / (per_K * *cold), unsure * K);
        if (sd < kTold_K) out.push_back({name, K, sd, false});
    };
    warmer("warmer_by_R_K", k.R, nominal.R_ohm, kAlpha_per_K, 0.0);
    warmer("warmer_by_psi_K", k.psi, nominal.psi_Wb, -kBeta_per_K, kOfKind);
    return out;
}

std::vector<ControllerSettings> controller_settings(const Result& result)
{
    Known k(result);
    k.drop_what_is_not_usable();
    if (!k.p || (!k.R && !k.Ld && !k.Lq && !k.psi)) return {};
    return {{"VESC", vesc(k)}, {"moteus", moteus(k)}, {"ODrive 0.5", odrive(k)}, {"SimpleFOC", simplefoc(k)}};
}

nlohmann::ordered_json datasheet_json(const Result& result, const Machine& nominal)
{
    auto json = nlohmann::ordered_json::object();
    for (const Estimate& e : datasheet_numbers(result, nominal)) json[e.name] = {{"value", e.value}, {"sd", e.sd}};
    for (const ControllerSettings& s : controller_settings(result)) json["settings"][s.controller] = s.lines;
    return json;
}

std::string datasheet_text(const Result& result, const Machine& nominal)
{
    std::string out;
    const auto numbers = datasheet_numbers(result, nominal);
    const auto find = [&](const char* name) { return find_estimate(numbers, name); };
    const auto add = [&](const std::string& text) { out += (out.empty() ? "\nas on a data sheet: " : ", ") + text; };
    if (const auto* Kv = find("Kv_rpm_V"))
        add(fmt::format("Kv {:.4g} ± {:.2g} rpm/V (line to line, peak)", Kv->value, Kv->sd));
    if (const auto* Kt = find("Kt_Nm_A")) add(fmt::format("K_t {:.4g} ± {:.2g} Nm/A", Kt->value, Kt->sd));
    if (const auto* R = find("R_line_to_line_ohm"))
        add(fmt::format("R {:.4g} ± {:.2g} Ω line to line", R->value, R->sd));
    for (const auto& [name, of] : {std::pair("warmer_by_R_K", "R"), std::pair("warmer_by_psi_K", "ψ")})
        if (const auto* K = find(name)) {
            // No minus before nothing, and a deviation of 0 is none.
            const double value = std::abs(K->value) < 0.5 ? 0.0 : K->value, sd = std::abs(K->sd);
            add(fmt::format("by {} {:.0f} ± {} K warmer than the machine file's", of, value,
                            sd < 1.0 ? fmt::format("{:.1g}", sd) : fmt::format("{:.0f}", sd)));
        }
    if (!out.empty()) out += '\n';
    for (const ControllerSettings& s : controller_settings(result)) {
        out += fmt::format("\n{}\n", s.controller);
        for (const std::string& line : s.lines) out += "  " + line + "\n";
    }
    return out;
}

}  // namespace dqw
