// The blind campaign: draws logs, traces them in processes of their own, prints the confusion table:
//     blind [--from SEED] [--count N] [--jobs N] [--draw] [--lines FILE]
//     blind --seed SEED [--draw] [--csv DIR] | --read FILE
// FILE takes each outcome as it comes, one a line; an existing one is added to.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <thread>

#include "app/base/output.hpp"
#include "blind.hpp"

namespace {

constexpr unsigned kLongest_s = 600;

struct Options {
    std::uint64_t from = 0, count = 320, jobs = 0;
    bool alone = false, draw = false;
    std::string csv, lines, read;
};

/// Draws only: what the campaign consists of.
std::string drawn_line(std::uint64_t seed)
{
    const blind::Case c = blind::draw(seed);
    return fmt::format("{} {} {:.1f}x floor {:.3g}; {}", seed, blind::name_of(c.kind), c.strength(), c.noise_floor,
                       c.about);
}

/// The work of one seed, as a line; a child of its own, so that a crash or an endless fit is one failed log.
std::string line(std::uint64_t seed, bool draw) { return draw ? drawn_line(seed) : blind::line_of(blind::run(seed)); }

struct Child {
    int pipe = -1;
    std::uint64_t seed = 0;
};

Child start(std::uint64_t seed, bool draw, pid_t& id)
{
    int ends[2];
    std::fflush(nullptr);
    if (pipe(ends) != 0 || (id = fork()) < 0) {
        std::perror("blind");
        std::exit(1);
    }
    if (id == 0) {
        alarm(kLongest_s);
        std::string text;
        try {
            text = line(seed, draw);
        } catch (const std::exception& e) {
            std::fprintf(stderr, "seed %llu: %s\n", static_cast<unsigned long long>(seed), e.what());
            _exit(1);
        }
        // One line is below what a pipe takes at once.
        const bool written = write(ends[1], text.data(), text.size()) == static_cast<ssize_t>(text.size());
        _exit(written ? 0 : 1);
    }
    close(ends[1]);
    return {ends[0], seed};
}

std::string read_all(int pipe)
{
    std::string text;
    char some[4096];
    for (ssize_t n; (n = read(pipe, some, sizeof some)) > 0;) text.append(some, static_cast<std::size_t>(n));
    close(pipe);
    return text;
}

/// Lines by seed. A child that ends without one leaves an empty line.
std::map<std::uint64_t, std::string> all_lines(const Options& options)
{
    std::map<std::uint64_t, std::string> lines;
    std::map<pid_t, Child> running;
    std::ofstream kept;
    if (!options.lines.empty()) kept.open(options.lines, std::ios::app);
    for (std::uint64_t next = options.from, end = options.from + options.count; next < end || !running.empty();) {
        if (next < end && running.size() < options.jobs) {
            pid_t id = 0;
            const Child child = start(next++, options.draw, id);
            running[id] = child;
            continue;
        }
        int status = 0;
        const pid_t id = wait(&status);
        const auto done = running.find(id);
        if (done == running.end()) continue;
        lines[done->second.seed] = read_all(done->second.pipe);
        if (kept.is_open()) kept << lines[done->second.seed] << std::endl;
        running.erase(done);
        if (isatty(2))
            std::fprintf(stderr, "\r%zu of %llu", lines.size(), static_cast<unsigned long long>(options.count));
    }
    if (isatty(2)) std::fprintf(stderr, "\r\033[K");
    return lines;
}

void write_csv(const blind::Case& c, const std::string& folder)
{
    const std::pair<const char*, const std::vector<double>*> columns[] = {{"t_s", &c.log.t_s},
                                                                          {"v_d_V", &c.log.v_d_V},
                                                                          {"v_q_V", &c.log.v_q_V},
                                                                          {"i_d_A", &c.log.i_d_A},
                                                                          {"i_q_A", &c.log.i_q_A},
                                                                          {"w_m_rad_s", &c.log.w_m_rad_s},
                                                                          {"theta_e_rad", &c.log.theta_e_rad},
                                                                          {"theta_m_rad", &c.log.theta_m_rad},
                                                                          {"v_dc_V", &c.log.v_dc_V},
                                                                          {"temp_winding_C", &c.log.temp_winding_C},
                                                                          {"temp_magnet_C", &c.log.temp_magnet_C},
                                                                          {"torque_Nm", &c.log.torque_Nm}};
    const std::string stem = fmt::format("{}/blind_{}", folder, c.seed);
    std::string text, header;
    for (const auto& [name, values] : columns)
        if (!values->empty()) header += (header.empty() ? "" : ",") + std::string(name);
    for (std::size_t k = 0; k < c.log.rows(); ++k) {
        std::string row;
        for (const auto& [name, values] : columns)
            if (!values->empty()) row += fmt::format("{}{:.12g}", row.empty() ? "" : ",", (*values)[k]);
        text += row + "\n";
    }
    dqw::OutputFile csv(stem + ".csv"), toml(stem + ".toml");
    csv.write(header + "\n" + text);
    csv.close();
    const char* const regimes[] = {"dynamic", "steady", "standstill", "mechanical"};
    std::string said = fmt::format("# {}\n[log]\nregime = \"{}\"\n[machine]\n", c.about,
                                   regimes[static_cast<int>(c.log.regime)]);
    if (c.log.machine.pole_pairs) said += fmt::format("pole_pairs = {}\n", *c.log.machine.pole_pairs);
    if (c.log.machine.torque_constant_Nm_A)
        said += fmt::format("torque_constant_Nm_A = {}\n", *c.log.machine.torque_constant_Nm_A);
    toml.write(said);
    toml.close();
}

/// Outcomes that --lines kept, the last of each seed.
std::vector<blind::Outcome> kept(const std::string& file)
{
    std::map<std::uint64_t, blind::Outcome> by_seed;
    std::ifstream in(file);
    if (!in) throw std::runtime_error(file + ": cannot be read");
    for (std::string text; std::getline(in, text);) {
        if (text.empty()) continue;
        const blind::Outcome o = blind::outcome_of(text);
        by_seed[o.seed] = o;
    }
    std::vector<blind::Outcome> outcomes;
    for (const auto& [seed, o] : by_seed) outcomes.push_back(o);
    return outcomes;
}

int one(const Options& options)
{
    const blind::Case c = blind::draw(options.from);
    std::printf("%s\ntruth: p %g R %.6g Ld %.6g Lq %.6g psi %.6g J %.4g B %.4g; noise floor %.4g\n", c.about.c_str(),
                c.truth.pole_pairs, c.truth.R_ohm, c.truth.Ld_H, c.truth.Lq_H, c.truth.psi_Wb, c.truth.J_kgm2,
                c.truth.B_Nms_rad, c.noise_floor);
    if (!options.csv.empty()) write_csv(c, options.csv);
    for (const blind::Drawn& d : c.drawn)
        std::printf("%s: the log cannot tell it from [%s], hardly from [%s]\n", d.name.c_str(),
                    fmt::format("{}", fmt::join(d.same, ", ")).c_str(),
                    fmt::format("{}", fmt::join(d.close, ", ")).c_str());
    if (options.draw) return 0;
    const dqw::TraceResult r = dqw::trace({c.log});
    std::printf("%s: floor %.4g, before %.4g, after %.4g %s\n", r.verdict.c_str(), r.noise_floor, r.before.heldout_rms,
                r.after.heldout_rms, r.unit.c_str());
    for (const dqw::TraceEffect& e : r.effects) {
        std::string text = fmt::format("  {} -> {:.4g}:", e.name, e.heldout_rms_after);
        for (const dqw::Estimate& p : e.parameters) text += fmt::format(" {} {:.4g} +- {:.2g}", p.name, p.value, p.sd);
        for (const std::string& other : e.confusable_with) text += fmt::format("; or {}", other);
        std::puts(text.c_str());
    }
    for (const dqw::TraceRejected& e : r.rejected)
        std::printf("  not %s (%.4g): %s\n", e.name.c_str(), e.heldout_rms, e.why.c_str());
    for (const std::string& note : r.notes) std::printf("  note: %s\n", note.c_str());
    if (!r.rest_signature.empty()) std::printf("  rest: %s\n", r.rest_signature.c_str());
    std::fputs(blind::report({blind::score(c, r, 0)}).c_str(), stdout);
    return 0;
}

}  // namespace

