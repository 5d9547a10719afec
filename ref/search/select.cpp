#include "ref/search/select.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "ref/fit/explain.hpp"
#include "ref/model/plan.hpp"
#include "ref/model/replanned.hpp"

namespace dqw {
namespace {

/// A normal exceeds 3 in one of 700 cases: of some five rivals of each effect, one of a hundred logs calls one told.
constexpr double kSeparateT = 3.0;
/// Nats were each block one row, below which a rival is as good: of two laws that hardly differ, what either of them
/// leaves of the sampling's own error decides by tens of nats, alike in all blocks.
constexpr double kSeparateNats = 1.0;
/// Part of the nats given back for noise in laws by which they may be off: with 1.8 % of noise on all columns a log's
/// true eddies lack a third more than they are given. (E167)
constexpr double kLawNoiseOff = 0.5;
/// As many as what few blocks gain must have where they do not lie together.
constexpr double kCompleteNats = 40.0;
constexpr double kClose = 1.1;         ///< of the reported RMS, that of another that leaves as little
constexpr std::size_t kMostAlike = 3;  ///< in a report: more help nobody
/// Effects that a round fits, of those that did best as a linear step, and passes of a fit: more cost time, (E48).
constexpr std::size_t kRefined = 5;
constexpr int kPasses = 12;

std::vector<Eigen::Index> with_columns(const Point& at, Eigen::Index first, int count)
{
    std::vector<Eigen::Index> use;
    for (Eigen::Index j = 0; j < at.columns(); ++j) use.push_back(j);
    for (int j = 0; j < count; ++j) use.push_back(first + j);
    return use;
}

Point joined(Point at, const Candidate& c, const Eigen::VectorXd* weights)
{
    Eigen::Index j = 0;
    for (const Input& input : c.inputs) {
        Term term{input, {}};
        for (int w = 0; w < weights_of(input.law); ++w, ++j)
            if (weights) term.weights[static_cast<std::size_t>(w)] = (*weights)[j];
        at.terms.push_back(term);
    }
    return at;
}

int weights_of(const Candidate& c)
{
    int n = 0;
    for (const Input& input : c.inputs) n += weights_of(input.law);
    return n;
}

bool has(const Point& at, const std::string& name)
{
    return std::any_of(at.terms.begin(), at.terms.end(), [&](const Term& t) { return name == name_of(t.input.law); });
}

bool gives_back(const Candidate& c) { return c.inputs.front().law == Law::dead_given_back; }

bool is_between_pulses(const Point& at)
{
    return std::any_of(at.terms.begin(), at.terms.end(),
                       [](const Term& t) { return effect_of(t.input.law).shape == Shape::pulses; });
}

bool bends_iron(const std::string& name)
{
    return name == name_of(Law::saturation) || name == name_of(Law::cross_saturation);
}

bool has_any(const Point& at, const Candidate& c)
{
    return std::any_of(c.inputs.begin(), c.inputs.end(), [&](const Input& i) { return has(at, name_of(i.law)); });
}

/// The same, but a filter of the currents is no filter of the speed.
bool has_any_sensor(const Point& at, const Candidate& c)
{
    return std::any_of(c.inputs.begin(), c.inputs.end(), [&](const Input& i) {
        return std::any_of(at.terms.begin(), at.terms.end(), [&](const Term& t) {
            return std::string(name_of(i.law)) == name_of(t.input.law) &&
                   filters_currents(i) == filters_currents(t.input);
        });
    });
}

/// Whether the terms of a point stand in another as well, by the same laws.
bool are_alike(const Point& few, const Point& more)
{
    return std::equal(few.terms.begin(), few.terms.end(), more.terms.begin(), [](const Term& a, const Term& b) {
        return a.input.law == b.input.law && a.input.loss == b.input.loss && a.input.modulation == b.input.modulation;
    });
}

/// Whether that makes a difference to what may be tried there.
bool apart_by_sensor(const Point& at, const std::vector<Candidate>& candidates)
{
    return std::any_of(candidates.begin(), candidates.end(),
                       [&](const Candidate& c) { return has_any(at, c) != has_any_sensor(at, c); });
}

/// Confirmed, or all that the log had above its noise: what drifts gains in few blocks that lie together, which no t over
/// blocks calls more than chance.
bool told(const Model& model, const Better& gain, const Point& without, const Point& with, const SelectOptions& options)
{
    return confirmed(model, gain) ||
           (gain.nats >= kCompleteNats && options.completes && options.completes(without, with));
}

/// More than chance, and enough to name it: 5 % of one axis' reported residual, where that of both does not grow, or,
/// where that grows on none, of the predictions' errors (a part less of them is about that many nats a row). What a log
/// with a rest has many of are small gains that mean nothing. As (E48) has it.
bool needed(const Model& model, const Refined& without, const Refined& with, const SelectOptions& options)
{
    constexpr double kLeastPart = 0.05, kSame = 1.01;
    const Better gain = better(model, without.left, with.left);
    if (!told(model, gain, without.point, with.point, options)) return false;
    const std::vector<double> a = options.reported_rms(without.point), b = options.reported_rms(with.point);
    const bool more = joint(b) > kSame * joint(a);
    bool grows = false;
    for (std::size_t c = 0; c < a.size(); ++c) {
        if (!more && b[c] < (1.0 - kLeastPart) * a[c]) return true;
        grows = grows || b[c] > kSame * a[c];
    }
    double rows = 0.0;
    for (std::size_t k = 0; k < without.left.rows.size(); ++k)
        if (model.plan().blocks[k].heldout) rows += without.left.rows[k];
    return !grows && gain.nats > kLeastPart * rows;
}

struct Screened {
    double seen = -HUGE_VAL, rank = -HUGE_VAL, gain = 0.0;
    Eigen::VectorXd weights;
    Point point;  ///< the linear step's end
    const Candidate* candidate = nullptr;
};

/// Each candidate as a linear step from `at`, at the gain where it does best on the rows seen; what it takes is told at
/// `at`. They rank by the rows held out, with `whole` or where a sweep has met any of those, else by the rows seen less
/// what a weight of nothing takes of them and leaves of others (Akaike's).
std::vector<Screened> screen(const Model& model, const Point& at, const std::vector<const Candidate*>& candidates,
                             const SelectOptions& options, bool whole)
{
    std::vector<Screened> out(candidates.size());
    std::vector<Input> inputs;
    std::vector<std::vector<Input>> groups;
    std::vector<Eigen::Index> first;
    Eigen::Index column = at.columns();
    for (const Candidate* c : candidates) {
        first.push_back(column);
        groups.push_back(c->inputs);
        for (const Input& i : c->inputs) inputs.push_back(i);
        column += weights_of(*c);
    }
    std::vector<double> gains{0.0};
    std::vector<Point> points{at};
    for (double gain : kScreenGains) {
        if (model.gains() == 0) break;
        Point there = at;
        there.gain.setConstant(gain);
        // Within a factor of two of what is screened already.
        if (((there.gain - at.gain).cwiseAbs().array() < 0.5 * there.gain.cwiseMax(at.gain).array()).all()) continue;
        gains.push_back(gain), points.push_back(there);
    }
    if (options.tick) options.tick();
    const Replanned both(model, folded_plan());
    const std::vector<std::vector<BlockSum>> sums = model.sweep_gains(points, groups, whole);
    for (std::size_t p = 0; p < points.size(); ++p) {
        if (sums[p].empty()) continue;
        const Point& there = points[p];
        const bool has_heldout = sums[p].back().rows > 0.0;
        const Seen seen = seen_of(both, sums[p]);
        const Prior prior = prior_of(there, inputs);
        for (std::size_t c = 0; c < candidates.size(); ++c) {
            const int n = weights_of(*candidates[c]);
            std::vector<Eigen::Index> use = with_columns(at, first[c], n);
            // The gain stays: a step of it is far from linear.
            use.erase(use.begin() + at.base.size(), use.begin() + at.base.size() + at.gain.size());
            const Eigen::VectorXd delta = linear_step(model, seen, use, 0.0, prior);
            const Left left = left_after(both, sums[p], delta);
            if (left.seen <= out[c].seen) continue;
            Point end = there;
            end.set(there.values() + delta.head(at.columns()));
            const Eigen::VectorXd weights = delta.segment(first[c], n);
            const double rank = has_heldout ? left.heldout : left.seen - n;
            out[c] = {left.seen, rank, gains[p], weights, joined(end, *candidates[c], &weights), candidates[c]};
        }
    }
    return out;
}

/// Whether as much as the linear step gains, in each pass of a fit, would not come to `worth`. It tells little of a filter
/// and of pulses.
bool is_idle(const Refined& base, const Screened& s, double worth)
{
    const Shape shape = effect_of(s.candidate->inputs.front().law).shape;
    return shape != Shape::channel && shape != Shape::pulses &&
           base.left.seen + kPasses * (s.seen - base.left.seen) < worth;
}

/// `worth`: log-likelihood of the rows seen that it must come near to be of use. `idle`: it is swept, not fitted.
Tried attempt(const Model& model, const Refined& base, const Screened& s, double worth, bool idle)
{
    Tried t;
    t.candidate = *s.candidate;
    for (const std::string& name : t.candidate.names()) t.name += (t.name.empty() ? "" : " and ") + name;
    Point start = joined(base.point, t.candidate, &s.weights);
    if (s.gain > 0.0) start.gain.setConstant(s.gain);
    int passes = idle ? 1 : kPasses;
    Refined first = swept_seen(model, start);
    if (!first.ok || first.left.seen < base.left.seen) {
        // Where the linear step leads astray, the effect grows from nothing, in more passes.
        first = swept_seen(model, joined(base.point, t.candidate, nullptr));
        if (!idle) passes = 3 * kPasses;
    }
    t.refined = refine(model, std::move(first), passes, worth);
    if (t.candidate.also_from != 0.0) {
        start = joined(base.point, t.candidate, nullptr);
        start.terms.back().weights[0] = t.candidate.also_from;
        Refined other = refine(model, start, kPasses, worth);
        if (other.ok && (!t.refined.ok || other.left.seen > t.refined.left.seen)) t.refined = std::move(other);
    }
    if (t.refined.ok) t.over = better(model, base.left, t.refined.left);
    return t;
}

double law_noise(const SelectOptions& options, const Refined& r)
{
    return options.to_law_noise && r.ok ? options.to_law_noise(r) : 0.0;
}

/// Of those that leave about as little of the reported residual, in which single rows' noise hardly is, the innovations
/// decide without the noise that each law brings into them; best first.
void weigh_law_noise(const SelectOptions& options, std::vector<Tried>& tried)
{
    if (!options.to_law_noise) return;
    std::vector<double> rms(tried.size(), HUGE_VAL);
    double least = HUGE_VAL;
    for (std::size_t k = 0; k < tried.size(); ++k) {
        if (!tried[k].refined.ok) continue;
        rms[k] = options.reported_rms_to(tried[k].refined.point, kClose * least);
        least = std::min(least, rms[k]);
    }
    double best = -HUGE_VAL;
    for (std::size_t k = 0; k < tried.size(); ++k) {
        if (!(rms[k] <= kClose * least)) continue;
        tried[k].to_law_noise = options.to_law_noise(tried[k].refined);
        best = std::max(best, tried[k].nats());
    }
    // What leaves more stands before them without its own noise or not at all: filters, delays and shifts all take some.
    for (std::size_t k = 0; k < tried.size(); ++k)
        if (tried[k].refined.ok && !(rms[k] <= kClose * least) && tried[k].over.nats > best)
            tried[k].to_law_noise = options.to_law_noise(tried[k].refined);
    std::stable_sort(tried.begin(), tried.end(), [](const Tried& a, const Tried& b) {
        return a.refined.ok != b.refined.ok ? a.refined.ok : a.nats() > b.nats();
    });
}

/// Of inputs of one name those that are apart: which channel is late decides what gain is wanted, so that linear steps
/// do not tell which is right.
int apart(const Candidate& c)
{
    const Input& first = c.inputs.front();
    if (effect_of(first.law).shape == Shape::pulses) return -1;
    if (first.law == Law::dead_given_back) return 1;
    // Eddies that follow late average what noise the law's columns bring in.
    if (first.law == Law::iron_loss)
        return first.shape[0] < 0.0 ? 1 - static_cast<int>(first.shape[0]) : first.shape[0] > 0.0 ? 1 : 0;
    if (first.law == Law::turn_short) return first.shape[0] == kTurningAlone ? 1 : 0;
    return effect_of(first.law).shape == Shape::instant ? static_cast<int>(first.shape[0]) : 0;
}

/// The best, or one that is hardly worse and plainer, or as plain and the more common.
bool stands_before(const Tried& t, const Tried& best)
{
    // What confirms no effect speaks for no weight more; nor does one nat for another of as many. Halved or doubled,
    // either changes nothing on the logs named in confirmed().
    constexpr double kHardly = kLeastNats, kSame = 1.0;
    const double lost = best.nats() - t.nats();
    const int weights = weights_of(t.candidate) - weights_of(best.candidate);
    const Law law = t.candidate.inputs.front().law;
    if ((law == Law::iron_loss || law == Law::turn_short) && t.name == best.name)
        return apart(t.candidate) == 0 && lost < kHardly;
    return weights < 0 ? lost < kHardly
                       : weights == 0 && lost < kSame &&
                             stands_before(t.candidate.inputs.front().law, best.candidate.inputs.front().law);
}

/// The best of what a candidate leaves at the end of its linear step, and, where it has another start, after a few passes
/// from there.
double first_seen(const Model& model, const Refined& base, const Screened& s)
{
    constexpr int kFewPasses = 3;
    Point start = joined(base.point, *s.candidate, &s.weights);
    if (s.gain > 0.0) start.gain.setConstant(s.gain);
    const Refined there = swept_seen(model, start);
    double seen = there.ok ? there.left.seen : -HUGE_VAL;
    if (s.candidate->also_from != 0.0) {
        start = joined(base.point, *s.candidate, nullptr);
        start.terms.back().weights[0] = s.candidate->also_from;
        const Refined other = refine(model, start, kFewPasses);
        if (other.ok) seen = std::max(seen, other.left.seen);
    }
    return seen;
}

/// Those that would have been taken next: where what was taken predicts with another gain, a linear step from there may
/// see nothing of them, unlike sensors behind a dead time.
std::set<std::string> that_stand(const Model& model, const std::vector<Tried>& tried, const Tried& taken,
                                 const SelectOptions& options, const Refined& base)
{
    constexpr std::size_t kNext = 2;  // each costs a fit
    std::set<std::string> out;
    for (const Tried& t : tried) {
        if (out.size() == kNext) break;
        if (!t.refined.ok || t.candidate.names().size() > 1 || t.candidate.is_fault() || t.name == taken.name) continue;
        if (told(model, t.over, base.point, t.refined.point, options) && needed(model, base, t.refined, options))
            out.insert(t.name);
    }
    return out;
}

/// Of currents told between pulses, the modulation that does best once a step is taken: the linear ones are alike, and
/// which of them leads is a matter of rounding. They say nothing of a shift by half a period.
const Screened& by_legs(const Model& model, const Refined& base, const std::vector<Screened>& screened,
                        const Screened& s)
{
    const Input& input = s.candidate->inputs.front();
    if (effect_of(input.law).shape != Shape::pulses || input.free_angle) return s;
    constexpr double kAlike = 1.0;  // nat
    const Screened* best = &s;
    double most = -HUGE_VAL;
    for (const Screened& other : screened) {
        if (!other.candidate || other.candidate->inputs.front().law != input.law) continue;
        if (s.candidate->also_from == 0.0 && std::abs(other.seen - s.seen) > kAlike) continue;
        const double seen = first_seen(model, base, other);
        if (seen > most) most = seen, best = &other;
    }
    return *best;
}

/// The candidates that are not on, tried on top of `base`, best first; one for each name, or for each that is apart.
/// `best_seen`: log-likelihood of the rows seen where a better one than `base` is known. What does not gain half of the
/// best is not fitted to its end. `stood`: those that are tried whatever their linear step says.
std::vector<Tried> round(const Model& model, const Refined& base, const std::vector<Candidate>& candidates,
                         const SelectOptions& options, std::vector<std::pair<std::string, Point>>* alone,
                         double best_seen = -HUGE_VAL, bool (*is_on)(const Point&, const Candidate&) = has_any,
                         const std::set<std::string>& stood = {})
{
    constexpr double kHalf = 0.5;
    std::vector<const Candidate*> open;
    for (const Candidate& c : candidates)
        if (!is_on(base.point, c)) open.push_back(&c);
    std::vector<Screened> screened = screen(model, base.point, open, options, alone != nullptr);
    // Modulations are alike in a linear step from no shift: the first, which is the most common, goes before.
    std::stable_sort(screened.begin(), screened.end(),
                     [](const Screened& a, const Screened& b) { return a.rank > b.rank; });
    std::vector<Tried> tried;
    std::map<std::string, std::vector<int>> seen;
    std::set<std::string> refined, told;
    bool full = false;
    for (const Screened& s : screened) {
        if (!s.candidate) continue;
        std::string key;
        for (const std::string& n : s.candidate->names()) key += n + " ";
        std::vector<int>& kinds = seen[key];
        if (std::find(kinds.begin(), kinds.end(), apart(*s.candidate)) != kinds.end()) continue;
        kinds.push_back(apart(*s.candidate));
        // Iron's bend, and a loss that is given back, are far from a linear step.
        const Law law = s.candidate->inputs.front().law;
        const bool plain = law != Law::dead_given_back && s.candidate->names().size() == 1;
        if (alone && plain && !s.candidate->is_fault() && told.insert(key).second)
            alone->push_back({s.candidate->names().front(), s.point});
        const bool anyway = law == Law::dead_given_back || (law == Law::saturation && !full) ||
                            (plain && stood.count(s.candidate->names().front()) > 0);
        if (refined.size() >= kRefined && refined.count(key) == 0 && !anyway) {
            full = alone == nullptr;
            continue;
        }
        refined.insert(key);
        const Screened& first = by_legs(model, base, screened, s);
        // Settled points' fits cost little, and few rows tell late.
        const double worth = model.gains() > 0 ? base.left.seen + kHalf * (best_seen - base.left.seen) : -HUGE_VAL;
        // What is told of each alone is that of a fit.
        tried.push_back(attempt(model, base, first, worth, alone == nullptr && is_idle(base, first, worth)));
        if (tried.back().refined.ok) best_seen = std::max(best_seen, tried.back().refined.left.seen);
        if (options.tick) options.tick();
    }
    std::sort(tried.begin(), tried.end(), [](const Tried& a, const Tried& b) {
        if (a.refined.ok != b.refined.ok) return a.refined.ok;
        return a.refined.left.heldout > b.refined.left.heldout;
    });
    return tried;
}

}  // namespace

Refined refine_gains(const Model& model, const Point& start, int passes)
{
    Refined best;
    if (model.gains() == 0) return refine(model, start, passes);
    // As found, and as a right and a wrong model want it; a pass moves it by up to five, (E48).
    for (double gain : {0.0, 0.02, 0.3}) {
        Point at = start;
        if (gain > 0.0) at.gain.setConstant(gain);
        Refined r = refine(model, at, passes);
        if (r.ok && (!best.ok || r.left.seen > best.left.seen)) best = std::move(r);
    }
    return best;
}

Point without(Point at, const std::string& name)
{
    at.terms.erase(
        std::remove_if(at.terms.begin(), at.terms.end(), [&](const Term& t) { return name_of(t.input.law) == name; }),
        at.terms.end());
    return at;
}

std::vector<std::string> Candidate::names() const
{
    std::vector<std::string> out;
    for (const Input& i : inputs)
        if (std::find(out.begin(), out.end(), name_of(i.law)) == out.end()) out.push_back(name_of(i.law));
    return out;
}

namespace {

/// Drops the effects at `gone` where the rest does without them.
bool drop(const Model& model, const std::vector<std::size_t>& gone, const std::vector<std::size_t>& others,
          const SelectOptions& options, Selection& s)
{
    Point less = s.best.point;
    for (std::size_t k : gone) less = without(less, s.found[k].name);
    Refined r = refine(model, less, kPasses);
    if (!r.ok) return false;
    // What was found goes only where it clearly does nothing: below a t of 1 or 5 nats. Halved or doubled,
    // either changes nothing on the logs named in confirmed().
    const Better lost = better(model, r.left, s.best.left);
    if (needed(model, r, s.best, options) || (lost.t > 1.0 && lost.nats_each > 5.0)) return false;
    // One of several that came together goes only where the others hold without it.
    if (!others.empty()) {
        Point none = less;
        for (std::size_t k : others) none = without(none, s.found[k].name);
        const Refined bare = refine(model, none, kPasses);
        if (!bare.ok || !needed(model, bare, r, options)) return false;
    }
    s.best = std::move(r);
    for (std::size_t n = gone.size(); n-- > 0;) {
        s.found.erase(s.found.begin() + static_cast<std::ptrdiff_t>(gone[n]));
        s.after.erase(s.after.begin() + static_cast<std::ptrdiff_t>(gone[n]));
    }
    return true;
}

/// What a later effect has made superfluous goes: whole rounds first, then one of several that came together.
void drop_superfluous(const Model& model, const SelectOptions& options, Selection& s)
{
    for (bool changed = true; changed && s.found.size() > 1;) {
        changed = false;
        for (std::size_t k = 0; k < s.found.size() && !changed; ++k) {
            std::vector<std::size_t> together;
            for (std::size_t j = 0; j < s.found.size(); ++j)
                if (s.found[j].round == s.found[k].round) together.push_back(j);
            if (together.size() < s.found.size()) changed = drop(model, together, {}, options, s);
            if (changed || together.size() == 1) continue;
            together.erase(std::find(together.begin(), together.end(), k));
            changed = drop(model, {k}, together, options, s);
        }
    }
}

}  // namespace

namespace {

/// The points after each effect from the k-th on, anew: the best without those found later.
void follow(const Model& model, std::size_t k, Selection& s)
{
    for (std::size_t j = k; j < s.found.size(); ++j) {
        Point at = s.best.point;
        for (std::size_t later = j + 1; later < s.found.size(); ++later) at = without(at, s.found[later].name);
        const bool last = j + 1 == s.found.size();
        const Refined there = last ? s.best : refine(model, at, kPasses);
        if (there.ok) s.after[j] = there.point;
    }
}

void put_in_its_place(const Model& model, const SelectOptions& options, const Tried& other, std::size_t k, Selection& s)
{
    Refined fitted = refine(model, other.refined, kPasses);
    s.best = options.settle ? options.settle(std::move(fitted)) : std::move(fitted);
    s.found[k] = {other.name, {}, s.found[k].round};
    follow(model, k, s);
    s.beside_last.clear();
}

/// Another in the place of the effect at `k`, which what was found since shows to have been the wrong one: where the rows
/// held out confirm it, beside what noise either law brings in, and it is as plain and leaves no more, or leaves as much
/// less as names an effect more. (E176)
bool takes_its_place(const Model& model, const std::vector<Tried>& others, const SelectOptions& options,
                     double own_noise, std::size_t k, Selection& s)
{
    const double left = joint(options.reported_rms(s.best.point));
    const Tried* best = nullptr;
    for (const Tried& t : others) {
        if (!t.refined.ok || t.candidate.names().size() > 1 || t.candidate.is_fault()) continue;
        if (best != nullptr && t.refined.left.heldout <= best->refined.left.heldout) continue;
        const auto is_it = [&t](const Found& f) { return f.name == t.name; };
        if (std::any_of(s.found.begin(), s.found.end(), is_it)) continue;
        const Better gain = better(model, s.best.left, t.refined.left);
        if (!confirmed(model, gain)) continue;
        if (!confirmed(model, beside_law_noise(gain, law_noise(options, t.refined) - own_noise))) continue;
        if (options.veto && !options.veto(t.refined.point).empty()) continue;
        const bool as_plain = t.refined.point.columns() <= s.best.point.columns() &&
                              joint(options.reported_rms(t.refined.point)) <= left;
        if (as_plain || needed(model, s.best, t.refined, options)) best = &t;
    }
    if (best == nullptr) return false;
    put_in_its_place(model, options, *best, k, s);
    return true;
}

/// How much better `best` is than another that leaves as little, but for what noise either's law brings in; `own`: that
/// of the best.
Better beside_their_noise(const Model& model, const SelectOptions& options, const Refined& other, double own,
                          const Refined& best)
{
    const double nats = own - law_noise(options, other);
    // What the rows seen want as much, without more columns, those held out do not tell apart.
    if (other.left.seen >= best.left.seen + nats && other.point.columns() <= best.point.columns()) return {};
    const Better over = beside_law_noise(better(model, other.left, best.left), nats);
    // Nor what the estimate of the laws' own noise decides.
    return std::abs(over.nats) < kLawNoiseOff * std::abs(nats) ? Better() : over;
}

/// In place of a loss or a short at `k` that is as small as what each drive has, the angle or the voltage's frame of
/// another instant, where the rows held out do not tell them apart. (E196)
bool is_of_another_instant(const Model& model, const Refined& base, const std::vector<Candidate>& candidates,
                           const SelectOptions& options, double close, double own, std::size_t k, Selection& s)
{
    if (has(s.best.point, name_of(Law::sample_shift))) return false;
    if (!options.may_be_sampling || !options.may_be_sampling(s.best.point, s.found[k].name)) return false;
    std::vector<Candidate> instants;
    for (const Candidate& c : candidates) {
        const Input& input = c.inputs.front();
        const Instant instant = static_cast<Instant>(static_cast<int>(input.shape[0]));
        if (input.law == Law::sample_shift && (instant == Instant::angle || instant == Instant::voltage_frame))
            instants.push_back(c);
    }
    const std::vector<Tried> tried = round(model, base, instants, options, nullptr, s.best.left.seen);
    for (const Tried& t : tried) {
        if (!t.refined.ok || !options.may_be_sampling(t.refined.point, t.name)) continue;
        if (options.veto && !options.veto(t.refined.point).empty()) continue;
        if (options.reported_rms_to(t.refined.point, close) > close) continue;
        const Better over = beside_their_noise(model, options, t.refined, own, s.best);
        if (over.t > kSeparateT && over.nats_each > kSeparateNats) continue;
        put_in_its_place(model, options, t, k, s);
        return true;
    }
    return false;
}

/// By how much each column of `best` is another in `other`, which has something else in the place of `name`, or beside
/// all; nothing of that one's own.
Eigen::VectorXd moved_in(const Point& other, const Point& best, const std::string& name)
{
    Eigen::VectorXd out = Eigen::VectorXd::Zero(best.columns());
    out.head(best.base.size()) = (other.base - best.base).cwiseAbs();
    const Eigen::VectorXd here = best.values(), there = other.values();
    Eigen::Index at = best.base.size() + best.gain.size(), from = at;
    auto same = other.terms.begin();
    for (const Term& t : best.terms) {
        const Eigen::Index n = weights_of(t.input.law) + free_shapes_of(t.input);
        if (name_of(t.input.law) != name) {
            if (same == other.terms.end() || same->input.law != t.input.law || from + n > there.size()) break;
            out.segment(at, n) = (there.segment(from, n) - here.segment(at, n)).cwiseAbs();
            from += n, ++same;
        }
        at += n;
    }
    return out;
}

}  // namespace

bool look_alikes(const Model& model, const std::vector<Candidate>& candidates, const SelectOptions& options,
                 bool exchanges, Selection& s)
{
    // At one speed the 3000-rpm grid sets both: with a part of 1.2 its angle offset would count as told from a voltage
    // offset and from iron loss, with 1.8 its saturation as one with a delay; without half a deviation more, its angle
    // offset as told from iron loss.
    const double close = (options.one_speed ? 1.4 : kClose) * joint(options.reported_rms(s.best.point)),
                 apart = kSeparateT + (options.one_speed ? 0.5 : 0.0);
    const double own = law_noise(options, s.best);
    for (Found& found : s.found) found.confusable_with.clear(), found.rivals.clear();
    for (Found& found : s.found) {
        const bool known = &found == &s.found.back() && !s.beside_last.empty();
        const Refined base = known ? std::move(s.before_last)
                                   : refine(model, without(s.best.point, found.name), kPasses);
        if (!base.ok) continue;
        found.over = better(model, base.left, s.best.left);
        found.moved = Eigen::VectorXd::Zero(s.best.point.columns());
        const auto is_other = [&found](const Candidate& c) {
            return c.names().size() == 1 && c.names().front() != found.name && !c.is_fault();
        };
        const std::size_t place = static_cast<std::size_t>(&found - s.found.data());
        if (exchanges && is_of_another_instant(model, base, candidates, options, close, own, place, s)) return true;
        std::vector<Candidate> others;
        std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(others), is_other);
        const std::vector<Tried> tried = known ? std::move(s.beside_last)
                                               : round(model, base, others, options, nullptr, s.best.left.seen,
                                                       has_any_sensor);
        if (exchanges && s.found.size() > 1 && !bends_iron(found.name) &&
            takes_its_place(model, tried, options, own, place, s)) {
            drop_superfluous(model, options, s);
            return true;
        }
        for (const Tried& t : tried) {
            if (!t.refined.ok || !is_other(t.candidate)) continue;
            const auto& listed = found.confusable_with;
            const bool is_listed = std::find(listed.begin(), listed.end(), t.name) != listed.end();
            if (options.veto && !options.veto(t.refined.point).empty()) continue;
            const bool as_little = options.reported_rms_to(t.refined.point, close) <= close;
            const Better over = as_little ? beside_their_noise(model, options, t.refined, own, s.best)
                                          : better(model, t.refined.left, s.best.left);
            if (!is_listed) found.rivals.push_back({t.name, over});
            // Settled rows are none of a neighbour's: where it has as many columns, those seen count as well.
            const bool both = model.gains() == 0 && !options.one_speed &&
                              t.refined.point.columns() >= s.best.point.columns() && over.nats_each > kSeparateNats &&
                              over.nats_each + s.best.left.seen - t.refined.left.seen > 2.0 * kLeastNats;
            if (!as_little || both || (over.t > apart && over.nats_each > kSeparateNats)) continue;
            found.moved = found.moved.cwiseMax(moved_in(t.refined.point, s.best.point, found.name));
            if (!is_listed && listed.size() < kMostAlike) found.confusable_with.push_back(t.name);
        }
    }
    return false;
}

