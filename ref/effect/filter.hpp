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

/// The product, of finite factors: what std::complex makes of infinities takes as long again.
inline std::complex<double> times(std::complex<double> a, std::complex<double> b)
{
    return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

/// A real matrix of the plane: `z` times of + mirrored z*.
struct Plane {
    std::complex<double> of, mirrored;

    std::complex<double> operator()(std::complex<double> z) const
    {
        return times(of, z) + times(mirrored, std::conj(z));
    }
};

/// What a filter tells of a machine's currents, all seen from the rotor, once its beginning is forgotten:
/// `y = M i + N v + c`, v held as it stands in the stator.
struct Filtered {
    Plane of_i, of_v;
    std::complex<double> constant;

    /// `psi`: the flux without currents; `L_dq`: of each axis by the other's current.
    Filtered(double R, double Ld, double Lq, double L_dq, std::complex<double> psi, double w_e, double tau_s);
    /// The true currents that leave `told` of y.
    std::complex<double> current(std::complex<double> told) const;
    /// What jumps of the voltage have not brought through, but for the filter's decay. `jumps`: their sum, seen from the
    /// rotor of now; `mirrored`: that of each one's mirror image, turned back by twice what the rotor has turned since.
    std::complex<double> missing(std::complex<double> jumps, std::complex<double> mirrored) const;
};

}  // namespace dqw
#endif
