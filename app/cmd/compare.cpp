#include "app/cmd/compare.hpp"

#include <nlohmann/json.hpp>

#include "app/base/output.hpp"
#include "app/job/compare.hpp"
#include "app/read/flux_map.hpp"
#include "app/report/compare.hpp"
#include "app/report/compare_maps.hpp"
#include "app/report/report.hpp"
#include "app/trace/maps_page.hpp"

namespace dqw {
int compare_command(const Options& options)
{
    const bool maps = !options.maps.empty();
    if (maps == !options.logs.front().empty())
        throw UsageError("compare: LOG.csv, or --map with two flux maps, and not both; --help says more");
    if (maps) {
        const FluxMap first = read_flux_map(options.maps[0]), second = read_flux_map(options.maps[1]);
        const MapComparison c = compare_maps(first, second);
        OutputFolder folder(options.out_dir);
        folder.write("compare.html", maps_page({options.maps[0], options.maps[1]}, first, second));
        folder.tell();
        print(options.json ? json_text(compare_maps_json(c)) : compare_maps_text(c));
        return exit_done;
    }
    ToCompare what = log_to_compare(options);
    OutputFolder folder(options.out_dir);
    const Comparison c = compare_log(std::move(what), options);
    folder.write("compare.html", compare_page(c));
    print_notes(c.notes);
    folder.tell();
    print(options.json ? json_text(compare_json(c)) : compare_text(c));
    const bool known = c.single.not_identifiable.empty() && c.fixed.not_identifiable.empty() &&
                       c.reference.not_identifiable.empty();
    return known ? exit_done : exit_not_identifiable;
}

}  // namespace dqw
