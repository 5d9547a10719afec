// A number out of the fields of one row, with the text that says how.
#ifndef DQW_APP_FORMAT_EXPRESSION_HPP
#define DQW_APP_FORMAT_EXPRESSION_HPP

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace dqw {

/// Either linear in one field, `scale` times it plus `offset` (no field: `offset` alone), or any function of several.
struct Expression {
    using Function = std::function<double(const double* values)>;

    std::vector<std::size_t> fields;  ///< of the row, in the order that `of` takes them
    Function of;                      ///< empty: linear
    double scale = 1.0, offset = 0.0;
    std::string text;  ///< for people: `erpm · 2π/60/7`

    bool linear() const { return !of; }
    double operator()(const double* values) const
    {
        if (of) return of(values);
        return fields.empty() ? offset : values[0] * scale + offset;
    }
};

Expression field_expression(std::size_t field, const std::string& name);
Expression constant(double value);

/// `x` times `factor` plus `offset`; `text` is what people read behind x's own.
Expression scaled(Expression x, double factor, const std::string& text, double offset = 0.0);

/// `of` takes the values of `parts`, in their order.
Expression combined(const std::vector<Expression>& parts, const Expression::Function& of, const std::string& text);

/// Two axes of a frame: α and β, or d and q.
struct TwoAxes {
    Expression first, second;
};

/// (E130): α, β of two or three phase quantities; the third of two is minus their sum.
TwoAxes clarke_of_phases(const std::vector<Expression>& phases);
/// (E130): α, β of the voltages a to b and b to c, and c to a where there is a third, which is not needed.
TwoAxes clarke_of_lines(const std::vector<Expression>& lines);
/// (E131): d, q of α, β and the electrical angle in rad.
TwoAxes park(const TwoAxes& stationary, const Expression& theta_e);
/// (E132): the q voltage that duty and link leave beside v_d, of the duty's sign; without v_d the vector's length.
Expression voltage_of_duty(const Expression& duty, const Expression& v_dc, const Expression* v_d);

}  // namespace dqw
#endif
