#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace canyon {

/// A process-wide unique number, for thread_cached().
[[nodiscard]] inline std::uint64_t next_cache_id() {
  static std::atomic<std::uint64_t> last = 0;
  return ++last;
}

/// The value of an owner's key (below 1024) at an instant. Each thread caches the latest value of a key and
/// computes it again for another instant. Owners may evict each other's entries.
template <typename Value, typename Make>
[[nodiscard]] const Value& thread_cached(std::uint64_t owner, std::size_t key, std::int64_t instant,
                                         const Make& make) {
  struct CacheSlot {
    std::uint64_t owner = 0;
    std::size_t key = 0;
    std::int64_t instant = 0;
    Value value;
  };
  using CacheSlots = std::array<CacheSlot, 1024>;
  static thread_local const std::unique_ptr<CacheSlots> cache = std::make_unique<CacheSlots>();
  CacheSlot& location = (*cache)[(owner * 397 + key) % cache->size()];
  if (location.owner != owner || location.key != key || location.instant != instant)
    location = {owner, key, instant, make()};
  return location.value;
}

}  // namespace canyon
