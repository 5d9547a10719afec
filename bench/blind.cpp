#include "blind.hpp"

#include <algorithm>
#include <chrono>
#include <fmt/format.h>
#include <stdexcept>

#include "blind_class.hpp"
#include "blind_effect.hpp"
#include "ref/log/result.hpp"

namespace blind {
namespace {

constexpr int kAttempts = 200;

dqw::Regime draw_regime(Random& random, Kind kind)
{
    const double u = random.uniform(0, 1);
    if (kind == Kind::outside || u > 0.17) return dqw::Regime::dynamic;
    return u < 0.08 ? dqw::Regime::mechanical : u < 0.14 ? dqw::Regime::steady : dqw::Regime::standstill;
}

std::vector<Drawn> draw_effects(Random& random, const Setup& s, Kind kind)
{
    std::vector<Drawn> drawn;
    if (kind == Kind::clean) return drawn;
    const auto names = kind == Kind::outside ? faults_for(s) : effects_for(s);
    // Log-uniform; a fault is judged where it shows clearly.
    const auto one = [&] {
        Drawn d;
        d.name = names[random.below(names.size())];
        d.strength = random.log_uniform(kind == Kind::outside ? 2.5 : 1.6, 30);
        return d;
    };
    drawn.push_back(one());
    while (kind == Kind::two && drawn.size() < 2) {
        const Drawn other = one();
        if (may_join(drawn[0].name, other.name)) drawn.push_back(other);
        if (!may_join(drawn[0].name, "")) drawn[0] = one();
    }
    return drawn;
}

void heat_idly(const Setup& s, dqw_sim_scenario& x)
{
    if (!s.temperatures || !s.heats || x.machine.winding_heat_J_K > 0) return;
    x.machine.winding_heat_J_K = s.copper_W * x.duration_s / 40,
    x.machine.magnet_heat_J_K = 3 * x.machine.winding_heat_J_K;
    x.machine.winding_magnet_W_K = x.machine.winding_heat_J_K / x.duration_s;
}

const char* const regimes[] = {"dynamic", "steady", "standstill", "mechanical"};

std::string about_of(const Setup& s, const Case& c)
{
    const dqw_sim_scenario& x = s.scenario;
    std::string text = fmt::format("{}, {}, {}{}, {} rows at {:.4g} kHz, noise {:.2g}/{:.2g}/{:.2g} %", s.machine,
                                   regimes[static_cast<int>(s.regime)], s.profile, s.injection ? " with injection" : "",
                                   c.log.rows(), 1e-3 / c.log.dt_s, 100 * x.noise.i, 100 * x.noise.v, 100 * x.noise.w);
    if (x.noise.step_i_A > 0) text += ", ADC";
    if (!s.angle) text += ", no angle";
    if (s.temperatures) text += ", temperatures";
    if (s.gap) text += ", gap";
    for (const Drawn& d : c.drawn) {
        text += fmt::format("; {} {:.3g} ({:.1f}x)", d.name, d.size, d.strength);
        if (!d.same.empty()) text += fmt::format(" like {}", fmt::join(d.same, ", "));
    }
    return text;
}

/// Effects that a drawn one brings along.
void add_companions(std::vector<Drawn>& drawn)
{
    const std::vector<Drawn> alone = drawn;
    for (const Drawn& d : alone) {
        // Which of the two has a look-alike, no log says.
        if (d.name == "cross_saturation") drawn.push_back({"saturation", 0.3, d.strength, {}, d.close});
        if (d.name == "direction_asymmetry") drawn.push_back({"coulomb_friction", d.size, d.strength, {}, d.close});
    }
}

/// Sizes what was drawn, and simulates the log. False where something of it cannot be seen.
bool fill(const Setup& s, Case& c, Judged judged)
{
    dqw::Result floor;
    dqw::report_residual({log_of(s, s.scenario, true)}, c.truth, floor);
    c.noise_floor = floor.residual_rms;
    if (!calibrate(s, c.noise_floor, c.drawn)) return false;
    dqw_sim_scenario x = s.scenario;
    for (const Drawn& d : c.drawn) apply(d.name, d.size, s, x);
    heat_idly(s, x);
    c.log = log_of(s, x, true);
    c.log.path = fmt::format("seed {}", c.seed);
    if (judged == Judged::yes && c.kind != Kind::outside && !c.drawn.empty()) find_classes(s, c.drawn);
    c.about = about_of(s, c);
    if (c.kind != Kind::outside) add_companions(c.drawn);
    c.switching = s.switching;
    return true;
}

}  // namespace

const char* name_of(Kind kind)
{
    const char* const names[] = {"clean", "one", "two", "outside"};
    return names[static_cast<int>(kind)];
}

Kind kind_of(std::uint64_t seed)
{
    const std::uint64_t place = seed % 20;
    return place < 4 ? Kind::clean : place < 13 ? Kind::one : place < 17 ? Kind::two : Kind::outside;
}

bool switches(std::uint64_t seed) { return seed / 20 % 2 == 1; }

double Case::strength() const
{
    double least = drawn.empty() ? 0.0 : drawn[0].strength;
    for (const Drawn& d : drawn) least = std::min(least, d.strength);
    return least;
}

Case draw(std::uint64_t seed, Judged judged)
{
    Random random(seed);
    const Kind kind = kind_of(seed);
    const dqw::Regime regime = draw_regime(random, kind);
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        const Setup s = draw_setup(random, regime, switches(seed));
        Case c;
        c.seed = seed, c.kind = kind, c.truth = truth_of(s), c.drawn = draw_effects(random, s, kind);
        // A machine that the simulator cannot follow is not drawn.
        try {
            const bool filled = fill(s, c, judged);
            remove_curves();
            if (filled) return c;
        } catch (const std::runtime_error&) {
            continue;
        }
    }
    throw std::runtime_error(fmt::format("seed {}: no log in {} attempts", seed, kAttempts));
}

Outcome run(std::uint64_t seed)
{
    const Case c = draw(seed);
    const auto start = std::chrono::steady_clock::now();
    const auto seconds = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    try {
        const dqw::TraceResult result = dqw::trace({c.log});
        return score(c, result, seconds());
    } catch (const std::exception& e) {
        Outcome o = score(c, dqw::TraceResult{}, seconds());
        o.failure = e.what();
        return o;
    }
}

}  // namespace blind
