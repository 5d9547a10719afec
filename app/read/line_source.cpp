#include "app/read/line_source.hpp"

#include <cstring>
#include <stdexcept>

#include "app/base/input_error.hpp"
#include "app/base/interrupt.hpp"

namespace dqw {

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
    std::size_t got = 0;
    try {
        got = bytes_->read(buffer_.data() + end_, buffer_.size() - end_);
    } catch (const std::runtime_error& error) {
        throw InputError(path_, line_ + 1, error.what());
    }
    at_end_ = got == 0;
    end_ += got;
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
    // What an interrupt cuts off is no line.
    if (!lf && (begin_ == end_ || interrupted())) return false;
    std::size_t length = lf ? static_cast<std::size_t>(lf - first) : end_ - begin_;
    const std::size_t used = length + (lf ? 1 : 0);
    unended_ = !lf;
    begin_ += used;
    consumed_ += used;
    ++line_;
    if (length > 0 && first[length - 1] == '\r') --length;
    line = std::string_view(first, length);
    return true;
}

bool LineSource::ready() const
{
    return at_end_ || (end_ > begin_ && std::memchr(buffer_.data() + begin_, '\n', end_ - begin_) != nullptr);
}

std::string LineSource::rest(std::size_t most_bytes)
{
    std::string text;
    do {
        text.append(buffer_.data() + begin_, end_ - begin_);
        consumed_ += end_ - begin_;
        begin_ = end_;
        if (text.size() > most_bytes)
            throw InputError(path_, line_ + 1, "more than " + std::to_string(most_bytes >> 20) + " MiB of JSON");
    } while (fill());
    return text;
}

}  // namespace dqw
