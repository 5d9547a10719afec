// The command dqwatch: parses the command line, runs one subcommand, turns every failure into one line and an exit
// code.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <new>

#include "app/base/output.hpp"
#include "app/base/text.hpp"
#include "app/cmd/command.hpp"
#include "app/cmd/compare.hpp"
#include "app/cmd/demo.hpp"
#include "app/cmd/estimate.hpp"
#include "app/cmd/monitor.hpp"
#include "app/cmd/paper.hpp"
#include "app/cmd/sim.hpp"
#include "app/cmd/trace.hpp"

namespace {

constexpr const char* version = "dqwatch 0.2.0";

/// A file opened while 0, 1 or 2 is closed would get that number, and with it what is meant for the terminal.
void hold_standard_streams()
{
    for (int fd = 0; fd <= 2; ++fd)
        // The wrong way round on purpose for 0 and 1: reading or printing then fails, as on a closed stream.
        if (::fcntl(fd, F_GETFD) == -1 && errno == EBADF) (void)::open("/dev/null", fd == 1 ? O_RDONLY : O_WRONLY);
}

int run(int argc, char** argv)
{
    CLI::App app("dqwatch learns the parameters of a permanent-magnet motor, and checks them against a reference fit.",
                 "dqwatch");
    app.set_version_flag("--version", version);
    app.require_subcommand(1);
    const std::vector<dqw::Command> commands = {dqw::add_paper(app),   dqw::add_sim(app),   dqw::add_learn(app),
                                                dqw::add_fit(app),     dqw::add_trace(app), dqw::add_compare(app),
                                                dqw::add_monitor(app), dqw::add_demo(app)};
    // The parser would only say that a subcommand is missing.
    const std::string first = argc > 1 ? argv[1] : "-";
    const auto is_first = [&](const dqw::Command& c) { return c.app->get_name() == first; };
    if (first[0] != '-' && std::none_of(commands.begin(), commands.end(), is_first))
        throw dqw::UsageError("no subcommand " + dqw::shown(first) + "; see dqwatch --help");
    app.footer("Exit codes: 0 done; 1 anything else; 2 wrong usage; 3 input unreadable or invalid; 4 a parameter asked "
               "for is not identifiable.");
    try {
        app.parse(argc, argv);
    } catch (const CLI::CallForHelp&) {
        const auto chosen = app.get_subcommands();
        dqw::print(chosen.empty() ? app.help() : chosen.front()->help());
        return dqw::exit_done;
    } catch (const CLI::CallForVersion&) {
        dqw::print(std::string(version) + "\n");
        return dqw::exit_done;
    } catch (const CLI::ParseError& error) {
        throw dqw::UsageError(std::string(error.what()) + "; see dqwatch --help");
    }
    for (const auto& command : commands)
        if (command.app->parsed()) return command.run();
    return dqw::exit_usage;
}

}  // namespace

int main(int argc, char** argv)
{
    hold_standard_streams();
    try {
        return run(argc, argv);
    } catch (const dqw::InputError& error) {
        // It begins with FILE:LINE, which editors jump to.
        dqw::complain(error.what());
        return dqw::exit_input;
    } catch (const dqw::UsageError& error) {
        dqw::complain(std::string("dqwatch: ") + error.what());
        return dqw::exit_usage;
    } catch (const std::bad_alloc&) {
        dqw::complain("dqwatch: out of memory");
    } catch (const std::exception& error) {
        dqw::complain(std::string("dqwatch: ") + error.what());
    } catch (...) {
        dqw::complain("dqwatch: unknown failure");
    }
    return dqw::exit_other;
}
