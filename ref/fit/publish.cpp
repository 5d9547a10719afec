#include "ref/fit/publish.hpp"

#include <algorithm>
#include <cmath>

#include "ref/fit/explain.hpp"

namespace dqw {

bool Task::asks(const std::string& name) const { return std::find(asked.begin(), asked.end(), name) != asked.end(); }

void withhold(Task& task, const std::string& name, const std::string& why, const std::string& would_help,
              Result& result)
{
    if (!task.asks(name)) return;
    result.not_identifiable.push_back({name, why, would_help});
    task.asked.erase(std::remove(task.asked.begin(), task.asked.end(), name), task.asked.end());
}

void withhold_product(Task& task, const std::string& name, double product, double sd, Result& result)
{
    const std::string unit = name == "psi_Wb" ? " Wb" : " H";
    withhold(task, name,
             "the pole pairs are not known, and of " + name + " only the product pole_pairs * " + name + " = " +
                 figure(product) + unit + " (standard deviation " + figure(sd) + ")",
             "give the pole pairs; or " + excitation_for("pole_pairs", Regime::dynamic), result);
}

void publish(const Task& task, const std::vector<std::string>& names, const Covariance& covariance, Result& result)
{
    for (std::size_t j = 0; j < names.size(); ++j) {
        if (names[j].empty() || names[j] == "pole_pairs" || !task.asks(names[j])) continue;
        const Assessment& a = covariance.each[j];
        if (a.verdict == Verdict::determined)
            result.parameters.push_back({names[j], a.value, a.sd, false});
        else
            result.not_identifiable.push_back(explain(names[j], a, names, task.logs));
    }
}

void note_robust(const Covariance& covariance, Result& result)
{
    if (covariance.robust)
        result.notes.push_back(
            "the residual is correlated in time: standard deviations are from the scatter of blocks, up to " +
            figure(covariance.inflation) + " times those of white noise");
}

}  // namespace dqw
