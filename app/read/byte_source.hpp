// Bytes of a file, a pipe or a text in memory, unpacked where they are packed.
#ifndef DQW_APP_READ_BYTE_SOURCE_HPP
#define DQW_APP_READ_BYTE_SOURCE_HPP

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace dqw {

/// Throws std::runtime_error with what is wrong.
class ByteSource {
public:
    virtual ~ByteSource() = default;
    /// At most `most` bytes into `to`; 0 at the end, and where an interrupt that is caught came.
    virtual std::size_t read(char* to, std::size_t most) = 0;
    /// Size of a regular file that is not packed; 0 of all else.
    virtual std::uint64_t size() const { return 0; }
};

/// Opens `path`, "-" for standard input; gzip and zstd are told by their first bytes. Files that are no text are
/// refused by the name of what they are; throws InputError.
std::unique_ptr<ByteSource> open_bytes(const std::string& path);

/// Bytes of `text`.
std::unique_ptr<ByteSource> bytes_of(std::string text);

}  // namespace dqw
#endif
