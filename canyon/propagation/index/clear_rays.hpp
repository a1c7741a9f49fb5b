#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// Answers of batched rays. std::vector<bool> cannot be a span of bool.
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

/// Drops what rays find in the way. Nothing is allocated once it has grown.
class ClearRays {
 public:
  /// Keeps those of `found`, in their order, whose ray meets nothing farther than `min_range_m`.
  /// @param make_ray gives the ray of one
  template <typename Found, typename MakeRay>
  void keep(const raytrace::RayScene& scene, std::vector<Found>& found, double min_range_m,
            const MakeRay& make_ray) {
    rays_.clear();
    for (const Found& f : found) rays_.push_back(make_ray(f));
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
