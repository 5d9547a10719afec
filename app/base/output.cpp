#include "app/base/output.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "app/base/text.hpp"

namespace dqw {

OutputFile::OutputFile(const std::string& path) : path_(path), file_(std::fopen(path.c_str(), "wb"))
{
    if (!file_) fail("cannot be written");
}

OutputFile::~OutputFile()
{
    if (!file_) return;
    std::fclose(file_);
    std::remove(path_.c_str());
}

void OutputFile::fail(const char* what)
{
    throw OutputError(fmt::format("{}: {}: {}", path_, what, std::strerror(errno)));
}

void OutputFile::write(std::string_view text)
{
    if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) fail("cannot be written");
}

void OutputFile::close()
{
    if (std::fflush(file_) != 0) fail("cannot be written");
    std::FILE* file = file_;
    file_ = nullptr;
    if (std::fclose(file) != 0) fail("cannot be written");
}

void write_file(const std::string& path, std::string_view text)
{
    OutputFile file(path);
    file.write(text);
    file.close();
}

void make_directory(const std::string& dir)
{
    std::error_code error;
    std::filesystem::create_directories(dir, error);
    // An existing folder is no error; an existing file is.
    if (!error && !std::filesystem::is_directory(dir, error) && !error)
        error = std::make_error_code(std::errc::not_a_directory);
    if (error) throw OutputError(fmt::format("{}: cannot be made a folder: {}", dir, error.message()));
}

OutputFolder::OutputFolder(std::string dir) : dir_(std::move(dir)) { make_directory(dir_); }

void OutputFolder::write(const std::string& name, std::string_view text)
{
    written_.push_back(path_in(dir_, name));
    write_file(written_.back(), text);
}

void OutputFolder::tell() const
{
    if (!written_.empty()) complain("note: wrote " + list(written_));
}

std::string path_in(const std::string& dir, const std::string& name)
{
    return dir == "." ? name : (std::filesystem::path(dir) / name).string();
}

void print(std::string_view text)
{
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
        throw OutputError(fmt::format("stdout cannot be written: {}", std::strerror(errno)));
}

void complain(std::string_view text)
{
    std::string line(text);
    for (char& c : line)
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
    line += '\n';
    // Nowhere left to report a failure of stderr itself.
    (void)!std::fwrite(line.data(), 1, line.size(), stderr);
}

void print_notes(const std::vector<std::string>& notes)
{
    for (const auto& note : notes) complain(note.compare(0, 9, "warning: ") == 0 ? note : "note: " + note);
}

}  // namespace dqw
