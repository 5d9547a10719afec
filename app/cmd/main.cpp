// The command dqwatch: turns every failure into one line and an exit code.
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <new>

#include "app/base/input_error.hpp"
#include "app/base/output.hpp"
#include "app/cmd/command.hpp"
#include "app/cmd/parser.hpp"

namespace {

/// A file opened while 0, 1 or 2 is closed would get that number, and with it what is meant for the terminal.
void hold_standard_streams()
{
    for (int fd = 0; fd <= 2; ++fd)
        // The wrong way round on purpose for 0 and 1: reading or printing then fails, as on a closed stream.
        if (::fcntl(fd, F_GETFD) == -1 && errno == EBADF) (void)::open("/dev/null", fd == 1 ? O_RDONLY : O_WRONLY);
}

}  // namespace

int main(int argc, char** argv)
{
    hold_standard_streams();
    try {
        return dqw::run_command_line(argc, argv);
    } catch (const dqw::InputError& error) {
        // It begins with FILE:LINE, which editors jump to.
        dqw::complain(error.what());
        return dqw::exit_input;
    } catch (const dqw::ValueError& error) {
        dqw::complain(std::string("dqwatch: ") + error.what());
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
