#include "app/read/survey.hpp"

namespace dqw {

std::string how_to_give(const std::string& need)
{
    if (need == "pole pairs") return "pole pairs: --pole-pairs N, or pole_pairs under [machine]";
    if (need == "gear") return "gear, turns of the rotor for one of the output: --gear N, or gear under [machine]";
    if (need == "v_dc") return "voltage of the DC link: --v-dc V, or v_dc_V under [machine]";
    if (need == "period") return "seconds from row to row: --period S, or period_s under [log]";
    return need;
}

void count_left_out(std::vector<LeftOut>& all, const std::string& why, std::size_t line)
{
    for (LeftOut& reason : all)
        if (reason.why == why) {
            ++reason.rows;
            return;
        }
    all.push_back({why, 1, line});
}

}  // namespace dqw
