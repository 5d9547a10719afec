// Logs whose effects a seed draws, and the judge of a tracer that is not told what they are.
#ifndef DQW_BENCH_BLIND_HPP
#define DQW_BENCH_BLIND_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "ref/log/log.hpp"
#include "ref/log/residual.hpp"
#include "ref/trace/trace.hpp"

namespace blind {

enum class Kind { clean, one, two, outside };
const char* name_of(Kind kind);
Kind kind_of(std::uint64_t seed);
/// Every other twenty seeds have the inverter at its switches, where the log is dynamic.
bool switches(std::uint64_t seed);

/// An effect that is in a log, or a fault outside the catalogue.
struct Drawn {
    std::string name;
    double size = 0.0;  ///< in the law's own unit
    /// block residual over the noise floor that it alone would leave, after the plain model's best fit
    double strength = 1.0;
    /// other effects that the log cannot tell from it, and those that it hardly can; see blind_class.hpp
    std::vector<std::string> same = {}, close = {};
};

struct Case {
    std::uint64_t seed = 0;
    Kind kind = Kind::clean;
    std::vector<Drawn> drawn;  ///< true effects; Kind::outside: the fault
    dqw::Log log;
    dqw::PlainModel truth;
    double noise_floor = 0.0;  ///< RMS residual of the true plain model on the same log without effects, V or Nm
    bool switching = false;    ///< the inverter at its switches
    std::string about;         ///< machine, profile, noise, rows, in one line

    /// Of the weakest thing drawn; 0 for a clean log.
    double strength() const;
};

/// Whether `same` and `close` are worked out, which a judge asks for and which takes most of a draw's time.
enum class Judged { yes, no };

/// The log of a seed. Of 20 seeds in a row 4 are clean, 9 have one effect, 4 two, 3 a fault from outside. Cost: some ten
/// seconds, without classes about one.
Case draw(std::uint64_t seed, Judged judged = Judged::yes);

/// A base parameter after tracing beside the truth.
struct Off {
    std::string name;
    double percent = 0.0;
    double sd_percent = 0.0;
    bool usable = false;
};

struct Outcome {
    std::uint64_t seed = 0;
    Kind kind = Kind::clean;
    double strength = 0.0;
    bool switching = false;
    std::string about, verdict;
    std::vector<std::string> truth, named;
    std::vector<std::vector<std::string>> confusable;   ///< of each named one
    std::vector<double> confidence;                     ///< of each named one; NaN: not stated
    std::vector<std::vector<std::string>> same, close;  ///< of each true one, see Drawn
    std::vector<Off> off;                               ///< R, L and psi, those that were found
    double seconds = 0.0;
    std::string failure;  ///< what trace() threw; empty where it returned

    /// Each true effect is named or confusable with a named one, and each named one is true or confusable with a true
    /// one.
    bool right() const;
    /// right(), and what the log cannot tell from a true one is listed, at most three, and nothing that it can tell.
    bool exact() const;
    /// Of named effect n: it is true, or a look-alike of a true one that is not named itself.
    bool holds_name(std::size_t n) const;
    /// R, L within 2 %, psi within 0.5 %.
    bool base_right() const;
};

Outcome score(const Case& one, const dqw::TraceResult& result, double seconds);

/// draw(), trace(), score(). An exception of trace() is the outcome's failure.
Outcome run(std::uint64_t seed);

/// One line, and back: how the parallel runs hand over their outcomes.
std::string line_of(const Outcome& outcome);
Outcome outcome_of(const std::string& line);

/// Confusion table, rates, and a line for each failed log with the command that repeats it.
std::string report(const std::vector<Outcome>& outcomes);

}  // namespace blind
#endif
