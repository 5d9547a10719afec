// What every reader of user files throws.
#ifndef DQW_APP_BASE_INPUT_ERROR_HPP
#define DQW_APP_BASE_INPUT_ERROR_HPP

#include <cstddef>
#include <stdexcept>
#include <string>

namespace dqw {

/// A file that cannot be read or is invalid: exit code 3, one line `FILE:LINE: what is wrong and what was expected`.
/// `line` counts from 1; 0 where there is no line to point at (the file cannot be opened).
struct InputError : std::runtime_error {
    InputError(const std::string& file_, std::size_t line_, const std::string& what_)
        : std::runtime_error(file_ + ":" + std::to_string(line_) + ": " + what_), file(file_), line(line_)
    {
    }
    std::string file;
    std::size_t line;
};

}  // namespace dqw
#endif
