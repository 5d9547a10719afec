// The pole pairs of a dynamic log: a real number in the fit, a whole one in the machine.
#ifndef DQW_REF_FIT_POLE_PAIRS_HPP
#define DQW_REF_FIT_POLE_PAIRS_HPP

#include "ref/fit/publish.hpp"

namespace dqw {

struct PolePairs {
    bool sought = false;  ///< not given, and the machine turns
    bool clear = false;   ///< one whole number stands out
    double whole = 1.0;   ///< that number
    Assessment real;      ///< as fitted
};

/// A whole number stands out where the real one is nearer to it than 0.3, and the next is four standard deviations
/// away.
PolePairs decide_pole_pairs(const Assessment& real);

/// Given, estimated, or not identifiable, into `result`. Where they are in doubt by more than a tenth, psi_Wb is
/// withheld from task.asked, and with L_d and L_q where no whole number is within four deviations: `product` and
/// `product_sd` are those of pole_pairs * psi_Wb.
void report_pole_pairs(Task& task, const PolePairs& p, double product, double product_sd, Result& result);

}  // namespace dqw
#endif
