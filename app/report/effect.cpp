#include "app/report/effect.hpp"

#include "app/base/quantity.hpp"

namespace dqw {

using Json = nlohmann::ordered_json;

Json effects_json(const std::vector<TraceEffect>& effects)
{
    Json json = Json::array();
    for (const TraceEffect& effect : effects) {
        Json parameters = Json::object();
        for (const Estimate& e : effect.parameters) {
            Json entry = {{"value", e.value}};
            if (e.given)
                entry["given"] = true;
            else
                entry["sd"] = e.sd;
            parameters[e.name] = entry;
        }
        json.push_back({{"name", effect.name}, {"parameters", parameters}});
    }
    return json;
}

std::string effects_text(const std::vector<TraceEffect>& effects)
{
    if (effects.empty()) return "";
    std::vector<std::vector<std::string>> rows = {{"effect", "parameter", "value", "sd", "unit"}};
    for (const TraceEffect& effect : effects)
        for (const Estimate& e : effect.parameters) {
            const Quantity q = quantity(e.name, e.value, e.given ? 0.0 : e.sd);
            rows.push_back({&e == &effect.parameters.front() ? effect.name : "", e.name, q.value,
                            e.given ? "given" : q.sd, q.unit});
        }
    return "\n" + table(rows);
}

}  // namespace dqw
