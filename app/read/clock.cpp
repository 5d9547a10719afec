#include "app/read/clock.hpp"

#include "app/base/text.hpp"
#include "app/read/csv.hpp"

namespace dqw {
namespace {

bool take_number(std::string_view& text, std::size_t digits, int most, int& value)
{
    if (text.size() < digits) return false;
    value = 0;
    for (std::size_t k = 0; k < digits; ++k) {
        if (text[k] < '0' || text[k] > '9') return false;
        value = 10 * value + (text[k] - '0');
    }
    text.remove_prefix(digits);
    return value <= most;
}

bool take(std::string_view& text, char c)
{
    if (text.empty() || text.front() != c) return false;
    text.remove_prefix(1);
    return true;
}

/// Days since 1970 of the Gregorian calendar.
long days_of(int year, int month, int day)
{
    const long y = month > 2 ? year : year - 1;
    const long months_from_march = (month + 9) % 12;
    return 365 * y + y / 4 - y / 100 + y / 400 + (153 * months_from_march + 2) / 5 + day - 1 - 719468;
}

}  // namespace

bool parse_clock(std::string_view field, double& t_s)
{
    std::string_view text = trimmed(field);
    double day_s = 0;
    int year = 0, month = 0, day = 0;
    if (text.size() > 10 && text[4] == '-') {
        if (!take_number(text, 4, 9999, year) || !take(text, '-') || !take_number(text, 2, 12, month) ||
            !take(text, '-') || !take_number(text, 2, 31, day) || month < 1 || day < 1)
            return false;
        if (!take(text, 'T') && !take(text, ' ')) return false;
        day_s = 86400.0 * static_cast<double>(days_of(year, month, day));
    }
    int hour = 0, minute = 0;
    if (!take_number(text, 2, 24, hour) || !take(text, ':') || !take_number(text, 2, 59, minute) || !take(text, ':'))
        return false;
    double zone_s = 0;
    // An offset stands behind the seconds, which have no sign of their own.
    const auto zone = text.find_first_of("+-Z");
    if (zone != text.npos) {
        std::string_view offset = text.substr(zone);
        text = text.substr(0, zone);
        const double sign = offset.front() == '-' ? -1 : 1;
        const bool utc = offset == "Z";
        offset.remove_prefix(1);
        int h = 0, m = 0;
        if (!utc && (!take_number(offset, 2, 14, h) || (take(offset, ':'), !take_number(offset, 2, 59, m))))
            return false;
        zone_s = sign * (3600.0 * h + 60.0 * m);
    }
    double second = 0;
    if (parse_number(text, second) != NumberError::none || second < 0 || second >= 61) return false;
    t_s = day_s + 3600.0 * hour + 60.0 * minute + second - zone_s;
    return true;
}

}  // namespace dqw
