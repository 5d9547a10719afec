// Currents behind a first-order filter: the true ones from those that it tells. (E117)
#ifndef DQW_REF_EFFECT_FILTER_HPP
#define DQW_REF_EFFECT_FILTER_HPP

#include <cmath>
#include <complex>

namespace dqw {

/// e^-x. Of a filter much faster than a period nothing is left, which exp() takes long to find.
inline double left_after(double x)
{
    constexpr double kNone = 746.0;  // a double's least is e^-745.1
    return x > kNone ? 0.0 : std::exp(-x);
}

/// A real matrix of the plane: `z` times of + mirrored z*.
struct Plane {
    std::complex<double> of, mirrored;

    std::complex<double> operator()(std::complex<double> z) const { return of * z + mirrored * std::conj(z); }
};

/// What a filter tells of a machine's currents, all seen from the rotor, once its beginning is forgotten:
/// `y = M i + N v + c`, v held as it stands in the stator.
struct Filtered {
    Plane of_i, of_v;
    std::complex<double> constant;

    Filtered(double R, double Ld, double Lq, double psi, double w_e, double tau_s);
    /// The true currents that leave `told` of y.
    std::complex<double> current(std::complex<double> told) const;
    /// What a jump of the voltage, seen from the rotor of now, has not brought through, but for the filter's decay, when
    /// the rotor has turned by an angle; `back`: twice that angle the other way, of length 1.
    std::complex<double> missing(std::complex<double> jump, std::complex<double> back) const;
};

}  // namespace dqw
#endif