namespace {

/// Currents told between pulses are told between these; false where they are of other legs. What a lag or a shift takes
/// goes with it times the link: without the pulses' own bend both are far off, and their product is not.
bool by_same_legs(Point& at, const Input& pulses)
{
    for (Term& t : at.terms) {
        if (effect_of(t.input.law).shape != Shape::pulses) continue;
        if (t.input.modulation != pulses.modulation) return false;
        if (!(t.input.shape[0] > 0.0) || !(pulses.shape[0] > 0.0)) continue;
        t.weights[0] *= t.input.shape[0] / pulses.shape[0];
        t.input.shape[0] = pulses.shape[0];
    }
    return true;
}

/// Whether eddies follow the voltage, of whose pulses they hold more or less than of its mean.
bool holds_pulses(const Point& at)
{
    return std::any_of(at.terms.begin(), at.terms.end(),
                       [](const Term& t) { return t.input.law == Law::iron_loss && t.input.shape[0] > 0.0; });
}

/// The legs' pulses within a period, where the rows held out confirm them as they would an effect; nothing of them is
/// fitted but a link without a column. What eddies hold of them moves the machine's parameters rather than the residual:
/// there a gain that is hardly chance is enough.
bool take_pulses(const Model& model, const SelectOptions& options, Refined& at)
{
    constexpr double kHardlyChance = 2.0;  // deviations, and kLeastNats
    if (!options.pulses || has(at.point, name_of(Law::pulses))) return false;
    const bool held = holds_pulses(at.point);
    // The machine's parameters move by some permille, those of eddies by some percent; a link or an angle that no column
    // shows begins a third of itself off, or an eighth of a turn.
    const auto passes = [&](const Input& input) {
        return held ? kPasses : free_shapes_of(input) > 0 ? kPasses / 2 : 2;
    };
    Refined best;
    for (const Input& input : options.pulses(at.point)) {
        Point there = at.point;
        if (!by_same_legs(there, input)) continue;
        there.terms.push_back({input, {}});
        const double seen = best.ok ? std::max(at.left.seen, best.left.seen) : at.left.seen;
        Refined r = refine(model, there, passes(input), held ? seen : -HUGE_VAL);
        if (options.tick) options.tick();
        if (r.ok && (!best.ok || r.left.heldout > best.left.heldout)) best = std::move(r);
    }
    if (!best.ok) return false;
    best = refine(model, std::move(best), kPasses);
    if (!best.ok) return false;
    const Better gain = better(model, at.left, best.left);
    const bool hardly_chance = held && gain.nats >= kLeastNats && gain.t >= kHardlyChance;
    if (!hardly_chance && !needed(model, at, best, options)) return false;
    at = std::move(best);
    return true;
}

/// Iron that no polynomial is: a flux map in place of them, as far as the rows held out want it, and more than `rival`,
/// where there is one. Each of its two that a map does as well without goes.
bool take_map(const Model& model, const SelectOptions& options, const Tried* rival, int round_number, Selection& s)
{
    if (!options.mapped) return false;
    Refined best = options.mapped(s.best.point);
    // Currents that swing with pulses tell the iron's bend by more than a polynomial holds. (E180)
    if (best.ok) take_pulses(model, options, best);
    if (rival != nullptr && !(best.ok && best.left.heldout > rival->refined.left.heldout)) return false;
    const auto holds = [&](const Refined& less, const Refined& more) {
        return more.ok && needed(model, less, more, options) && (!options.veto || options.veto(more.point).empty());
    };
    if (!holds(s.best, best)) return false;
    for (const char* name : {"cross_saturation", "saturation"}) {
        const Refined less = refine(model, without(best.point, name), kPasses);
        if (less.ok && holds(s.best, less) && !needed(model, less, best, options)) best = less;
    }
    s.best = std::move(best);
    for (const char* name : {"saturation", "cross_saturation"}) {
        const auto is_it = [name](const Found& f) { return f.name == name; };
        if (has(s.best.point, name) && std::none_of(s.found.begin(), s.found.end(), is_it))
            s.found.push_back({name, {}, round_number}), s.after.push_back(s.best.point);
    }
    for (std::size_t k = s.found.size(); k-- > 0;)
        if (!has(s.best.point, s.found[k].name))
            s.found.erase(s.found.begin() + static_cast<std::ptrdiff_t>(k)),
                s.after.erase(s.after.begin() + static_cast<std::ptrdiff_t>(k));
    return true;
}

/// Two effects of which neither alone is confirmed, each hiding what the other would explain: taken only where both
/// together are, halve the reported residual, and neither does without the other.
bool take_pair(const Model& model, const std::vector<Tried>& tried, const std::vector<Candidate>& candidates,
               const SelectOptions& options, int round_number, Selection& s)
{
    constexpr std::size_t kFirsts = 3;  // each costs a round; (E48)
    constexpr double kHalf = 0.5;
    const double before = joint(options.reported_rms(s.best.point));
    Refined best;
    std::set<std::string> firsts;
    std::vector<Candidate> chosen;
    for (const Tried& first : tried) {
        if (!first.refined.ok || first.candidate.is_fault() || first.candidate.names().size() > 1) continue;
        // Of one name the best alone: each of its channels would take another's place.
        if (firsts.size() == kFirsts) break;
        if (!firsts.insert(first.name).second) continue;
        for (const Tried& second : round(model, first.refined, candidates, options, nullptr)) {
            if (!second.refined.ok || second.candidate.is_fault() || second.candidate.names().size() > 1) continue;
            if (best.ok && second.refined.left.heldout <= best.left.heldout) break;
            if (!confirmed(model, better(model, s.best.left, second.refined.left))) continue;
            if (joint(options.reported_rms(second.refined.point)) > kHalf * before) continue;
            if (options.veto && !options.veto(second.refined.point).empty()) continue;
            const Refined alone = refine(model, without(second.refined.point, first.name), kPasses);
            if (!alone.ok || !needed(model, first.refined, second.refined, options) ||
                !needed(model, alone, second.refined, options))
                continue;
            best = second.refined;
            chosen = {first.candidate, second.candidate};
            break;
        }
    }
    if (!best.ok) return false;
    s.best = std::move(best);
    for (const Candidate& c : chosen)
        s.found.push_back({c.names().front(), {}, round_number, {}, {}}), s.after.push_back(s.best.point);
    return true;
}

}  // namespace