int main(int argc, char** argv)
{
    Options options;
    for (int k = 1; k < argc; ++k) {
        const std::string key = argv[k];
        const bool last = k + 1 == argc;
        if (key == "--draw") {
            options.draw = true;
        } else if (!last && key == "--csv") {
            options.csv = argv[++k];
        } else if (!last && key == "--lines") {
            options.lines = argv[++k];
        } else if (!last && key == "--read") {
            options.read = argv[++k];
        } else if (!last && (key == "--seed" || key == "--from" || key == "--count" || key == "--jobs")) {
            const std::uint64_t value = std::strtoull(argv[++k], nullptr, 10);
            (key == "--count" ? options.count : key == "--jobs" ? options.jobs : options.from) = value;
            options.alone = options.alone || key == "--seed";
        } else {
            std::fprintf(stderr, "blind [--from SEED] [--count N] [--jobs N] [--draw] [--lines FILE] | --seed SEED "
                                 "[--draw] [--csv DIR] | --read FILE\n");
            return 2;
        }
    }
    if (options.alone) return one(options);
    if (!options.read.empty()) {
        std::fputs(blind::report(kept(options.read)).c_str(), stdout);
        return 0;
    }
    if (options.jobs == 0) options.jobs = std::max(1u, std::thread::hardware_concurrency());
    const auto lines = all_lines(options);
    std::vector<blind::Outcome> outcomes;
    for (const auto& [seed, text] : lines) {
        if (options.draw) {
            std::puts(text.c_str());
            continue;
        }
        blind::Outcome o;
        o.seed = seed, o.kind = blind::kind_of(seed), o.failure = "ended without an answer";
        outcomes.push_back(text.empty() ? o : blind::outcome_of(text));
    }
    if (!options.draw) std::fputs(blind::report(outcomes).c_str(), stdout);
    return 0;
}
