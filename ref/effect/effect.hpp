// The catalogue: physical effects that the plain model lacks. Plain data: no Ceres, no file format.
#ifndef DQW_REF_EFFECT_EFFECT_HPP
#define DQW_REF_EFFECT_EFFECT_HPP

#include <string>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// One physical parameter of an effect and the range outside which it is not believed.
struct EffectParameter {
    const char* name;  ///< with its SI suffix
    double least, most;
};

/// What is known of an effect before a log is seen. The law is (E50) to (E55) in docs/EQUATIONS.md.
struct Effect {
    const char* name;
    const char* law;       ///< one line, for people
    const char* separate;  ///< the experiment that tells it from its look-alikes
    bool mechanical;       ///< of a mechanical log; else of an electrical one
    bool needs_angle;      ///< theta_e_rad (theta_m_rad), or an integrable speed
    std::vector<EffectParameter> parameters;
};

/// Every effect, electrical ones first, and of each kind the more common first.
const std::vector<Effect>& effects();

/// Its place among effects(); theirs is before that of a name that the catalogue lacks.
std::size_t order_of(const std::string& name);

/// nullptr where there is none of this name.
const Effect* find_effect(const std::string& name);

}  // namespace dqw
#endif
