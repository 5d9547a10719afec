#include "ref/model/plan.hpp"

#include <algorithm>

namespace dqw {

Plan::Plan(const Plan& other) : pieces(other.pieces), blocks(other.blocks)
{
    for (FineBlock& b : blocks)
        if (b.piece != nullptr) b.piece = pieces.data() + (b.piece - other.pieces.data());
}

Plan alternate_plan(std::vector<Piece> pieces, std::size_t stretches, std::size_t fine, std::size_t guard)
{
    Plan plan;
    plan.pieces = std::move(pieces);
    const std::size_t total = rows_of(plan.pieces);
    const std::size_t length = std::max<std::size_t>(total / std::max<std::size_t>(stretches, 1), 1);
    // A short stretch keeps three quarters of its rows.
    guard = std::min(guard, length / 4);
    std::size_t passed = 0;
    for (const Piece& piece : plan.pieces) {
        for (std::size_t k = piece.begin; k < piece.end;) {
            const std::size_t at = passed + (k - piece.begin), stretch = at / length;
            const std::size_t left = std::min((stretch + 1) * length - at, piece.end - k);
            std::size_t begin = k, end = k + left;
            k = end;
            // A guard where the next stretch is of the other kind, and at a piece's start.
            begin += std::min(guard, left);
            if (begin >= end) continue;
            const std::size_t parts = std::clamp<std::size_t>((end - begin) * fine / length, 1, fine);
            for (std::size_t p = 0; p < parts; ++p)
                plan.blocks.push_back({&piece, begin + p * (end - begin) / parts,
                                       begin + (p + 1) * (end - begin) / parts, stretch % 2 != 0});
        }
        passed += piece.rows();
    }
    return plan;
}

Plan folded_plan()
{
    Plan plan;
    plan.blocks.resize(2);
    plan.blocks[1].heldout = true;
    return plan;
}

std::vector<BlockSum> folded(const Plan& plan, const std::vector<BlockSum>& sums)
{
    const auto& gram = sums.front().gram;
    std::vector<BlockSum> two = empty_sums(2, static_cast<int>(gram.size()), gram.front().rows() - 1);
    for (std::size_t b = 0; b < sums.size(); ++b) add_to(two[plan.blocks[b].heldout ? 1 : 0], sums[b]);
    return two;
}

std::vector<Span> spans_of(const Plan& plan)
{
    std::vector<Span> out;
    std::size_t block = 0;
    for (const Piece& piece : plan.pieces) {
        const std::size_t first = block;
        while (block < plan.blocks.size() && plan.blocks[block].piece == &piece) ++block;
        out.push_back({&piece, piece.begin, piece.end, first, block});
    }
    return out;
}

std::vector<Span> spans_of(const Plan& plan, bool heldout, std::size_t lead)
{
    std::vector<Span> out;
    for (std::size_t b = 0; b < plan.blocks.size(); ++b) {
        const FineBlock& block = plan.blocks[b];
        if (block.heldout != heldout) continue;
        const std::size_t begin = std::max(block.begin, block.piece->begin + lead) - lead;
        if (out.empty() || out.back().piece != block.piece || begin > out.back().end)
            out.push_back({block.piece, begin, 0, b, 0});
        out.back().end = block.end, out.back().end_block = b + 1;
    }
    return out;
}

// Of a deviation's blocks: five rows each at least where they are few; of 64 a variance scatters by a sixth.
int block_count(std::size_t rows) { return static_cast<int>(std::clamp<std::size_t>(rows / 5, 4, 64)); }

std::size_t block_of(std::size_t row, std::size_t rows)
{
    return ((row + 1) * static_cast<std::size_t>(block_count(rows)) - 1) / rows;
}

Plan even_plan(std::vector<Piece> pieces, std::size_t first)
{
    Plan plan;
    plan.pieces = std::move(pieces);
    const std::size_t total = rows_of(plan.pieces) - first * plan.pieces.size(),
                      blocks = static_cast<std::size_t>(block_count(total));
    std::size_t passed = 0;
    for (const Piece& piece : plan.pieces)
        for (std::size_t k = piece.begin + first; k < piece.end;) {
            const std::size_t left = (block_of(passed, total) + 1) * total / blocks - passed,
                              end = std::min(piece.end, k + left);
            plan.blocks.push_back({&piece, k, end, false});
            passed += end - k, k = end;
        }
    return plan;
}

}  // namespace dqw
