// `monitor -`: rows from a pipe as they come, against the same rows in a file; memory, interrupts, and what is healthy
// across restarts.
// Plain only: long, and what it runs others run under the sanitizers.
#include <sys/stat.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>

#include "monitor_command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using monitor_command::count;
using monitor_command::holds;
using nlohmann::json;

/// A joint on an inverter with dead time; each of `sets` is a --set. Returns the log's text.
static std::string joint(const Folder& folder, std::vector<std::string> sets)
{
    sets.insert(sets.begin(), {"nonideal.dead_time_V=0.24", "nonideal.dead_time_width_A=0.05"});
    std::vector<std::string> args = {"sim", "joint_24v", "--out", folder / ""};
    for (const std::string& set : sets) args.insert(args.end(), {"--set", set});
    const Outcome run = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    return command::read_file(folder / "joint_24v.csv");
}

static const std::vector<std::string> lost_flux = {
    "nonideal.demagnetisation=0.05", "nonideal.demagnetisation.t_start_s=2", "nonideal.demagnetisation.t_end_s=2.1"};

static std::vector<std::string> and_also(std::vector<std::string> all, const std::string& last)
{
    all.push_back(last);
    return all;
}

/// The joint's machine file with what else is said of it: in [log], and before [machine].
static std::string said(const Folder& folder, const std::string& name, const std::string& of_log,
                        const std::string& of_machine)
{
    std::string text = command::read_file(folder / "joint_24v.toml");
    text.insert(text.find("[log]\n") + 6, of_log);
    text.insert(text.find("[machine]\n"), of_machine);
    return folder.write(name, text);
}

static std::string nameplate(const Folder& folder)
{
    return said(folder, "plate.toml", "modulation = \"centred\"\n",
                "[nameplate]\nv_V = 14\ni_A = 6\nw_m_rad_s = 110\n");
}

static Outcome from_pipe(const Folder& folder, const std::string& log, std::vector<std::string> args)
{
    args.insert(args.begin(), {"monitor", "-", "--out", folder / "o"});
    const std::string fifo = folder / "fifo";
    (void)::unlink(fifo.c_str());
    TEST_ASSERT_EQUAL_INT(0, ::mkfifo(fifo.c_str(), 0600));
    std::thread writer([&] { std::ofstream(fifo, std::ios::binary) << log; });
    const Outcome run = command::dqwatch(args, {fifo, ""});
    writer.join();
    return run;
}

/// dqwatch with both ends of its streams in our hands.
class Running {
public:
    explicit Running(std::vector<std::string> args)
    {
        args.insert(args.begin(), command::binary());
        int in[2], out[2], err[2];
        if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0 || ::pipe2(err, O_CLOEXEC) != 0)
            throw std::runtime_error("pipe");
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, in[0], 0);
        posix_spawn_file_actions_adddup2(&actions, out[1], 1);
        posix_spawn_file_actions_adddup2(&actions, err[1], 2);
        std::vector<char*> argv;
        for (const auto& a : args) argv.push_back(const_cast<char*>(a.c_str()));
        argv.push_back(nullptr);
        // Where the tests run in the background an interrupt is ignored, and a child would inherit that.
        posix_spawnattr_t usual;
        sigset_t signals;
        sigemptyset(&signals), sigaddset(&signals, SIGINT), sigaddset(&signals, SIGTERM);
        posix_spawnattr_init(&usual);
        posix_spawnattr_setsigdefault(&usual, &signals);
        posix_spawnattr_setflags(&usual, POSIX_SPAWN_SETSIGDEF);
        const int failed = ::posix_spawnp(&pid_, argv[0], &actions, &usual, argv.data(), environ);
        posix_spawnattr_destroy(&usual);
        posix_spawn_file_actions_destroy(&actions);
        ::close(in[0]), ::close(out[1]), ::close(err[1]);
        in_ = in[1], out_ = out[0], err_ = err[0];
        if (failed) throw std::runtime_error("spawn");
    }
    ~Running()
    {
        if (pid_ > 0) ::kill(pid_, SIGKILL), (void)::waitpid(pid_, nullptr, 0);
        ::close(in_), ::close(out_), ::close(err_);
    }
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

    void give(const std::string& text) const
    {
        for (std::size_t at = 0; at < text.size();) {
            const ssize_t n = ::write(in_, text.data() + at, text.size() - at);
            if (n <= 0) throw std::runtime_error("write");
            at += static_cast<std::size_t>(n);
        }
    }
    /// Waits for a line on stdout; empty where none comes within ten minutes, or at the end.
    std::string line()
    {
        while (seen_.find('\n') == std::string::npos) {
            pollfd fd = {out_, POLLIN, 0};
            char buffer[4096];
            if (::poll(&fd, 1, 600000) <= 0) return "";
            const ssize_t n = ::read(out_, buffer, sizeof buffer);
            if (n <= 0) return "";
            seen_.append(buffer, static_cast<std::size_t>(n));
        }
        const std::size_t end = seen_.find('\n') + 1;
        const std::string first = seen_.substr(0, end);
        seen_.erase(0, end);
        return first;
    }
    /// Everything that is still to come, and the exit code.
    std::pair<std::string, int> end(int signal)
    {
        ::kill(pid_, signal);
        std::string all;
        for (std::string next = line(); !next.empty(); next = line()) all += next;
        int status = 0;
        (void)::waitpid(pid_, &status, 0);
        pid_ = 0;
        return {all, WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status)};
    }

