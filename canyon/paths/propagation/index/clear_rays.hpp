#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// Calls visit(i) for every i with marks[i] = 1 (not 0); `count` is a multiple of 8.
template <typename Visit>
void for_each_mark(const std::uint8_t* marks, std::size_t count, const Visit& visit) {
  for (std::size_t word = 0; word < count; word += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, marks + word, 8);
    for (; eight != 0; eight &= eight - 1) {
      const auto byte = static_cast<std::size_t>(__builtin_ctzll(eight)) / 8;
      visit(word + (std::endian::native == std::endian::little ? byte : 7 - byte));
    }
  }
}

/// Keeps the first of duplicate reflections by the same planes in `found`, sorted by satellite and excess
/// path. @param reach_m largest difference of duplicates' excess paths; @param same(kept, other)
template <typename FoundItem, typename Same>
void drop_doubles(std::vector<FoundItem>& found, double reach_m, const Same& same) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    bool seen = false;
    for (std::size_t k = kept; k-- > 0 && !seen;) {
      if (found[k].satellite != found[i].satellite ||
          found[i].path.excess_m - found[k].path.excess_m > reach_m)
        break;
      seen = same(found[k], found[i]);
      // Rounding may change which one comes first, but must not change the reflector's id.
      if (seen) found[k].path.reflector = std::min(found[k].path.reflector, found[i].path.reflector);
    }
    if (seen) continue;
    if (kept != i) found[kept] = found[i];
    ++kept;
  }
  found.resize(kept);
}

/// Results of batched rays. std::vector<bool> cannot be a span of bool.
class Flags {
 public:
  std::span<bool> resize(std::size_t size) {
    if (size > capacity_) {
      capacity_ = std::max(size, 2 * capacity_);
      flags_ = std::make_unique<bool[]>(capacity_);
    }
    return {flags_.get(), size};
  }

 private:
  std::unique_ptr<bool[]> flags_;
  std::size_t capacity_ = 0;
};

/// Removes paths with blocked rays. Nothing is allocated once it has grown.
class ClearRays {
 public:
  /// Keeps those of `found`, in their order, whose ray hits nothing beyond `min_range_m`.
  /// @param make_ray returns the ray of one
  template <typename FoundItem, typename MakeRay>
  void keep(const raytrace::RayScene& scene, std::vector<FoundItem>& found, double min_range_m,
            const MakeRay& make_ray) {
    rays_.clear();
    for (const FoundItem& f : found) rays_.push_back(make_ray(f));
    const std::span<bool> blocked = blocked_.resize(rays_.size());
    scene.occluded(rays_, blocked, min_range_m);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (blocked[i]) continue;
      if (kept != i) found[kept] = found[i];
      ++kept;
    }
    found.resize(kept);
  }

 private:
  std::vector<raytrace::Ray> rays_;
  Flags blocked_;
};

}  // namespace canyon::propagation
