// Which effects a log needs, one after the other: screen, refit jointly, judge on rows held out.
#ifndef DQW_REF_SEARCH_SELECT_HPP
#define DQW_REF_SEARCH_SELECT_HPP

#include <functional>
#include <limits>

#include "ref/search/solve.hpp"

namespace dqw {

/// Gains at which candidates are screened: each from 0.001 to 1 is within a factor of three of one, and a pass of
/// refine() moves a gain by up to five.
constexpr double kScreenGains[] = {0.003, 0.02, 0.1, 0.4};

/// An effect, or two that only make sense together, in one shape of several that are tried.
struct Candidate {
    std::vector<Input> inputs;
    double also_from = 0.0;  ///< of its first weight, another valley of the fit; 0: there is none
    /// Names of its effects, each once.
    std::vector<std::string> names() const;
    /// A fault of the record, no effect.
    bool is_fault() const { return inputs.front().law == Law::clipped_current; }
};

/// The point without an effect's terms.
Point without(Point at, const std::string& name);

/// How a candidate did when it was tried.
struct Tried {
    std::string name;
    Candidate candidate;
    Refined refined;
    Better over;                ///< the point without it
    double to_law_noise = 0.0;  ///< nats of it that the noise of the columns in its own law took

    double nats() const { return over.nats + to_law_noise; }
};

/// Every entry below its limit; false where there are no limits.
inline bool below(const std::vector<double>& rms, const std::vector<double>& limits)
{
    for (std::size_t c = 0; c < limits.size(); ++c)
        if (!(rms[c] < limits[c])) return false;
    return !limits.empty();
}

/// Of all channels together.
inline double joint(const std::vector<double>& rms)
{
    double square = 0.0;
    for (double r : rms) square += r * r / static_cast<double>(rms.size());
    return std::sqrt(square);
}

struct SelectOptions {
    /// Whether a point's parameters make physical sense; else the reason.
    std::function<std::string(const Point&)> veto;
    /// RMS of the reported held-out residual of a point, of each channel.
    std::function<std::vector<double>(const Point&)> reported_rms;
    /// The same of all channels together, or, where that is beyond `most`, anything that is.
    std::function<double(const Point&, double most)> reported_rms_to;
    /// Of each axis: below all of them what is left is the sampling's, and nothing is sought.
    std::vector<double> own;
    /// of settled points: what turns with the speed cannot be told apart there but by small terms
    bool one_speed = false;
    /// The same point with the choices settled that an effect just taken leaves open; absent: none are.
    std::function<Refined(Refined)> settle;
    /// a point's saturation, or none, as a flux map fitted in its place; not ok where there is nothing left to explain
    std::function<Refined(const Point&)> mapped;
    /// Whether the second point leaves next to nothing above the log's noise where the first leaves what is more than
    /// noise; absent: never.
    std::function<bool(const Point&, const Point&)> completes;
    /// Nats on the rows held out that a point's effects lose to noise of the columns in their own laws; absent: none.
    std::function<double(const Refined&)> to_law_noise;
    /// Whether an effect of a point is as small as what each drive's sampling leaves; absent: none is.
    std::function<bool(const Point&, const std::string&)> may_be_sampling;
    /// How the legs may pulse within a period, where that may be part of what a point leaves; absent: they do not.
    std::function<std::vector<Input>(const Point&)> pulses;
    std::function<void()> tick;
};

/// Another effect in the place of one that was found.
struct Rival {
    std::string name;
    Better over;  ///< how much better the one found is
};

struct Found {
    std::string name;  ///< of one effect
    std::vector<std::string> confusable_with;
    int round = 0;                   ///< effects of one round came together
    Better over = {};                ///< what is left without it in the place of it
    std::vector<Rival> rivals = {};  ///< those that make physical sense, by look_alikes()
    Eigen::VectorXd moved = {};      ///< by how much a column is another at most, with one that it may be instead
};

struct Selection {
    Refined plain, best;
    std::vector<Found> found;  ///< in the order found
    std::string fault;         ///< of the record, found beside or instead of an effect; else empty
    std::vector<Point> after;  ///< the point after each of them
    /// every candidate on the plain model: what each would explain alone
    std::vector<std::pair<std::string, Point>> alone;
    /// of those that were fitted, by how much on the rows held out
    std::vector<std::pair<std::string, Better>> fitted;
    std::vector<std::pair<std::string, std::string>> vetoed;  ///< name and reason
    Eigen::VectorXd unproven;                                 ///< (E198), of the columns; empty: none was tried
    /// The point to which the last effect came, and what was tried there with it; empty where that is not the last word.
    Refined before_last;
    std::vector<Tried> beside_last;
};

/// What could stand in for each effect found: rivals that, in its place, leave as little on the rows held out (within
/// 10 % of the reported RMS; of one speed alone 40 %), and that a joint fit cannot tell from it. At most three each.
/// Fills in `over`, `rivals` and `moved` too. One of several that another is clearly better than, beside the rest, goes
/// for that, where the search `exchanges`: true, and the lists are to be made anew.
bool look_alikes(const Model& model, const std::vector<Candidate>& candidates, const SelectOptions& options,
                 bool exchanges, Selection& selection);

/// The best fit of several gains, each of so many passes: a wrong model wants a large one, a right one a small one, and
/// each has its own valley.
Refined refine_gains(const Model& model, const Point& start, int passes);

Selection select(const Model& model, const Point& start, const std::vector<Candidate>& candidates,
                 const SelectOptions& options);

}  // namespace dqw
#endif
