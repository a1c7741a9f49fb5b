#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/index/clear_rays.hpp"
#include "canyon/paths/propagation/index/facets.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/paths/propagation/second_order.hpp"

namespace canyon::propagation {

/// Paths satellite -> facet -> antenna by the image method (Propagator::trace()). Holds the memory of a
/// search: use one per thread; nothing is allocated once it has grown.
class FirstOrderSearch {
 public:
  struct FoundPaths {
    std::uint32_t satellite = 0;
    double lift_m = 0;  ///< along the normal, so that rays do not hit the facet itself
    double cosine = 1;  ///< of incidence
    Eigen::Vector3d normal;
    Path path;  ///< without materials and the elevation of its arrival
  };

  /// The city's facets near an antenna, and the antenna's last position. Of one set and one reach.
  struct CachedFacets {
    NearFacets facets;
    Eigen::Vector3d antenna = Eigen::Vector3d::Constant(1e300);
  };

  /// All first-order paths to `directions`, by satellite and excess path; valid until the next call. The
  /// first of `sets` is the city, in its own frame; only facets, instances and poses are used. @param kept
  /// cache for this antenna; null: no cache
  std::span<const FoundPaths> trace(const raytrace::RayScene& scene, std::span<const PosedFacets> sets,
                                    const Eigen::Vector3d& antenna,
                                    std::span<const Eigen::Vector3d> directions,
                                    const ReflectionLimits& limits, CachedFacets* kept);

  /// The city's facets that the last search gathered around its antenna.
  [[nodiscard]] const FacingFacets& facing_of_city() const { return facing_of_city_; }

 private:
  const NearFacets& gather(const PosedFacets& set, const Eigen::Vector3d& here, double reach_m,
                           CachedFacets* kept);
  void find(const raytrace::RayScene& scene, const PosedFacets& set, const Eigen::Vector3d& antenna,
            std::span<const Eigen::Vector3d> directions, const ReflectionLimits& limits, CachedFacets* kept);
  void sort_and_drop_doubles();
  void keep_clear(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna,
                  std::span<const Eigen::Vector3d> directions);

  NearFacets near_;  ///< of one antenna
  FacingFacets facing_of_city_, facing_of_instance_;
  std::vector<std::uint8_t> marks_;
  std::vector<FoundPaths> found_;
  ClearRays clear_rays_;
};

}  // namespace canyon::propagation
