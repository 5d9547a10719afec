// The bytes of an object of lib/ or port_q15/, for the same build: pointers are left out, and put back by whoever takes
// them.
#ifndef DQW_APP_MONITOR_IMAGE_HPP
#define DQW_APP_MONITOR_IMAGE_HPP

#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

#include "dqw_estimator_random.h"
#include "dqw_monitor.h"
#include "dqw_monitor_q15.h"

namespace dqw {

template <class T> void put_image(std::string& to, const T& object)
{
    static_assert(std::is_trivially_copyable_v<T>);
    to.append(reinterpret_cast<const char*>(&object), sizeof object);
}

/// False where too few bytes are left.
template <class T> bool take_image(std::string_view& from, T& object)
{
    static_assert(std::is_trivially_copyable_v<T>);
    if (from.size() < sizeof object) return false;
    std::memcpy(static_cast<void*>(&object), from.data(), sizeof object);
    from.remove_prefix(sizeof object);
    return true;
}

/// The pointers of `object` become those of `like`.
inline void point_as(dqw_estimator& object, const dqw_estimator& like)
{
    object.config = like.config;
    object.effect.list = like.effect.list;
}
inline void point_as(dqw_estimator_q15& object, const dqw_estimator_q15& like)
{
    object.config = like.config;
    object.effect.list = like.effect.list;
}
inline void point_as(dqw_estimator_random& object, const dqw_estimator_random& like)
{
    object.learn = like.learn;
    object.random.reservoir = like.random.reservoir;
}
inline void point_as(dqw_monitor& object, const dqw_monitor& like)
{
    object.config = like.config;
    object.enter_as_stored = like.enter_as_stored;
    point_as(object.estimator, like.estimator);
}
inline void point_as(dqw_monitor_q15& object, const dqw_monitor_q15& like)
{
    object.config = like.config;
    point_as(object.estimator, like.estimator);
}

/// A copy that points nowhere.
template <class T> T without_pointers(T object)
{
    static const T none{};
    point_as(object, none);
    return object;
}

}  // namespace dqw
#endif
