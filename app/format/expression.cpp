#include "app/format/expression.hpp"

#include <fmt/format.h>

#include <cmath>

namespace dqw {
namespace {

const double root_3 = std::sqrt(3.0);

std::string texts(const std::vector<Expression>& parts)
{
    std::string out;
    for (const Expression& part : parts) out += (out.empty() ? "" : ", ") + part.text;
    return out;
}

}  // namespace

Expression field_expression(std::size_t field, const std::string& name)
{
    Expression x;
    x.fields = {field};
    x.text = name;
    return x;
}

Expression constant(double value)
{
    Expression x;
    x.offset = value;
    x.text = fmt::format("{:g}", value);
    return x;
}

Expression scaled(Expression x, double factor, const std::string& text, double offset)
{
    if (x.linear()) {
        x.scale *= factor;
        x.offset = x.offset * factor + offset;
    } else {
        x.of = [of = x.of, factor, offset](const double* values) { return of(values) * factor + offset; };
    }
    x.text += text;
    return x;
}

Expression combined(const std::vector<Expression>& parts, const Expression::Function& of, const std::string& text)
{
    Expression x;
    for (const Expression& part : parts) x.fields.insert(x.fields.end(), part.fields.begin(), part.fields.end());
    x.of = [parts, of](const double* values) {
        constexpr std::size_t most = 8;
        double results[most] = {};
        for (std::size_t k = 0; k < parts.size() && k < most; ++k) {
            results[k] = parts[k](values);
            values += parts[k].fields.size();
        }
        return of(results);
    };
    x.text = text;
    return x;
}

TwoAxes clarke_of_phases(const std::vector<Expression>& phases)
{
    const std::string of = "(" + texts(phases) + ")";
    if (phases.size() == 2)
        return {combined(
                    phases, [](const double* i) { return i[0]; }, "α" + of),
                combined(
                    phases, [](const double* i) { return (i[0] + 2 * i[1]) / root_3; }, "β" + of)};
    return {combined(
                phases, [](const double* i) { return (2 * i[0] - i[1] - i[2]) / 3; }, "α" + of),
            combined(
                phases, [](const double* i) { return (i[1] - i[2]) / root_3; }, "β" + of)};
}

TwoAxes clarke_of_lines(const std::vector<Expression>& lines)
{
    const std::string of = "(lines " + texts(lines) + ")";
    return {combined(
                lines, [](const double* v) { return (2 * v[0] + v[1]) / 3; }, "α" + of),
            combined(
                lines, [](const double* v) { return v[1] / root_3; }, "β" + of)};
}

TwoAxes park(const TwoAxes& stationary, const Expression& theta_e)
{
    const std::vector<Expression> parts = {stationary.first, stationary.second, theta_e};
    // α(ia, ib, ic) and β(ia, ib, ic) are of the same phases: those are named once.
    std::string phases = stationary.first.text;
    if (phases.compare(0, 2, "α") == 0) phases.erase(0, 2);
    return {combined(
                parts, [](const double* x) { return x[0] * std::cos(x[2]) + x[1] * std::sin(x[2]); },
                "Park d of " + phases + " at " + theta_e.text),
            combined(
                parts, [](const double* x) { return x[1] * std::cos(x[2]) - x[0] * std::sin(x[2]); },
                "Park q of " + phases + " at " + theta_e.text)};
}

Expression voltage_of_duty(const Expression& duty, const Expression& v_dc, const Expression* v_d)
{
    if (!v_d)
        return combined(
            {duty, v_dc}, [](const double* x) { return x[0] * x[1] / root_3; },
            "|v| = " + duty.text + " · " + v_dc.text + "/√3");
    return combined(
        {duty, v_dc, *v_d},
        [](const double* x) {
            const double v = x[0] * x[1] / root_3;
            return std::copysign(std::sqrt(std::fmax(v * v - x[2] * x[2], 0.0)), v);
        },
        "what " + duty.text + " · " + v_dc.text + "/√3 leaves beside v_d");
}

}  // namespace dqw
