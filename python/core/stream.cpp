#include <algorithm>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/base/input_error.hpp"
#include "block.hpp"
#include "error.hpp"
#include "table.hpp"

namespace nb = nanobind;

// The layout that the Arrow C data interface fixes.
extern "C" {
struct ArrowSchema {
    const char *format, *name, *metadata;
    std::int64_t flags, n_children;
    struct ArrowSchema **children, *dictionary;
    void (*release)(struct ArrowSchema*);
    void* private_data;
};
struct ArrowArray {
    std::int64_t length, null_count, offset, n_buffers, n_children;
    const void** buffers;
    struct ArrowArray **children, *dictionary;
    void (*release)(struct ArrowArray*);
    void* private_data;
};
struct ArrowArrayStream {
    int (*get_schema)(struct ArrowArrayStream*, struct ArrowSchema* out);
    int (*get_next)(struct ArrowArrayStream*, struct ArrowArray* out);
    const char* (*get_last_error)(struct ArrowArrayStream*);
    void (*release)(struct ArrowArrayStream*);
    void* private_data;
};
}

namespace dqw::python {
namespace {

/// A thing of the interface, released once.
template <class T> struct Held : T {
    Held() : T() {}
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    ~Held() { drop(); }
    void drop()
    {
        if (this->release) this->release(this);
        this->release = nullptr;
    }
};

/// Bytes of a value, and its copy; of a truth value 0 bytes.
struct Type {
    Copy copy = nullptr;
    std::ptrdiff_t bytes = 0;
    bool bits = false;
    std::string none;  ///< what it is where it is no number; a truth value is still read, for a status
};

template <class T> Type number() { return {copy<T>, sizeof(T), false, ""}; }

Type type_of(const ArrowSchema& s)
{
    const std::string format = s.format;
    if (s.dictionary) return {nullptr, 0, false, "dictionary"};
    if (format == "g") return number<double>();
    if (format == "f") return number<float>();
    if (format == "l") return number<std::int64_t>();
    if (format == "L") return number<std::uint64_t>();
    if (format == "i") return number<std::int32_t>();
    if (format == "I") return number<std::uint32_t>();
    if (format == "s") return number<std::int16_t>();
    if (format == "S") return number<std::uint16_t>();
    if (format == "c") return number<std::int8_t>();
    if (format == "C") return number<std::uint8_t>();
    if (format == "b") return {nullptr, 0, true, "bool"};
    if (format == "u" || format == "U" || format == "vu") return {nullptr, 0, false, "string"};
    if (format == "n") return {nullptr, 0, false, "null"};
    if (format == "e") return {nullptr, 0, false, "float16"};
    if (format[0] == 'd') return {nullptr, 0, false, "decimal"};
    if (format[0] == 't') return {nullptr, 0, false, "time (expected seconds as numbers)"};
    return {nullptr, 0, false, "\"" + format + "\" of Arrow"};
}

bool bit(const void* bits, std::int64_t at)
{
    return (static_cast<const std::uint8_t*>(bits)[at / 8] >> (at % 8) & 1) != 0;
}

class Stream : public Blocks {
public:
    Stream(const nb::object& capsule, std::size_t rows) : rows_(rows)
    {
        auto* given = static_cast<ArrowArrayStream*>(PyCapsule_GetPointer(capsule.ptr(), "arrow_array_stream"));
        if (!given) throw nb::python_error();
        if (!given->release) raise_usage("this Arrow stream is closed: it was read before; expected a fresh one");
        // Taken over, as the interface has it.
        static_cast<ArrowArrayStream&>(stream_) = *given;
        given->release = nullptr;
        Held<ArrowSchema> schema;
        {
            const nb::gil_scoped_release release;
            if (stream_.get_schema(&stream_, &schema) != 0) throw std::runtime_error(trouble());
        }
        if (std::string(schema.format) != "+s") raise_usage("this Arrow stream has no columns; expected a table's");
        for (std::int64_t f = 0; f < schema.n_children; ++f) {
            fields_.emplace_back(schema.children[f]->name ? schema.children[f]->name : "");
            types_.push_back(type_of(*schema.children[f]));
        }
    }

    const std::vector<std::string>& fields() const override { return fields_; }
    std::size_t rows() const override { return rows_; }
    std::string no_numbers(std::size_t field) const override { return types_[field].none; }

protected:
    std::size_t fill(double* block) override
    {
        while (!batch_.release || at_ == batch_.length) {
            batch_.drop();
            if (stream_.get_next(&stream_, &batch_) != 0) throw std::runtime_error(trouble());
            if (!batch_.release) return 0;
            if (batch_.n_children != static_cast<std::int64_t>(fields_.size()))
                throw std::runtime_error("an Arrow stream whose batches are unlike its schema");
            at_ = 0;
        }
        const auto n = std::min(static_cast<std::int64_t>(most_rows), batch_.length - at_);
        for (std::size_t f = 0; f < fields_.size(); ++f)
            column(*batch_.children[f], types_[f], batch_.offset + at_, n, block + f);
        at_ += n;
        return static_cast<std::size_t>(n);
    }

private:
    std::string trouble()
    {
        const char* what = stream_.get_last_error(&stream_);
        return std::string("the Arrow stream cannot be read: ") + (what ? what : "it says no more");
    }

    void column(const ArrowArray& a, const Type& type, std::int64_t from, std::int64_t n, double* to) const
    {
        const std::size_t step = fields_.size();
        const auto rows = static_cast<std::size_t>(n);
        from += a.offset;
        if (type.copy) {
            type.copy(static_cast<const char*>(a.buffers[1]) + from * type.bytes, type.bytes, rows, to, step);
        } else {
            for (std::size_t r = 0; r < rows; ++r)
                to[r * step] = type.bits ? static_cast<double>(bit(a.buffers[1], from + static_cast<std::int64_t>(r)))
                                         : std::numeric_limits<double>::quiet_NaN();
        }
        if ((!type.copy && !type.bits) || a.null_count == 0 || !a.buffers[0]) return;
        for (std::size_t r = 0; r < rows; ++r)
            if (!bit(a.buffers[0], from + static_cast<std::int64_t>(r)))
                to[r * step] = std::numeric_limits<double>::quiet_NaN();
    }

    Held<ArrowArrayStream> stream_;
    Held<ArrowArray> batch_;
    std::vector<std::string> fields_;
    std::vector<Type> types_;
    std::size_t rows_;
    std::int64_t at_ = 0;
};

}  // namespace

Table table_of_stream(const nb::object& capsule, std::size_t rows)
{
    try {
        return std::make_shared<Stream>(capsule, rows);
    } catch (...) {
        raise_current();
    }
}

}  // namespace dqw::python
