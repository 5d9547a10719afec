// What a log can tell, before anybody looks: the effects that would leave the same voltages as the true one.
#ifndef DQW_BENCH_BLIND_CLASS_HPP
#define DQW_BENCH_BLIND_CLASS_HPP

#include "blind.hpp"
#include "blind_setup.hpp"

namespace blind {

/// Fills `same` and `close` of each drawn effect, from the drive without an inverter's switches. Linear in the sizes;
/// sensors' noise as the drawn log has it, row by row. Cost: about thirty simulations.
void find_classes(const Setup& setup, std::vector<Drawn>& drawn);

}  // namespace blind
#endif
