#include "ref/model/rows.hpp"

#include "ref/log/wanted.hpp"

namespace dqw {

Draws::Draws(const std::vector<Log>& logs) : logs_(logs), marks_(logs.size())
{
    Stream stream;
    for (std::size_t l = 0; l < logs.size(); ++l)
        for (auto& marks : marks_[l])
            for (std::size_t k = 0; k < logs[l].rows(); ++k) {
                ask_at(k);
                if (k % kApart == 0) marks.push_back(stream);
                stream.next();
            }
}

const Draws::Stream& Draws::mark(const Log& log, std::size_t column, std::size_t n) const
{
    return marks_[static_cast<std::size_t>(&log - logs_.data())][column][n];
}

double RowReader::noise_at(std::size_t column, const Log& log, std::size_t k)
{
    Place& place = places_[column];
    if (place.log != &log || k < place.row || k / Draws::kApart > place.row / Draws::kApart) {
        place.log = &log;
        place.row = k - k % Draws::kApart;
        place.stream = noise_->draws->mark(log, column, k / Draws::kApart);
    }
    for (; place.row < k; ++place.row) place.stream.next();
    ++place.row;
    return noise_->size[column] * place.stream.next();
}

Row RowReader::at(const Log& log, std::size_t k)
{
    Row row = row_of(log, k);
    if (noise_ == nullptr) return row;
    std::size_t column = 0;
    for (double* x : {&row.v_d_V, &row.v_q_V, &row.i_d_A, &row.i_q_A, &row.w_m_rad_s}) *x += noise_at(column++, log, k);
    return row;
}

double RowReader::speed_at(const Log& log, std::size_t k)
{
    return log.w_m_rad_s[k] + (noise_ != nullptr ? noise_at(Draws::kColumns - 1, log, k) : 0.0);
}

}  // namespace dqw
