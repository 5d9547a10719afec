// Tables that an enumerator indexes: each row names its own.
#ifndef DQW_APP_BASE_IN_ORDER_HPP
#define DQW_APP_BASE_IN_ORDER_HPP

#include <cstddef>

namespace dqw {

/// True where row k of a table has the enumerator k as its `id`, so that the enumerator may index it.
template <class Table> constexpr bool in_order(const Table& table)
{
    std::size_t k = 0;
    for (const auto& row : table)
        if (static_cast<std::size_t>(row.id) != k++) return false;
    return true;
}

}  // namespace dqw
#endif
