#include "app/base/parameters.hpp"

#include <algorithm>
#include <iterator>

namespace dqw {
namespace {

const Parameter* parameter_named(const std::string& name)
{
    const auto found = std::find_if(std::begin(kParameters), std::end(kParameters),
                                    [&](const Parameter& p) { return name == p.name; });
    return found == std::end(kParameters) ? nullptr : found;
}

}  // namespace

const std::vector<std::string>& known_parameters()
{
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const Parameter& p : kParameters) all.emplace_back(p.name);
        return all;
    }();
    return names;
}

std::string symbol(const std::string& parameter)
{
    const Parameter* p = parameter_named(parameter);
    return p ? p->symbol : parameter;
}

std::optional<double> nominal_of(const Machine& machine, const std::string& parameter)
{
    const Parameter* p = parameter_named(parameter);
    return p ? machine.*(p->nominal) : std::nullopt;
}

const Estimate* find_estimate(const std::vector<Estimate>& estimates, const std::string& name)
{
    const auto found = std::find_if(estimates.begin(), estimates.end(),
                                    [&](const Estimate& e) { return e.name == name; });
    return found == estimates.end() ? nullptr : &*found;
}

}  // namespace dqw