private:
    pid_t pid_ = 0;
    int in_ = -1, out_ = -1, err_ = -1;
    std::string seen_;
};

// Shorter than the window, and with a nameplate far longer.
static void a_pipe_gives_the_events_of_the_file(void)
{
    const Folder folder;
    const std::string whole = joint(folder, and_also(lost_flux, "duration_s=4")), toml = folder / "joint_24v.toml";
    for (const char* arith : {"float", "q15"}) {
        const std::vector<std::string> args = {"--machine", toml, "--json", "--arith", arith};
        const Outcome piped = from_pipe(folder, whole, args);
        std::vector<std::string> of_file = {folder / "joint_24v.csv", "--out", folder / "f"};
        of_file.insert(of_file.end(), args.begin(), args.end());
        const Outcome file = monitor_command::monitor(of_file);
        holds(file.out, "demagnetisation");
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, piped.code, piped.err.c_str());
        TEST_ASSERT_EQUAL_STRING(file.out.c_str(), piped.out.c_str());
        holds(piped.err, "bases from the first 4 s: ");
    }
    const std::string longer = joint(folder, and_also(lost_flux, "duration_s=14")), plate = nameplate(folder);
    const Outcome piped = from_pipe(folder, longer, {"--machine", plate, "--json"});
    const Outcome file = monitor_command::monitor(
        {folder / "joint_24v.csv", "--machine", plate, "--json", "--out", folder / "f"});
    holds(file.out, "demagnetisation");
    TEST_ASSERT_EQUAL_STRING(file.out.c_str(), piped.out.c_str());
    TEST_ASSERT_TRUE_MESSAGE(piped.err.find("bases from") == std::string::npos, piped.err.c_str());
    holds(command::read_file(folder / "o/monitor.html"), "The magnets have lost flux (demagnetisation)");
}