namespace {

/// At one speed effects that turn with it are told apart by small terms alone, which only show once the others are in
/// the model: one that was taken early goes for another which the rows held out then confirm in its place. (E176)
bool exchange(const Model& model, const std::vector<Candidate>& candidates, const SelectOptions& options, Selection& s)
{
    if (!options.one_speed || s.found.size() < 2) return false;
    for (std::size_t k = 0; k < s.found.size(); ++k) {
        const std::string name = s.found[k].name;
        if (bends_iron(name)) continue;
        const Refined base = refine(model, without(s.best.point, name), kPasses);
        if (!base.ok) continue;
        std::vector<Candidate> others;
        for (const Candidate& c : candidates)
            if (c.names().size() == 1 && !c.is_fault() && !has_any(base.point, c)) others.push_back(c);
        for (Tried& t : round(model, base, others, options, nullptr)) {
            if (!t.refined.ok || !confirmed(model, better(model, s.best.left, t.refined.left))) continue;
            if (!needed(model, s.best, t.refined, options)) continue;
            if (options.veto && !options.veto(t.refined.point).empty()) continue;
            s.best = std::move(t.refined);
            s.found[k] = {t.name, {}, s.found[k].round};
            follow(model, k, s);
            return true;
        }
    }
    return false;
}

}  // namespace

