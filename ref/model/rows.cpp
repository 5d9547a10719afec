#include "ref/model/rows.hpp"

#include "ref/log/wanted.hpp"

namespace dqw {

Draws::Draws(const std::vector<Log>& logs, const std::vector<Piece>& kept) : logs_(logs), marks_(logs.size())
{
    for (const Piece& piece : kept) kept_.push_back({piece.log, piece.begin, piece.end, {}});
    Stream stream;
    for (std::size_t l = 0; l < logs.size(); ++l)
        for (std::size_t column = 0; column < kColumns; ++column)
            for (std::size_t k = 0; k < logs[l].rows(); ++k) {
                ask_at(k);
                if (k % kApart == 0) marks_[l][column].push_back(stream);
                const double x = stream.next();
                for (Kept& rows : kept_)
                    if (rows.has(logs[l], k)) rows.of[column].push_back(x);
            }
}

const Draws::Stream& Draws::mark(const Log& log, std::size_t column, std::size_t n) const
{
    return marks_[static_cast<std::size_t>(&log - logs_.data())][column][n];
}

const Draws::Kept* RowReader::kept_at(const Log& log, std::size_t k)
{
    if (kept_ != nullptr && kept_->has(log, k)) return kept_;
    for (const Draws::Kept& rows : noise_->draws->kept())
        if (rows.has(log, k)) return kept_ = &rows;
    return nullptr;
}

double RowReader::noise_at(std::size_t column, const Log& log, std::size_t k)
{
    if (const Draws::Kept* rows = kept_at(log, k)) return noise_->size[column] * rows->of[column][k - rows->begin];
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