// Voltages of the row before, and the angle instead of a speed, want rows ahead: none is lost at the pieces' ends.
static void rows_that_want_their_neighbours_are_the_same(void)
{
    const Folder folder;
    const std::string whole = joint(folder, and_also(lost_flux, "duration_s=4"));
    std::string moved, held = ",0,0,";
    // Row k's voltages into row k + 1.
    for (std::size_t at = whole.find('\n') + 1; at < whole.size();) {
        const std::size_t end = whole.find('\n', at), v = whole.find(',', at),
                          i = whole.find(',', whole.find(',', v + 1) + 1);
        moved += whole.substr(at, v - at) + held + whole.substr(i + 1, end + 1 - i - 1);
        held = whole.substr(v, i + 1 - v);
        at = end + 1;
    }
    moved = whole.substr(0, whole.find('\n') + 1) + moved;
    const std::string log = folder.write("previous.csv", moved);
    std::string text = command::read_file(nameplate(folder));
    text.replace(text.find("\"next\""), 6, "\"previous\"");
    const std::string toml = folder.write("previous.toml", text);
    const Outcome file = monitor_command::monitor({log, "--json", "--out", folder / "f"});
    const Outcome piped = from_pipe(folder, moved, {"--machine", toml, "--json"});
    holds(file.out, "demagnetisation");
    TEST_ASSERT_EQUAL_STRING_MESSAGE(file.out.c_str(), piped.out.c_str(), piped.err.c_str());
}

static void an_event_comes_before_the_pipe_ends_and_an_interrupt_ends_it(void)
{
    const Folder folder;
    const std::string log = joint(folder, and_also(lost_flux, "duration_s=4"));
    for (const int signal : {SIGINT, SIGTERM}) {
        Running run({"monitor", "-", "--machine", nameplate(folder), "--json", "--out", folder / "o"});
        run.give(log.substr(0, log.find("\n3.2,")));
        const std::string first = run.line();
        TEST_ASSERT_TRUE_MESSAGE(!first.empty(), "no event while the pipe is open");
        const json e = json::parse(first);
        TEST_ASSERT_EQUAL_STRING("demagnetisation", e.at("fault").get<std::string>().c_str());
        // Half a row, which is none.
        run.give("\n3.2,1");
        const auto [rest, code] = run.end(signal);
        TEST_ASSERT_EQUAL_INT(0, code);
        TEST_ASSERT_EQUAL_STRING("dqwatch.sensitivity/1", json::parse(rest).at("schema").get<std::string>().c_str());
        holds(command::read_file(folder / "o/monitor.html"), "The magnets have lost flux (demagnetisation)");
    }
}

static void rows_that_are_none_and_a_clock_that_is_set_end_nothing(void)
{
    const Folder folder;
    const std::string log = joint(folder, and_also(lost_flux, "duration_s=4"));
    const std::size_t at = log.find("\n1.5,") + 1;
    const std::string rows = log.substr(at, log.find("\n1.55,") + 1 - at);
    // A restart of the controller within its log, and noise on the line.
    const std::string dirty = log.substr(0, at) + "\x01\x02garbage\nnan,nan\n" + log.substr(log.find('\n') + 1);
    const Outcome run = from_pipe(folder, dirty, {"--machine", nameplate(folder)});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    holds(run.err, "-:30002: ");
    holds(run.err, "; left out, as are all others");
    holds(run.err, "-: 2 rows left out in all, the first at line 30002: it cannot be read");
    holds(run.err, "the clock went back by 1.5 s; the rows go on behind a gap");
    holds(run.out, "demagnetisation");
    holds(run.out, "rows     110000, 5.5 s");
    TEST_ASSERT_EQUAL_size_t(1, count(run.err, "the clock went back"));
}

static double peak_of(const Folder& folder, std::size_t rows)
{
    const std::string fifo = folder / ("fifo" + std::to_string(rows));
    TEST_ASSERT_EQUAL_INT(0, ::mkfifo(fifo.c_str(), 0600));
    std::thread writer([&] { command::write_log(fifo, rows); });
    // All that a window would tell: a long one would take more than what runs behind it.
    const std::string toml = folder.write("all.toml", "[log]\nmodulation = \"centred\"\n[machine]\npole_pairs = 4\n"
                                                      "R_ohm = 0.5\nLd_H = 2e-3\nLq_H = 3e-3\npsi_Wb = 0.05\n"
                                                      "[nameplate]\nv_V = 40\ni_A = 8\nw_m_rad_s = 160\n");
    const Outcome run = command::dqwatch({"monitor", "-", "--machine", toml, "--out", folder / "o"}, {fifo, ""}, 300);
    writer.join();
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    holds(run.out, "rows     " + std::to_string(rows));
    return run.peak_MiB;
}