namespace {

/// Whether another took more of the predictions' errors, by itself, than what was taken first.
bool took_more(const Model& model, const Tried& other, const Tried& taken, const Point& start,
               const SelectOptions& options)
{
    constexpr double kMore = 1.5;
    return other.refined.ok && other.candidate.names().size() == 1 && other.name != taken.name &&
           other.over.nats > std::max(kMore * taken.over.nats, taken.over.nats + kCompleteNats) &&
           told(model, other.over, start, other.refined.point, options) &&
           (!options.veto || options.veto(other.refined.point).empty());
}

/// Of each column of `best`, the most that one moves it by of those that make sense and gain more than chance does, though
/// not in blocks enough. (E198) Not of those that ask for another value: at no heat, at no current.
Eigen::VectorXd unproven_of(const std::vector<Tried>& tried, const SelectOptions& options, const Refined& best)
{
    Eigen::VectorXd most = Eigen::VectorXd::Zero(best.point.columns());
    const double own = law_noise(options, best);
    const auto asks_for_another = [](const Input& i) { return bends(i.law) || effect_of(i.law).shape == Shape::heat; };
    for (const Tried& t : tried) {
        const auto& inputs = t.candidate.inputs;
        if (std::any_of(inputs.begin(), inputs.end(), asks_for_another)) continue;
        const double to_noise = t.to_law_noise != 0.0 ? t.to_law_noise - own : 0.0;
        if (!t.refined.ok || t.candidate.is_fault() || !(t.over.nats + std::min(to_noise, 0.0) > kLeastNats)) continue;
        if (options.veto && !options.veto(t.refined.point).empty()) continue;
        // What is tried stands behind what there is.
        most = most.cwiseMax(moved_in(t.refined.point, best.point, ""));
    }
    return most;
}

/// `doubted`: effects beside which another that the rows held out want makes no sense, as it does without them; and the
/// first, where another took more.
Selection take_all(const Model& model, const Point& start, const std::vector<Candidate>& candidates,
                   const SelectOptions& options, std::set<std::string>& doubted)
{
    Selection s;
    s.plain = refine_gains(model, start, kPasses);
    if (!s.plain.ok) return s;
    s.best = s.plain;
    // An end to the search, beyond the effects that any log had. (E48)
    constexpr int kMostRounds = 6;
    bool mapped = false, refused = false;
    std::set<std::string> stood;
    for (int n = 0; n < kMostRounds; ++n) {
        s.unproven.resize(0);
        std::vector<double> left = options.reported_rms(s.best.point);
        if (!below(left, options.own) && take_pulses(model, options, s.best)) {
            if (n == 0) s.plain = s.best;
            s.beside_last.clear();
            left = options.reported_rms(s.best.point);
        }
        while (exchange(model, candidates, options, s)) {
            s.beside_last.clear();
            left = options.reported_rms(s.best.point);
        }
        if (below(left, options.own)) break;
        std::vector<Tried> tried = round(model, s.best, candidates, options, n == 0 ? &s.alone : nullptr, -HUGE_VAL,
                                         has_any, stood);
        weigh_law_noise(options, tried);
        const Tried* taken = nullptr;
        for (const Tried& t : tried)
            if (n == 0 && t.refined.ok) s.fitted.push_back({t.name, t.over});
        for (Tried& t : tried) {
            if (!t.refined.ok || !told(model, t.over, s.best.point, t.refined.point, options)) continue;
            if (taken && !stands_before(t, *taken)) continue;
            std::string why = options.veto ? options.veto(t.refined.point) : std::string();
            if (!why.empty() && options.settle && (gives_back(t.candidate) || is_between_pulses(t.refined.point))) {
                // What takes the whole of an inverter's loss, and finds nothing given back, is that loss; beside currents
                // told between the wrong pulses, or between any, a short is not of one phase.
                Refined settled = options.settle(t.refined);
                const Better over = better(model, s.best.left, settled.left);
                if (settled.ok && options.veto(settled.point).empty() &&
                    told(model, over, s.best.point, settled.point, options))
                    t.refined = std::move(settled), t.over = over, why.clear();
            }
            if (!why.empty()) {
                s.vetoed.push_back({t.name, why});
                for (const Found& f : s.found)
                    if (options.veto(without(t.refined.point, f.name)).empty() &&
                        needed(model, s.best, t.refined, options))
                        doubted.insert(f.name);
                continue;
            }
            if (needed(model, s.best, t.refined, options)) taken = &t;
        }
        // What a polynomial leaves of its iron looks like much else.
        const bool bends = has(s.best.point, name_of(Law::saturation)) ||
                           has(s.best.point, name_of(Law::cross_saturation));
        if (taken && bends && !mapped && !refused && !taken->candidate.is_fault()) {
            mapped = take_map(model, options, taken, n, s);
            refused = !mapped;
            if (mapped) {
                s.beside_last.clear();
                continue;
            }
        }
        if (!taken) {
            s.unproven = unproven_of(tried, options, s.best);
            if (mapped || !take_map(model, options, nullptr, n, s)) {
                if (n > 0 || !take_pair(model, tried, candidates, options, n, s)) break;
            } else {
                mapped = true;
            }
            s.beside_last.clear();
            continue;
        }
        if (taken->candidate.is_fault()) {
            s.fault = "the residual is that of current sensors that stop at about " +
                      figure(taken->refined.point.terms.back().input.shape[0]) + " A";
            s.best = s.plain, s.found.clear(), s.after.clear();
            return s;
        }
        stood = that_stand(model, tried, *taken, options, s.best);
        const auto is_more = [&](const Tried& t) { return took_more(model, t, *taken, s.best.point, options); };
        if (n == 0 && std::any_of(tried.begin(), tried.end(), is_more)) doubted.insert(taken->name);
        // What stands behind another may not have been fitted to its end.
        Refined fitted = taken == &tried.front() ? taken->refined : refine(model, taken->refined, kPasses);
        s.before_last = std::exchange(s.best, options.settle ? options.settle(std::move(fitted)) : std::move(fitted));
        for (const std::string& name : taken->candidate.names())
            s.found.push_back({name, {}, n, {}, {}}), s.after.push_back(s.best.point);
        // Without either of two, the other stands.
        s.beside_last.clear();
        if (taken->candidate.names().size() == 1 &&
            is_of_another_instant(model, s.before_last, candidates, options,
                                  kClose * joint(options.reported_rms(s.best.point)), law_noise(options, s.best),
                                  s.found.size() - 1, s))
            continue;
        if (taken->candidate.names().size() == 1 && are_alike(s.before_last.point, s.best.point))
            s.beside_last = std::move(tried);
    }
    const std::size_t found = s.found.size();
    drop_superfluous(model, options, s);
    if (s.found.size() != found || apart_by_sensor(s.before_last.point, candidates)) s.beside_last.clear();
    return s;
}

}  // namespace

