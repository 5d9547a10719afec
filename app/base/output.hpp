// Everything that dqwatch writes, with every failure reported.
#ifndef DQW_APP_BASE_OUTPUT_HPP
#define DQW_APP_BASE_OUTPUT_HPP

#include <cstdio>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace dqw {

/// Something could not be written: exit code 1, one line.
struct OutputError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A file being written. Without close() it was not finished, and is removed.
class OutputFile {
public:
    explicit OutputFile(const std::string& path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;
    void write(std::string_view text);
    /// Flushes and closes; throws where the disk was full.
    void close();

private:
    [[noreturn]] void fail(const char* what);
    std::string path_;
    std::FILE* file_ = nullptr;
};

/// Writes a whole file.
void write_file(const std::string& path, std::string_view text);

/// A command's folder. Made before the work, so that what cannot be written is said first; tells what it wrote.
class OutputFolder {
public:
    explicit OutputFolder(std::string dir);
    void write(const std::string& name, std::string_view text);
    /// One note on stderr of all that was written; none where nothing was.
    void tell() const;

private:
    std::string dir_;
    std::vector<std::string> written_;
};

/// Creates `dir` and its parents where they are missing.
void make_directory(const std::string& dir);

/// dir/name; just the name where dir is ".".
std::string path_in(const std::string& dir, const std::string& name);

/// Writes to stdout and flushes; throws OutputError.
void print(std::string_view text);

/// One line on stderr; control characters replaced, so that it stays one.
void complain(std::string_view text);

/// Notes and warnings on stderr, one line each, "note: " before those that are no warning.
void print_notes(const std::vector<std::string>& notes);

}  // namespace dqw
#endif
