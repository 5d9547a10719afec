#include "app/cmd/estimate.hpp"

#include "app/base/output.hpp"
#include "app/job/estimate.hpp"

namespace dqw {
namespace {

int tell(const std::string& name, const Estimation& e, const Options& options)
{
    const std::string json = estimation_json(e);
    if (options.out_given) {
        make_directory(options.out_dir);
        write_file(path_in(options.out_dir, name + ".json"), json);
        if (!e.estimated.q15_config.empty())
            write_file(path_in(options.out_dir, "dqw_q15_config.h"), e.estimated.q15_config);
    }
    const Result& result = e.estimated.result;
    print_notes(result.notes);
    print(options.json ? json : estimation_text(e));
    return result.not_identifiable.empty() ? exit_done : exit_not_identifiable;
}

}  // namespace

int learn_command(const Options& options) { return tell("learn", learn_logs(options), options); }

int fit_command(const Options& options) { return tell("fit", fit_logs(options), options); }

}  // namespace dqw
