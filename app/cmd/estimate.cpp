#include "app/cmd/estimate.hpp"

#include <optional>

#include "app/base/output.hpp"
#include "app/job/estimate.hpp"

namespace dqw {
namespace {

int tell(const std::string& name, const Estimation& e, const Options& options)
{
    const std::string json = estimation_json(e);
    const Result& result = e.estimated.result;
    std::optional<OutputFolder> folder;
    if (options.out_given) {
        folder.emplace(options.out_dir);
        folder->write(name + ".json", json);
        if (!e.estimated.q15_config.empty()) folder->write("dqw_q15_config.h", e.estimated.q15_config);
    }
    print_notes(result.notes);
    if (folder) folder->tell();
    print(options.json ? json : estimation_text(e));
    return result.not_identifiable.empty() ? exit_done : exit_not_identifiable;
}

}  // namespace

int learn_command(const Options& options) { return tell("learn", learn_logs(options), options); }

int fit_command(const Options& options) { return tell("fit", fit_logs(options), options); }

}  // namespace dqw
