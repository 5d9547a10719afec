#include "app/cmd/paper.hpp"

#include <memory>

#include "app/base/output.hpp"
#include "app/paper/paper.hpp"

namespace dqw {

Command add_paper(CLI::App& app)
{
    CLI::App* command = app.add_subcommand("paper", "reproduce the paper's tables and figures beside its numbers");
    auto options = std::make_shared<CommonOptions>();
    add_common(*command, *options);
    return {command, [=]() -> int {
                if (options->pole_pairs || !options->machine_file.empty())
                    print_notes({"paper: the paper's machine is simulated; --pole-pairs and --machine change nothing"});
                make_directory(options->out_dir);
                return run_paper(options->out_dir, options->json);
            }};
}

}  // namespace dqw
