#include "lines.hpp"

#include <fast_float/fast_float.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace nb = nanobind;

namespace dqw::python {
namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

/// What stands behind a key of a simple object.
struct Value {
    enum class Kind { number, text, null, boolean } kind;
    double number;
    std::string_view text;
};

/// One flat object: texts of plain ASCII without escapes, numbers, true, false, null. Anything else is not simple,
/// which is no verdict: a whole reader of JSON says whether it is broken.
class Scanner {
public:
    explicit Scanner(std::string_view line) : at_(line.data()), end_(line.data() + line.size()) {}

    bool sign(char c)
    {
        space();
        if (at_ == end_ || *at_ != c) return false;
        ++at_;
        return true;
    }

    std::optional<std::string_view> text()
    {
        if (!sign('"')) return std::nullopt;
        const char* const begin = at_;
        while (at_ != end_ && *at_ != '"') {
            const auto c = static_cast<unsigned char>(*at_++);
            if (c < 0x20 || c >= 0x7f || c == '\\') return std::nullopt;
        }
        if (at_ == end_) return std::nullopt;
        return std::string_view(begin, static_cast<std::size_t>(at_++ - begin));
    }

    std::optional<Value> value()
    {
        space();
        if (at_ == end_) return std::nullopt;
        if (*at_ == '"') {
            const auto found = text();
            if (!found) return std::nullopt;
            return Value{Value::Kind::text, nothing, *found};
        }
        if (word("null")) return Value{Value::Kind::null, nothing, {}};
        if (word("true") || word("false")) return Value{Value::Kind::boolean, nothing, {}};
        return number();
    }

    bool ended()
    {
        space();
        return at_ == end_;
    }

private:
    void space()
    {
        while (at_ != end_ && (*at_ == ' ' || *at_ == '\t' || *at_ == '\r')) ++at_;
    }

    bool word(std::string_view word)
    {
        if (static_cast<std::size_t>(end_ - at_) < word.size() || std::string_view(at_, word.size()) != word)
            return false;
        at_ += word.size();
        return true;
    }

    const char* digits(const char* p) const
    {
        while (p != end_ && *p >= '0' && *p <= '9') ++p;
        return p;
    }

    /// As JSON writes numbers: fast_float alone takes "01" and "1." as well.
    std::optional<Value> number()
    {
        const char* p = at_;
        if (*p == '-') ++p;
        const char* const whole = p;
        p = digits(p);
        if (p == whole || (*whole == '0' && p - whole > 1)) return std::nullopt;
        if (p != end_ && *p == '.') {
            const char* const part = ++p;
            p = digits(p);
            if (p == part) return std::nullopt;
        }
        if (p != end_ && (*p == 'e' || *p == 'E')) {
            if (++p != end_ && (*p == '+' || *p == '-')) ++p;
            const char* const power = p;
            p = digits(p);
            if (p == power) return std::nullopt;
        }
        double number = 0.0;
        const auto got = fast_float::from_chars(at_, p, number);
        if (got.ec != std::errc() || got.ptr != p) return std::nullopt;
        at_ = p;
        return Value{Value::Kind::number, number, {}};
    }

    const char *at_, *end_;
};

/// A column of a row: the field it comes from, value · scale + offset, and what it may be at most.
struct Column {
    std::string field;
    double scale, offset, most;
    bool needed;
};

class JsonRows {
public:
    using Given = std::vector<std::tuple<std::string, double, double, double, bool>>;

    /// `motor`: whose rows they are; empty: the text behind `key` says it.
    JsonRows(const Given& columns, std::string key, std::string motor, double most_raw)
        : key_(std::move(key)), motor_(std::move(motor)), most_raw_(most_raw)
    {
        for (const auto& [field, scale, offset, most, needed] : columns)
            columns_.push_back({field, scale, offset, most, needed});
        row_.resize(columns_.size());
    }

    /// Takes lines from `from` on; where it stopped: at the end, or at a line that it does not take.
    std::size_t take(const nb::bytes& data, std::size_t from)
    {
        const std::string_view all(static_cast<const char*>(data.data()), data.size());
        while (from < all.size()) {
            const std::size_t end = std::min(all.find('\n', from), all.size());
            const std::string_view line = all.substr(from, end - from);
            if (line.find_first_not_of(" \t\r") != std::string_view::npos && !take_line(line)) return from;
            from = end + 1;
        }
        return all.size();
    }

    /// The rows since the last time: motor, and its rows one after the other.
    nb::list give()
    {
        nb::list out;
        for (const auto& [name, rows] : rows_)
            out.append(nb::make_tuple(nb::str(name.data(), name.size()),
                                      nb::bytes(rows.data(), rows.size() * sizeof(double))));
        rows_.clear();
        return out;
    }

private:
    bool take_line(std::string_view line)
    {
        Scanner scan(line);
        for (double& x : row_) x = nothing;
        std::optional<std::string_view> name;
        if (!motor_.empty()) name = motor_;
        if (!scan.sign('{')) return false;
        do {
            const auto key = scan.text();
            if (!key || !scan.sign(':')) return false;
            const auto value = scan.value();
            if (!value || !take_value(*key, *value, name)) return false;
        } while (scan.sign(','));
        if (!scan.sign('}') || !scan.ended() || !name) return false;
        for (std::size_t k = 0; k < columns_.size(); ++k)
            if (columns_[k].needed && std::isnan(row_[k])) return false;
        auto found = rows_.find(*name);
        if (found == rows_.end()) found = rows_.emplace(*name, std::vector<double>()).first;
        found->second.insert(found->second.end(), row_.begin(), row_.end());
        return true;
    }

    bool take_value(std::string_view key, const Value& value, std::optional<std::string_view>& name)
    {
        if (motor_.empty() && key == key_) {
            if (value.kind != Value::Kind::text) return false;
            name = value.text;
        }
        for (std::size_t k = 0; k < columns_.size(); ++k) {
            const Column& c = columns_[k];
            if (key != c.field) continue;
            if (value.kind == Value::Kind::null) {
                row_[k] = nothing;
                continue;
            }
            if (value.kind != Value::Kind::number || !(std::fabs(value.number) < most_raw_)) return false;
            row_[k] = value.number * c.scale + c.offset;
            if (!(std::fabs(row_[k]) < c.most)) return false;
        }
        return true;
    }

    std::vector<Column> columns_;
    const std::string key_, motor_;
    const double most_raw_;
    std::vector<double> row_;
    std::map<std::string, std::vector<double>, std::less<>> rows_;
};

}  // namespace

void bind_lines(nb::module_& m)
{
    nb::class_<JsonRows>(m, "JsonRows")
        .def(nb::init<const JsonRows::Given&, std::string, std::string, double>())
        .def("take", &JsonRows::take)
        .def("give", &JsonRows::give);
}

}  // namespace dqw::python