static void a_last_row_that_is_cut_off_is_left_out(void)
{
    const Folder folder;
    const std::string log = joint(folder, {"duration_s=0.05"});
    const Outcome run = from_pipe(folder, log + "0.05,1,", {"--machine", nameplate(folder)});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    holds(run.err, "1 row left out");
    holds(run.err, "the log ends within it");
}

static void memory_stays_flat(void)
{
    const Folder folder;
    // 16.6 MiB; both are beyond all that is thinned.
    const double some = peak_of(folder, 2500000), many = peak_of(folder, 10000000);
    char text[80];
    std::snprintf(text, sizeof text, "%.2f MiB, then %.2f MiB", some, many);
    TEST_MESSAGE(text);
    TEST_ASSERT_TRUE_MESSAGE(many - some < 1.0 && many - some > -4.0, text);
    TEST_ASSERT_TRUE_MESSAGE(many > 8 && many < 30, text);
}

// The second run never sees a healthy flux: what it compares with is the first one's.
static void what_is_healthy_outlives_a_restart(void)
{
    const Folder folder;
    for (const char* arith : {"float", "q15"}) {
        const std::string store = folder / (std::string("store_") + arith);
        const std::string healthy = joint(folder, {"duration_s=4"}), toml = folder / "joint_24v.toml";
        const Outcome first = from_pipe(folder, healthy, {"--machine", toml, "--arith", arith, "--store", store});
        holds(first.err, "not there yet; what is healthy is learned");
        holds(first.out, "events   0");
        const std::string kept = command::read_file(store);
        holds(kept, "\"schema\":\"dqwatch.store/1\"");
        holds(kept, "\"dead_time_width_A\":");
        holds(kept, "\"speed_lag_s\":0.0");
        holds(kept, "\"voltage_error_V\":0.0");

        const std::string worn = joint(folder, {"duration_s=3", "machine.psi_Wb=0.0186"});
        // Nominal values are those of the commissioning: 20 mWb.
        const std::string same = folder.write("same.toml", std::string("[log]\nregime = \"dynamic\"\n[machine]\n") +
                                                               "pole_pairs = 4\nJ_kgm2 = 0.0003\n");
        const Outcome second = from_pipe(folder, worn,
                                         {"--machine", same, "--arith", arith, "--store", store, "--json"});
        holds(second.err, "healthy values taken from it");
        const json e = json::parse(second.out.substr(0, second.out.find('\n')));
        TEST_ASSERT_EQUAL_STRING_MESSAGE("demagnetisation", e.value("fault", "").c_str(), second.out.c_str());
        // A cold magnet has 3 % of slack (E94).
        TEST_ASSERT_DOUBLE_WITHIN(0.7e-3, 20.0e-3, e.at("healthy").get<double>());
        TEST_ASSERT_DOUBLE_WITHIN(0.1e-3, 18.6e-3, e.at("value").get<double>());
        const Outcome alone = from_pipe(folder, worn, {"--machine", same, "--arith", arith, "--json"});
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, count(alone.out, "demagnetisation"), alone.out.c_str());

        // As it stands, begun again and ended before anything was learned: the same bytes.
        folder.write("again", kept);
        const Outcome again = from_pipe(folder, worn.substr(0, worn.find("\n0.05,") + 1),
                                        {"--machine", same, "--arith", arith, "--store", folder / "again"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, again.code, again.err.c_str());
        TEST_ASSERT_EQUAL_STRING(kept.c_str(), command::read_file(folder / "again").c_str());
    }
}

