// The command line: all subcommands with their options and help texts. CLI11 stays in here.
#ifndef DQW_APP_CMD_PARSER_HPP
#define DQW_APP_CMD_PARSER_HPP

namespace dqw {

/// Parses the command line and runs what it asks for. Returns an exit code; throws UsageError, and whatever the
/// subcommand throws.
int run_command_line(int argc, char** argv);

}  // namespace dqw
#endif
