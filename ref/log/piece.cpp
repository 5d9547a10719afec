#include "ref/log/piece.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace dqw {
namespace {

constexpr double kUneven = 0.05;
// More than any log has; a number beyond size_t would be undefined.
constexpr double kMostRows = 1e9;

double even_period_s(const Log& log, std::size_t begin, std::size_t end)
{
    const auto& t = log.t_s;
    if (t.empty()) return log.dt_s;
    const double mean = (t[end - 1] - t[begin]) / static_cast<double>(end - 1 - begin);
    bool even = true;
    for (std::size_t k = begin; k + 1 < end; ++k) {
        const double period = t[k + 1] - t[k];
        if (!(period > 0.0))
            throw std::invalid_argument(log.path + ": time does not increase at data row " + std::to_string(k + 2));
        if (std::abs(period - mean) > kUneven * mean) even = false;
    }
    return even ? mean : 0.0;
}

}  // namespace

double span_s(const Piece& piece, std::size_t k, std::size_t n)
{
    return piece.dt_s > 0.0 ? piece.dt_s * static_cast<double>(n) : piece.log->t_s[k + n] - piece.log->t_s[k];
}

std::size_t block_rows(const Log& log)
{
    constexpr double kDynamic_s = 1e-3, kMechanical_s = 50e-3, kDynamicRows = 20.0;
    const auto rows = [&log](double span) {
        return log.dt_s > 0.0 ? std::min(std::ceil(span / log.dt_s - 1e-6), kMostRows) : 1.0;
    };
    switch (log.regime) {
    case Regime::dynamic: return static_cast<std::size_t>(std::max(kDynamicRows, rows(kDynamic_s)));
    case Regime::mechanical: return static_cast<std::size_t>(std::max(1.0, rows(kMechanical_s)));
    default: return 1;
    }
}

std::vector<Piece> pieces_of(const Log& log, std::size_t min_rows)
{
    std::vector<Piece> pieces;
    for (std::size_t s = 0; s < log.segments.size(); ++s) {
        const std::size_t begin = log.segments[s];
        const std::size_t end = s + 1 < log.segments.size() ? log.segments[s + 1] : log.rows();
        if (end >= begin + std::max<std::size_t>(min_rows, 2))
            pieces.push_back({&log, begin, end, even_period_s(log, begin, end)});
    }
    return pieces;
}

std::vector<Piece> pieces_of(const std::vector<Log>& logs, std::size_t min_rows)
{
    std::vector<Piece> pieces;
    for (const Log& log : logs)
        for (const Piece& piece : pieces_of(log, min_rows)) pieces.push_back(piece);
    return pieces;
}

std::vector<Piece> spread_sample(const std::vector<Piece>& pieces, std::size_t rows, std::size_t window)
{
    const std::size_t total = rows_of(pieces);
    if (total <= 2 * rows) return pieces;
    const std::size_t windows = std::max<std::size_t>(rows / window, 1);
    std::vector<Piece> sample;
    std::size_t passed = 0;
    std::size_t next = 0;
    for (const Piece& piece : pieces) {
        // Window n starts at row n * total / windows of all rows, or where its piece leaves it room.
        while (next < windows && next * (total / windows) < passed + piece.rows()) {
            const std::size_t offset = next * (total / windows) - std::min(passed, next * (total / windows));
            Piece part = piece;
            part.begin = piece.begin + offset;
            part.end = std::min(part.begin + window, piece.end);
            if (part.rows() * 2 >= window || part.rows() == piece.rows()) sample.push_back(part);
            ++next;
        }
        passed += piece.rows();
    }
    return sample.empty() ? pieces : sample;
}

std::vector<Log> copies_of(const std::vector<Piece>& pieces)
{
    std::vector<Log> out;
    for (const Piece& piece : pieces) {
        const Log& from = *piece.log;
        Log copy;
        copy.path = from.path, copy.regime = from.regime, copy.machine = from.machine;
        copy.modulation = from.modulation, copy.observed = from.observed, copy.v_q_is_size = from.v_q_is_size;
        copy.voltage_error_V = from.voltage_error_V, copy.voltage_scale = from.voltage_scale, copy.dt_s = from.dt_s;
        for (auto column : {&Log::t_s, &Log::v_d_V, &Log::v_q_V, &Log::i_d_A, &Log::i_q_A, &Log::w_m_rad_s,
                            &Log::theta_e_rad, &Log::theta_m_rad, &Log::v_dc_V, &Log::temp_winding_C,
                            &Log::temp_magnet_C, &Log::torque_Nm, &Log::torque_cmd_Nm}) {
            const std::vector<double>& all = from.*column;
            const auto at = [&](std::size_t k) { return all.begin() + static_cast<std::ptrdiff_t>(k); };
            if (!all.empty()) (copy.*column).assign(at(piece.begin), at(piece.end));
        }
        out.push_back(std::move(copy));
    }
    return out;
}

std::size_t rows_of(const std::vector<Piece>& pieces)
{
    std::size_t rows = 0;
    for (const Piece& piece : pieces) rows += piece.rows();
    return rows;
}

}  // namespace dqw
