#include "app/read/byte_source.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "app/base/input_error.hpp"
#include "app/base/interrupt.hpp"

namespace dqw {
namespace {

class File : public ByteSource {
public:
    explicit File(const std::string& path)
    {
        fd_ = path == "-" ? ::fcntl(0, F_DUPFD_CLOEXEC, 3) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY);
        if (fd_ < 0)
            throw InputError(path, 0,
                             std::string("cannot be opened: ") + std::strerror(errno) + "; expected a CSV log");
        struct stat info = {};
        if (::fstat(fd_, &info) != 0) return;
        if (S_ISDIR(info.st_mode)) {
            ::close(fd_);
            throw InputError(path, 0, "is a directory; expected a CSV log");
        }
        if (S_ISREG(info.st_mode) && info.st_size > 0) size_ = static_cast<std::uint64_t>(info.st_size);
    }
    ~File() override { ::close(fd_); }
    File(const File&) = delete;
    File& operator=(const File&) = delete;

    std::size_t read(char* to, std::size_t most) override
    {
        if (!begin_.empty()) {
            const std::size_t n = std::min(most, begin_.size());
            std::memcpy(to, begin_.data(), n);
            begin_.erase(0, n);
            return n;
        }
        if (!wait_to_read(fd_)) return 0;
        ssize_t got = 0;
        do got = ::read(fd_, to, most);
        while (got < 0 && errno == EINTR);
        if (got < 0) throw std::runtime_error(std::string("cannot be read: ") + std::strerror(errno));
        return static_cast<std::size_t>(got);
    }
    std::uint64_t size() const override { return size_; }

    /// The first bytes, which read() will give again. A pipe may give fewer at a time than a file.
    std::string_view peek(std::size_t n)
    {
        std::string bytes(n, '\0');
        std::size_t have = 0;
        while (have < n) {
            const std::size_t got = read(bytes.data() + have, n - have);
            if (got == 0) break;
            have += got;
        }
        bytes.resize(have);
        begin_ = bytes;
        return begin_;
    }

private:
    int fd_ = -1;
    std::uint64_t size_ = 0;
    std::string begin_;
};

class Gzip : public ByteSource {
public:
    explicit Gzip(std::unique_ptr<ByteSource> packed) : packed_(std::move(packed)), in_(std::size_t{1} << 16)
    {
        constexpr int gzip_alone = 16;
        if (::inflateInit2(&z_, MAX_WBITS + gzip_alone) != Z_OK) throw std::bad_alloc();
    }
    ~Gzip() override { ::inflateEnd(&z_); }
    Gzip(const Gzip&) = delete;
    Gzip& operator=(const Gzip&) = delete;

    std::size_t read(char* to, std::size_t most) override
    {
        z_.next_out = reinterpret_cast<Bytef*>(to);
        z_.avail_out = static_cast<uInt>(std::min(most, std::size_t{1} << 20));
        const uInt room = z_.avail_out;
        while (z_.avail_out == room) {
            if (z_.avail_in == 0) {
                const std::size_t got = packed_->read(in_.data(), in_.size());
                if (got == 0) {
                    if (!ended_ && !interrupted())
                        throw std::runtime_error("the gzip file is cut off; expected its end");
                    return 0;
                }
                z_.next_in = reinterpret_cast<Bytef*>(in_.data());
                z_.avail_in = static_cast<uInt>(got);
            }
            // Files may be joined: another begins behind the end of one.
            if (ended_ && ::inflateReset(&z_) != Z_OK) throw std::runtime_error("damaged gzip file");
            ended_ = false;
            const int result = ::inflate(&z_, Z_NO_FLUSH);
            ended_ = result == Z_STREAM_END;
            if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
                throw std::runtime_error("damaged gzip file");
        }
        return room - z_.avail_out;
    }

private:
    std::unique_ptr<ByteSource> packed_;
    std::vector<char> in_;
    z_stream z_ = {};
    bool ended_ = false;
};

class Zstd : public ByteSource {
public:
    explicit Zstd(std::unique_ptr<ByteSource> packed)
        : packed_(std::move(packed)), in_(::ZSTD_DStreamInSize()), z_(::ZSTD_createDStream())
    {
        if (!z_) throw std::bad_alloc();
    }
    ~Zstd() override { ::ZSTD_freeDStream(z_); }
    Zstd(const Zstd&) = delete;
    Zstd& operator=(const Zstd&) = delete;

    std::size_t read(char* to, std::size_t most) override
    {
        ZSTD_outBuffer out = {to, most, 0};
        while (out.pos == 0) {
            if (at_.pos == at_.size) {
                const std::size_t got = packed_->read(in_.data(), in_.size());
                if (got == 0) {
                    if (open_ != 0 && !interrupted())
                        throw std::runtime_error("the zstd file is cut off; expected its end");
                    return 0;
                }
                at_ = {in_.data(), got, 0};
            }
            open_ = ::ZSTD_decompressStream(z_, &out, &at_);
            if (::ZSTD_isError(open_)) throw std::runtime_error("damaged zstd file");
        }
        return out.pos;
    }

private:
    std::unique_ptr<ByteSource> packed_;
    std::vector<char> in_;
    ZSTD_DStream* z_;
    ZSTD_inBuffer at_ = {nullptr, 0, 0};
    std::size_t open_ = 1;
};

class Text : public ByteSource {
public:
    explicit Text(std::string text) : text_(std::move(text)) {}
    std::size_t read(char* to, std::size_t most) override
    {
        const std::size_t n = std::min(most, text_.size() - at_);
        std::memcpy(to, text_.data() + at_, n);
        at_ += n;
        return n;
    }

private:
    std::string text_;
    std::size_t at_ = 0;
};

struct Magic {
    std::string_view bytes;
    const char* what;
};

// Containers that other programs turn into CSV.
const Magic containers[] = {
    {"PAR1", "a Parquet file"},
    {"MDF     ", "an MDF file"},
    {"\x89HDF", "an HDF5 or MAT 7.3 file"},
    {"\x89MCAP0", "an MCAP file"},
    {"#ROSBAG", "a ROS bag"},
    {"SQLite format 3", "an SQLite file"},
    {"PK\x03\x04", "a zip or xlsx file"},
    {"MATLAB 5.0", "a MAT file"},
    {"\xfd"
     "7zXZ",
     "an xz file"},
};

}  // namespace

std::unique_ptr<ByteSource> open_bytes(const std::string& path)
{
    auto file = std::make_unique<File>(path);
    std::string begin;
    try {
        begin = file->peek(16);
    } catch (const std::runtime_error& error) {
        throw InputError(path, 1, error.what());
    }
    const auto starts = [&](std::string_view magic) { return begin.compare(0, magic.size(), magic) == 0; };
    if (starts("\x1f\x8b")) return std::make_unique<Gzip>(std::move(file));
    if (starts("\x28\xb5\x2f\xfd")) return std::make_unique<Zstd>(std::move(file));
    for (const Magic& magic : containers)
        if (starts(magic.bytes)) throw InputError(path, 1, std::string(magic.what) + "; expected CSV, export it so");
    return file;
}

std::unique_ptr<ByteSource> bytes_of(std::string text) { return std::make_unique<Text>(std::move(text)); }

}  // namespace dqw
