// When a trace names effects, and what it calls the rest: rules of numbers alone.
#ifndef DQW_REF_TRACE_RULES_HPP
#define DQW_REF_TRACE_RULES_HPP

#include <cstddef>
#include <string>

namespace dqw {

/// Block RMS over the noise floor that is more than noise: of some fifty blocks the RMS of noise alone is within a
/// tenth.
constexpr double kStructured = 1.3;

/// A normal exceeds it, either way, in 3 of 1000 cases.
constexpr double kClearlyT = 3.0;

/// RMS of the reported residual on rows that no fit saw, and the noise that the log itself shows; V or Nm.
struct Finding {
    double before = 0.0, after = 0.0, floor = 0.0;
    bool before_exact = false, after_exact = false;  ///< each axis within the sampling's own error
    bool fault = false;                              ///< a fault of the record: clipped, held, a line in its spectrum
};

/// Are the effects that the search took to be named? Not where a fault may have caused it, where there was nothing to
/// explain, where the residual grew, or where most of what is above the noise stays.
bool explains(const Finding& f);

/// Part of what is above the noise that is gone; below 0 where there is more.
double share_of(double before, double after, double floor);

/// The same for a name's confidence: where the plain model leaves less than single rows' noise, which a filter makes,
/// nothing is left above it, and all is explained.
double part_of_rest(double before, double after, double floor);

/// Does an effect take nearly all that is above the noise, where that is more than noise?
bool completes(double before, double after, double floor);

/// Is one effect of several to be named? `all`: with every one of them; `with`, `without`: what is left with it, and
/// once the others are fitted alone. Not where it takes less than what stays above the noise: what has no name is then
/// larger, and an effect that it resembles stands in for it.
bool carries(const Finding& all, double with, double without);

/// Is an effect to be named whose parameters are told from nothing but for what the model's own error may hide? `f`: of
/// the plain model and of all effects; `without`: of all others. Where it takes most of what the plain model leaves
/// above the noise, it is not nothing: a deviation that says so takes what is left for what it may hide, and without
/// the effect more is left. `told`: its value in its deviations; below a half the sign is wrong in three of ten cases.
bool carries_most(const Finding& f, double without, double told);

/// The same of one that takes all that the others leave, which is clearly more than noise, and leaves noise; whatever
/// its deviation.
bool carries_all(const Finding& f, double without);

/// Is one effect of several needed by nothing? `without`: what is left once the others are fitted alone; `alike`: how
/// many the log does not tell it from.
bool is_idle(double without, double floor, std::size_t alike);

/// Is another reading of the record, under which the plain model leaves `read`, to stand in the place of effects that
/// explain? One that has no weight and leaves as little as two do; or clearly less than what effects leave above the
/// noise.
bool reads_better(const Finding& f, double read, std::size_t effects);

/// How many of the effects found a reading is held against; `shifted`: one of them is of another instant. Rows or a frame
/// that are not of one instant have a name, which stands where it leaves noise alone; two rows or more between voltage
/// and current are the record's, and no drive's.
std::size_t against_reading(std::size_t found, bool shifted, int rows_before);

/// Does a voltage held in the rotor's frame stand before one held in the stator's? `t`: by how much it predicts better;
/// `here`, `there`: effects that the stator's and the rotor's need; `noise`: what the stator's leaves is noise. An
/// effect more is then what the other frame lacks.
bool turns_with_rotor(double t, std::size_t here, std::size_t there, bool noise);

/// What is left, with the effects that are named or without any.
struct Rest {
    Finding is;
    bool effects = false;     ///< some are named
    bool taken_back = false;  ///< some were found, or made no physical sense, and none is named
};

/// Does the residual hold something that has no name?
bool is_structured(const Rest& rest);

/// clean, explained, partly_explained or unexplained.
std::string verdict_of(bool effects, bool structured, bool doubt);

}  // namespace dqw
#endif
