// Runs the real dqwatch binary, and makes the files to feed it.
#ifndef DQW_TESTS_COMMAND_HPP
#define DQW_TESTS_COMMAND_HPP

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

extern char** environ;

namespace command {

/// How a run ended. `code` is the exit code, or 128 + the signal; 124 after the timeout, as timeout(1) has it.
struct Outcome {
    int code = -1;
    std::string out, err;
    double peak_MiB = 0;  ///< resident
    double seconds = 0;
};

inline std::string environment(const char* name, const char* otherwise)
{
    const char* value = std::getenv(name);
    return value && *value ? value : otherwise;
}

inline std::string binary() { return environment("DQWATCH", "build/dqwatch"); }
inline bool sanitized() { return environment("DQW_TEST_KIND", "plain") == "asan"; }

/// Where the child's streams go instead of into pipes: paths, empty for a pipe; "-" closes stdout.
struct Redirect {
    std::string in = "/dev/null", out;
};

/// Runs `argv[0]` with a time limit; captures both outputs.
inline Outcome run_program(const std::vector<std::string>& argv, const Redirect& redirect = {}, double timeout_s = 600)
{
    int out[2], err[2];
    if (::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, redirect.in.c_str(), O_RDONLY, 0);
    if (redirect.out == "-")
        posix_spawn_file_actions_addclose(&actions, 1);
    else if (!redirect.out.empty())
        posix_spawn_file_actions_addopen(&actions, 1, redirect.out.c_str(), O_WRONLY, 0);
    else
        posix_spawn_file_actions_adddup2(&actions, out[1], 1);
    posix_spawn_file_actions_adddup2(&actions, err[1], 2);
    std::vector<char*> args;
    for (const auto& a : argv) args.push_back(const_cast<char*>(a.c_str()));
    args.push_back(nullptr);
    const auto start = std::chrono::steady_clock::now();
    const auto passed_s = [&] {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    pid_t pid = 0;
    const int failed = ::posix_spawnp(&pid, args[0], &actions, nullptr, args.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(out[1]);
    ::close(err[1]);
    Outcome outcome;
    if (failed) {
        ::close(out[0]);
        ::close(err[0]);
        outcome.code = 127;
        return outcome;
    }
    pollfd fds[2] = {{out[0], POLLIN, 0}, {err[0], POLLIN, 0}};
    bool late = false;
    for (int open = 2; open > 0;) {
        if (::poll(fds, 2, 100) < 0) break;
        for (pollfd& fd : fds) {
            if (fd.fd < 0 || fd.revents == 0) continue;
            char buffer[65536];
            const ssize_t got = ::read(fd.fd, buffer, sizeof buffer);
            if (got > 0) {
                (&fd == fds ? outcome.out : outcome.err).append(buffer, static_cast<std::size_t>(got));
            } else {
                fd.fd = -1;
                --open;
            }
        }
        if (!late && passed_s() > timeout_s) {
            late = true;
            ::kill(pid, SIGKILL);
        }
    }
    ::close(out[0]);
    ::close(err[0]);
    int status = 0;
    rusage usage = {};
    while (::wait4(pid, &status, 0, &usage) < 0 && errno == EINTR) {}
    outcome.seconds = passed_s();
    outcome.peak_MiB = static_cast<double>(usage.ru_maxrss) / 1024.0;
    outcome.code = late ? 124 : WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return outcome;
}

/// Runs dqwatch.
inline Outcome dqwatch(std::vector<std::string> args, const Redirect& redirect = {}, double timeout_s = 600)
{
    args.insert(args.begin(), binary());
    return run_program(args, redirect, timeout_s);
}

/// A folder of its own, removed with all that is in it.
class Folder {
public:
    Folder()
    {
        std::string pattern = environment("TMPDIR", "/tmp") + "/dqw_test_XXXXXX";
        if (!::mkdtemp(pattern.data())) throw std::runtime_error("mkdtemp");
        path_ = pattern;
    }
    ~Folder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    std::string operator/(const std::string& name) const { return path_ + "/" + name; }
    std::string write(const std::string& name, const std::string& text) const
    {
        std::ofstream(*this / name, std::ios::binary) << text;
        return *this / name;
    }

private:
    std::string path_;
};

inline std::string read_file(const std::string& path)
{
    std::ifstream in(path, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
}

/// A plain machine moved along smooth curves that repeat every `period` rows: v follows from i and w in closed form, to
/// 1e-6 by Simpson's rule. No simulator, no library.
struct Machine {
    double p = 4, R_ohm = 0.5, Ld_H = 2e-3, Lq_H = 3e-3, psi_Wb = 0.05, dt_s = 1e-4;
    std::size_t period = 2000;

    struct Row {
        double v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s;
    };
    void at(double row, double& d, double& q, double& w) const
    {
        const double x = 2 * 3.14159265358979323846 * row / static_cast<double>(period);
        d = -2 + 3 * std::sin(7 * x) + std::sin(31 * x);
        q = 4 + 3 * std::cos(11 * x) + std::sin(43 * x + 1);
        w = 100 + 40 * std::sin(x) + 10 * std::cos(3 * x);
    }
    Row row(std::size_t k) const
    {
        double d[3], q[3], w[3], wd = 0, wq = 0, md = 0, mq = 0, mw = 0;
        const double weight[3] = {1 / 6.0, 4 / 6.0, 1 / 6.0};
        for (int i = 0; i < 3; ++i) {
            at(static_cast<double>(k) + 0.5 * i, d[i], q[i], w[i]);
            md += weight[i] * d[i], mq += weight[i] * q[i], mw += weight[i] * w[i];
            wd += weight[i] * w[i] * d[i], wq += weight[i] * w[i] * q[i];
        }
        return {R_ohm * md + Ld_H * (d[2] - d[0]) / dt_s - p * Lq_H * wq,
                R_ohm * mq + Lq_H * (q[2] - q[0]) / dt_s + p * (Ld_H * wd + psi_Wb * mw), d[0], q[0], w[0]};
    }
};

/// How a log is written down.
struct Style {
    char separator = ',';
    const char* newline = "\n";
    const char* mark = "";  ///< byte-order mark
    bool trailing = false;  ///< separator at the end of every line
    double speed_factor = 1.0;
};

/// Writes a dynamic log of `rows` rows. The repeating part of a period is formatted once: 10 million rows in seconds.
inline void write_log(const std::string& path, std::size_t rows, const Machine& machine = {}, const Style& style = {})
{
    std::FILE* file = std::fopen(path.c_str(), "wb");
    if (!file) throw std::runtime_error("cannot write " + path);
    std::string end = style.trailing ? std::string(1, style.separator) : "";
    end += style.newline;
    std::string header = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s";
    for (char& c : header)
        if (c == ',') c = style.separator;
    header = style.mark + header + end;
    std::fwrite(header.data(), 1, header.size(), file);
    std::vector<std::string> tails;
    for (std::size_t k = 0; k < machine.period && k < rows; ++k) {
        const Machine::Row r = machine.row(k);
        char text[160];
        const char s = style.separator;
        std::snprintf(text, sizeof text, "%c%.9g%c%.9g%c%.9g%c%.9g%c%.9g", s, r.v_d_V, s, r.v_q_V, s, r.i_d_A, s,
                      r.i_q_A, s, r.w_m_rad_s * style.speed_factor);
        tails.push_back(text + end);
    }
    // Whole microseconds, so that the time text is two integers.
    const auto step_us = static_cast<unsigned long>(std::lround(machine.dt_s * 1e6));
    std::string text;
    for (std::size_t k = 0; k < rows; ++k) {
        const unsigned long us = k * step_us;
        char time[32];
        const int n = std::snprintf(time, sizeof time, "%lu.%06lu", us / 1000000, us % 1000000);
        text.append(time, static_cast<std::size_t>(n)).append(tails[k % machine.period]);
        if (text.size() < (1u << 20) && k + 1 < rows) continue;
        if (std::fwrite(text.data(), 1, text.size(), file) != text.size())
            throw std::runtime_error("disk full: " + path);
        text.clear();
    }
    if (std::fclose(file) != 0) throw std::runtime_error("disk full: " + path);
}

}  // namespace command
#endif
