#include "app/base/columns.hpp"

namespace dqw {

constexpr std::array<ColumnInfo, column_count> columns = {{
    {col_t, "t_s", &Log::t_s},
    {col_v_d, "v_d_V", &Log::v_d_V},
    {col_v_q, "v_q_V", &Log::v_q_V},
    {col_i_d, "i_d_A", &Log::i_d_A},
    {col_i_q, "i_q_A", &Log::i_q_A},
    {col_w_m, "w_m_rad_s", &Log::w_m_rad_s},
    {col_theta_e, "theta_e_rad", &Log::theta_e_rad},
    {col_theta_m, "theta_m_rad", &Log::theta_m_rad},
    {col_v_dc, "v_dc_V", &Log::v_dc_V},
    {col_temp_winding, "temp_winding_C", &Log::temp_winding_C},
    {col_temp_magnet, "temp_magnet_C", &Log::temp_magnet_C},
    {col_torque, "torque_Nm", &Log::torque_Nm},
    {col_torque_cmd, "torque_cmd_Nm", &Log::torque_cmd_Nm},
}};

constexpr bool in_order()
{
    for (std::size_t k = 0; k < column_count; ++k)
        if (columns[k].id != k) return false;
    return true;
}
static_assert(in_order(), "Column indexes the table");

const char* name_of(Regime regime)
{
    switch (regime) {
    case Regime::dynamic: return "dynamic";
    case Regime::steady: return "steady";
    case Regime::standstill: return "standstill";
    case Regime::polled: return "polled";
    case Regime::mechanical: break;
    }
    return "mechanical";
}

std::optional<Regime> regime_named(std::string_view name)
{
    for (const Regime r : {Regime::dynamic, Regime::steady, Regime::standstill, Regime::mechanical, Regime::polled})
        if (name == name_of(r)) return r;
    return {};
}

std::optional<Column> column_named(std::string_view name)
{
    for (std::size_t i = 0; i < column_count; ++i)
        if (name == columns[i].name) return static_cast<Column>(i);
    return {};
}

std::optional<Regime> regime_of_columns(const ColumnSet& has)
{
    const bool torque = has[col_torque] || has[col_torque_cmd] || has[col_i_q];
    if (!has[col_v_d] && !has[col_v_q])
        return has[col_t] && has[col_w_m] && torque ? std::optional(Regime::mechanical) : std::nullopt;
    if (!has[col_w_m]) return Regime::standstill;
    // Half a log: means of one axis still tell something.
    if (has[col_t] && has[col_v_q] && has[col_i_q] && !(has[col_v_d] && has[col_i_d])) return Regime::polled;
    return {};
}

std::vector<std::string> missing_columns(Regime regime, const ColumnSet& has, bool torque_constant_known)
{
    std::vector<std::string> missing;
    const auto need = [&](Column c) {
        if (!has[c]) missing.push_back(columns[c].name);
    };
    const bool electrical = regime != Regime::mechanical;
    if (regime == Regime::dynamic || regime == Regime::polled || !electrical) need(col_t);
    if (regime == Regime::polled)
        for (const Column c : {col_v_q, col_i_q}) need(c);
    else if (electrical)
        for (const Column c : {col_v_d, col_v_q, col_i_d, col_i_q}) need(c);
    if (regime != Regime::standstill) need(col_w_m);
    if (!electrical && !has[col_torque] && !has[col_torque_cmd]) {
        if (!has[col_i_q])
            missing.push_back("torque_Nm (or i_q_A with a torque constant, or torque_cmd_Nm)");
        else if (!torque_constant_known)
            missing.push_back("torque_Nm (or torque_constant_Nm_A under [machine] for i_q_A, or torque_cmd_Nm)");
    }
    return missing;
}

ColumnSet columns_of_plain_model(Regime regime)
{
    ColumnSet use = {};
    use[col_t] = use[col_w_m] = use[col_i_q] = true;
    if (regime == Regime::mechanical)
        use[col_torque] = use[col_torque_cmd] = true;
    else
        use[col_v_d] = use[col_v_q] = use[col_i_d] = true;
    if (regime == Regime::steady) use[col_torque] = true;  // what turns an open circuit
    use[col_v_dc] = regime == Regime::polled;
    return use;
}

}  // namespace dqw