Selection select(const Model& model, const Point& start, const std::vector<Candidate>& candidates,
                 const SelectOptions& options)
{
    std::set<std::string> doubted, more;
    Selection s = take_all(model, start, candidates, options, doubted);
    if (doubted.empty()) return s;
    // One that had taken what is of two others hides both: a short, unlike sensors that sample late; a loss, dead time
    // beside an angle.
    std::vector<Candidate> others;
    for (const Candidate& c : candidates) {
        const std::vector<std::string> names = c.names();
        const auto is_doubted = [&](const std::string& n) { return doubted.count(n) > 0; };
        if (std::none_of(names.begin(), names.end(), is_doubted)) others.push_back(c);
    }
    Selection without_it = take_all(model, start, others, options, more);
    if (!without_it.best.ok || !without_it.fault.empty()) return s;
    const bool as_plain = without_it.found.size() < s.found.size() &&
                          without_it.best.left.heldout >= s.best.left.heldout &&
                          joint(options.reported_rms(without_it.best.point)) <=
                              joint(options.reported_rms(s.best.point));
    if (!as_plain && !needed(model, s.best, without_it.best, options)) return s;
    without_it.alone = std::move(s.alone), without_it.fitted = std::move(s.fitted);
    return without_it;
}

}  // namespace dqw
