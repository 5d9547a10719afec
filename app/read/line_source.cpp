#include "app/read/line_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "app/base/input_error.hpp"

namespace dqw {

LineSource::LineSource(const std::string& path) : path_(path)
{
    fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY);
    if (fd_ < 0)
        throw InputError(path_, 0, std::string("cannot be opened: ") + std::strerror(errno) + "; expected a CSV log");
    struct stat info = {};
    if (::fstat(fd_, &info) == 0) {
        if (S_ISDIR(info.st_mode)) {
            ::close(fd_);
            throw InputError(path_, 0, "is a directory; expected a CSV log");
        }
        if (S_ISREG(info.st_mode) && info.st_size > 0) file_bytes_ = static_cast<std::uint64_t>(info.st_size);
    }
    buffer_.resize(std::size_t{1} << 18);
}

LineSource::~LineSource() { ::close(fd_); }

bool LineSource::fill()
{
    if (at_end_) return false;
    if (begin_ > 0) {
        std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
        end_ -= begin_;
        begin_ = 0;
    }
    if (end_ == buffer_.size()) {
        if (buffer_.size() >= longest_line_bytes)
            throw InputError(path_, line_ + 1, "a line of more than 1 MiB; expected a CSV text file");
        buffer_.resize(buffer_.size() * 2);
    }
    ssize_t got = 0;
    do got = ::read(fd_, buffer_.data() + end_, buffer_.size() - end_);
    while (got < 0 && errno == EINTR);
    if (got < 0) throw InputError(path_, line_ + 1, std::string("cannot be read: ") + std::strerror(errno));
    at_end_ = got == 0;
    end_ += static_cast<std::size_t>(got);
    return !at_end_;
}

bool LineSource::next(std::string_view& line)
{
    std::size_t searched = 0;  // bytes from begin_ that hold no LF
    const char* lf = nullptr;
    for (;;) {
        if (end_ > begin_ + searched)
            lf = static_cast<const char*>(
                std::memchr(buffer_.data() + begin_ + searched, '\n', end_ - begin_ - searched));
        if (lf) break;
        searched = end_ - begin_;
        if (!fill()) break;
    }
    const char* first = buffer_.data() + begin_;
    if (!lf && begin_ == end_) return false;
    std::size_t length = lf ? static_cast<std::size_t>(lf - first) : end_ - begin_;
    const std::size_t used = length + (lf ? 1 : 0);
    begin_ += used;
    consumed_ += used;
    ++line_;
    if (length > 0 && first[length - 1] == '\r') --length;
    line = std::string_view(first, length);
    return true;
}

}  // namespace dqw