static void a_store_of_nothing_is_not_written_and_says_so(void)
{
    const Folder folder;
    const std::string log = joint(folder, {"duration_s=0.5"}), toml = folder / "joint_24v.toml";
    const std::string store = folder / "store", none = ": not written, no healthy values stood before the rows ended\n";
    const Outcome brief = from_pipe(folder, log, {"--machine", toml, "--store", store});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, brief.code, brief.err.c_str());
    TEST_ASSERT_EQUAL_size_t_MESSAGE(1, count(brief.err, store + none), brief.err.c_str());
    TEST_ASSERT_NULL(std::fopen(store.c_str(), "r"));
    const Outcome enough = from_pipe(folder, joint(folder, {"duration_s=4"}), {"--machine", toml, "--store", store});
    TEST_ASSERT_EQUAL_size_t_MESSAGE(0, count(enough.err, "not written"), enough.err.c_str());
}

static void a_foreign_store_is_refused_in_one_line(void)
{
    const Folder folder;
    const std::string log = joint(folder, {"duration_s=4"}), toml = folder / "joint_24v.toml";
    const std::string store = folder / "store";
    (void)from_pipe(folder, log, {"--machine", toml, "--store", store});
    const std::string good = command::read_file(store);
    const auto refused = [&](const std::string& text, std::vector<std::string> args, const std::string& why) {
        folder.write("store", text);
        args.insert(args.begin(), {"--store", store});
        const Outcome run = from_pipe(folder, log.substr(0, log.find("\n1,") + 1), args);
        TEST_ASSERT_EQUAL_INT_MESSAGE(3, run.code, run.err.c_str());
        holds(run.err, store + ":1: ");
        holds(run.err, why);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(1, count(run.err, "\n"), run.err.c_str());
        TEST_ASSERT_EQUAL_STRING(text.c_str(), command::read_file(store).c_str());
    };
    const std::vector<std::string> usual = {"--machine", toml};
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = good;
        text.replace(text.find(from), from.size(), to);
        return text;
    };
    refused("", usual, "no store of a monitor");
    refused("{}\n", usual, "no store of a monitor");
    refused("[1]\n", usual, "no store of a monitor");
    refused(with("store/1", "store/2"), usual, "another version");
    refused(with("\"healthy\":\"02", "\"healthy\":\"03"), usual, "damaged");
    refused(good.substr(0, good.size() / 2), usual, "no store of a monitor");
    refused(good, {"--machine", toml, "--arith", "q15"}, "written with --arith float");
    refused(good, {"--machine", toml, "--pole-pairs", "7"}, "written with pole_pairs 4, now 7 is said");
    refused(good, {"--machine", toml, "--effect", "iron_loss"}, "written with other effects");
    folder.write("store", good);
    const Outcome taken = from_pipe(folder, log, {"--machine", toml, "--store", store});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, taken.code, taken.err.c_str());
}

static void a_store_that_cannot_be_written_ends_nothing(void)
{
    const Folder folder;
    const std::string log = joint(folder, and_also(lost_flux, "duration_s=4"));
    const std::string store = folder / "none/store";
    const Outcome run = from_pipe(folder, log, {"--machine", folder / "joint_24v.toml", "--store", store});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    TEST_ASSERT_EQUAL_size_t(1, count(run.err, "cannot be written: No such file or directory; watching goes on"));
    holds(run.out, "events   1");
}

int main(void)
{
    // A run that refuses its input leaves the pipe.
    (void)std::signal(SIGPIPE, SIG_IGN);
    UNITY_BEGIN();
    // First: a child's peak begins with that of its parent.
    RUN_TEST(a_last_row_that_is_cut_off_is_left_out);
    RUN_TEST(memory_stays_flat);
    RUN_TEST(a_pipe_gives_the_events_of_the_file);
    RUN_TEST(rows_that_want_their_neighbours_are_the_same);
    RUN_TEST(an_event_comes_before_the_pipe_ends_and_an_interrupt_ends_it);
    RUN_TEST(rows_that_are_none_and_a_clock_that_is_set_end_nothing);
    RUN_TEST(what_is_healthy_outlives_a_restart);
    RUN_TEST(a_store_of_nothing_is_not_written_and_says_so);
    RUN_TEST(a_foreign_store_is_refused_in_one_line);
    RUN_TEST(a_store_that_cannot_be_written_ends_nothing);
    return UNITY_END();
}
