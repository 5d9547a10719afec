// How well a solution determines each parameter.
#ifndef DQW_REF_FIT_ASSESS_HPP
#define DQW_REF_FIT_ASSESS_HPP

#include "ref/fit/solve.hpp"

namespace dqw {

/// Limits of a verdict.
namespace assessing {
constexpr double kUncertain = 0.3;   ///< sd over value: beyond, within 3.3 of them a value may be zero
constexpr double kNoEffect = 1e-6;   ///< of the largest signal: what 20 bits do not show
constexpr double kCollinear = 1e-8;  ///< eigenvalue of the information of unit columns: alike to 1e-4 of each
constexpr double kPartner = 0.03;    ///< component in such a direction that counts: a thousandth of its square
}  // namespace assessing

enum class Verdict {
    determined,
    no_effect,  ///< changes nothing in what is predicted
    collinear,  ///< acts only together with its partners
    uncertain   ///< standard deviation above three tenths of the value
};

struct Assessment {
    Verdict verdict = Verdict::determined;
    double value = 0.0, sd = 0.0;
    std::vector<int> partners;  ///< of a collinear one: indices of theta
};

/// Covariance of the free entries of theta and a verdict on each.
struct Covariance {
    Eigen::MatrixXd of;            ///< n x n; zero for what is not determined
    std::vector<Assessment> each;  ///< one for each entry of theta
    bool robust = false;           ///< blocks say the innovations are correlated: their scores' scatter is used
    double inflation = 1.0;        ///< largest sd over that of white innovations
};

/// (E42). White innovations: cov = M^-1 W M^-1, M = sum_c J_c'J_c / sigma_c^2, W = sum_c noise_c^2 J_c'J_c / sigma_c^4.
/// Where the scores of the blocks scatter significantly more than
/// white innovations' would (some parameter's variance above 1 + 3.5 sqrt(2 / blocks) times): M^-1 (sum s_b s_b') M^-1.
/// `typical[j]` is a size of theta[j] that would matter: an entry whose effect at max(|theta|, typical) is below 1e-6
/// of the signal has no effect; an sd is judged against max(|theta|, 0.1 typical).
Covariance assess(const Solution& solution, const Regression& model, const Eigen::VectorXd& typical);

/// assess() of a model with gains. Noise that the gains let into the state looks like excitation, and so does a start
/// that is off and settles: a parameter counts as determined only if the simulation alone (gains 0, starts left out)
/// determines it too. Costs a sweep.
Covariance assess_excited(const Solution& solution, Regression& model, const Eigen::VectorXd& typical);

}  // namespace dqw
#endif
