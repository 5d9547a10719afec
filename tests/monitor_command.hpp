// What the tests of `monitor` share: runs of it, and logs to feed it.
#ifndef DQW_TESTS_MONITOR_COMMAND_HPP
#define DQW_TESTS_MONITOR_COMMAND_HPP

#include <string>
#include <vector>

#include "command.hpp"
#include "unity.h"

namespace monitor_command {

inline void holds(const std::string& text, const std::string& part)
{
    TEST_ASSERT_TRUE_MESSAGE(text.find(part) != std::string::npos, (part + " in " + text.substr(0, 2000)).c_str());
}

inline std::size_t count(const std::string& text, const std::string& part)
{
    std::size_t n = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++n;
    return n;
}

inline command::Outcome monitor(std::vector<std::string> args)
{
    args.insert(args.begin(), "monitor");
    const command::Outcome run = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    return run;
}

/// The plain machine's log, some noise on its voltages.
inline std::string noisy(std::size_t rows)
{
    const command::Machine machine;
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    unsigned state = 1;
    const auto noise = [&] {
        return 0.2 * (static_cast<double>((state = state * 1664525u + 1013904223u) >> 8) / 16777216.0 - 0.5);
    };
    for (std::size_t k = 0; k < rows; ++k) {
        const command::Machine::Row r = machine.row(k);
        char line[200];
        std::snprintf(line, sizeof line, "%.6f,%.7g,%.7g,%.7g,%.7g,%.7g\n", static_cast<double>(k) * machine.dt_s,
                      r.v_d_V + noise(), r.v_q_V + noise(), r.i_d_A, r.i_q_A, r.w_m_rad_s);
        text += line;
    }
    return text;
}

}  // namespace monitor_command
#endif
