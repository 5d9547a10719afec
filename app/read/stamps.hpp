// Stamps of rows: they increase, and a clock of the day goes on behind midnight.
#ifndef DQW_APP_READ_STAMPS_HPP
#define DQW_APP_READ_STAMPS_HPP

#include <cmath>
#include <cstddef>

namespace dqw {

class Stamps {
public:
    /// False where the stamp is not after the last one, which then stays.
    bool take(double t_s, std::size_t line)
    {
        constexpr double day_s = 86400.0, night_s = 3600.0;
        if (any_ && raw_s_ <= day_s && raw_s_ > day_s - night_s && t_s >= 0.0 && t_s < night_s) {
            days_s_ += day_s;
            ++midnights_;
        }
        raw_s_ = t_s;
        t_s += days_s_;
        if (any_ && !(t_s > last_s_)) {
            if (backward_++ == 0) first_backward_line_ = line;
            if (!(t_s < last_s_) && equal_++ == 0) first_equal_line_ = line;
            return false;
        }
        before_s_ = any_ ? last_s_ : t_s;
        last_s_ = t_s;
        any_ = true;
        return true;
    }
    /// The clock was set: `t_s` stands `after_s` behind the last one.
    void set(double t_s, double after_s) { days_s_ = last_s_ + after_s - t_s; }
    /// By how much a stamp stands before the last one.
    double back_s(double t_s) const { return last_s_ - (t_s + days_s_); }
    double last_s() const { return last_s_; }
    double before_s() const { return before_s_; }
    bool finite() const { return std::isfinite(last_s_ - before_s_); }
    std::size_t midnights() const { return midnights_; }
    std::size_t backward() const { return backward_; }
    std::size_t first_backward_line() const { return first_backward_line_; }
    /// Of those the ones that are the last one's.
    std::size_t equal() const { return equal_; }
    std::size_t first_equal_line() const { return first_equal_line_; }

private:
    bool any_ = false;
    double raw_s_ = 0, last_s_ = 0, before_s_ = 0, days_s_ = 0;
    std::size_t midnights_ = 0, backward_ = 0, first_backward_line_ = 0, equal_ = 0, first_equal_line_ = 0;
};

}  // namespace dqw
#endif
