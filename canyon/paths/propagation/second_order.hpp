#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/index/beam_index.hpp"
#include "canyon/paths/propagation/index/clear_rays.hpp"
#include "canyon/paths/propagation/index/direction_bins.hpp"
#include "canyon/paths/propagation/index/facets.hpp"
#include "canyon/paths/propagation/index/near_pairs.hpp"
#include "canyon/paths/propagation/index/occluders.hpp"
#include "canyon/paths/propagation/index/per_instance.hpp"
#include "canyon/paths/propagation/paths.hpp"

namespace canyon::propagation {

/// Facets of one set for the second order, and their pose.
struct PosedFacets {
  const FacetSet* facets;
  const BeamIndex* beams;
  const Occluders* occluders;
  raytrace::InstanceId instance;
  SetPose pose;
};

struct ReflectionLimits {
  double reach_m;      ///< from the antenna along the path to its last reflection point
  double min_cosine;   ///< of each angle of incidence
  double clearance_m;  ///< of the antenna, and of reflection points, over the next facet's plane, more than
};

/// Paths satellite -> facet A -> facet B -> antenna. Holds the memory of a search: use one per thread;
/// nothing is allocated once it has grown.
/// Image method (McKown and Hamilton, "Ray tracing as a design tool for radio networks", IEEE Network 5(6),
/// 1991, pp. 27-30; for rooms Allen and Berkley, J. Acoust. Soc. Am. 65(4), 1979, pp. 943-950). With planes
/// n . x = d, the antenna p and the satellite's direction s:
///   p_B = p - 2 h_B n_B, h_B = n_B . p - d_B, is the antenna in the mirror B,
///   p_BA = p_B - 2 h_A n_A, h_A = n_A . p_B - d_A, is that in the mirror A.
/// The straight ray p_BA -> s unfolds the path, so the path is longer than the direct one by the distance
/// from p_BA to the satellite's wave front through p: excess = s . (p - p_BA) = 2 h_B (n_B . s) + 2 h_A (n_A
/// . s). With s' = s - 2 (s . n_A) n_A, the ray that leaves p_B along s' hits B in q_B after h_B / (n_B . s')
/// and A in q_A after h_A / (n_A . s); those are lengths along the path from the antenna. It is a path if q_B
/// and q_A are on their facets, in this order, both cosines are positive (fronts), and all legs are clear.
///
/// The search: facets B that the antenna may see (without those behind a large facet); facets A in the beam
/// from p_B through B; for each such pair the satellites whose mirror direction in A is in the narrower of
/// the beam and A's cone. This never misses a path; the candidates are then computed in doubles. A nearly
/// stationary antenna gets its pairs of the city's facets from NearPairs.
class SecondOrderSearch {
 public:
  struct FoundPaths {
    std::uint32_t satellite = 0;
    double lift_m = 0, far_lift_m = 0;  ///< along the normals, so that rays do not hit the facets themselves
    double cosine = 1, far_cosine = 1;  ///< of the incidences
    Eigen::Vector3d normal, far_normal;
    Path path;  ///< as FirstOrderSearch::Found::path, and without the rotation of the plane
  };

  /// All second-order paths to `directions`, by satellite and excess path; valid until the next call. The
  /// first of `sets` is the city, in its own frame; the others have poses in it. `facing_of_city` are its
  /// facets by FacingFacets::fill(), as gathered by the first order. @param pairs cache of the city's pairs
  /// for this antenna; null: no cache
  std::span<const FoundPaths> trace(const raytrace::RayScene& scene, std::span<const PosedFacets> sets,
                                    const Eigen::Vector3d& antenna,
                                    std::span<const Eigen::Vector3d> directions,
                                    const ReflectionLimits& limits, const FacingFacets& facing_of_city,
                                    NearPairs* pairs);

 private:
  struct MirrorFacet;

  void prepare(const raytrace::RayScene& scene, std::span<const PosedFacets> sets,
               const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
               const ReflectionLimits& limits);
  void find_pairs(const raytrace::RayScene& scene, std::span<const PosedFacets> sets, std::size_t near_set,
                  const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
                  const ReflectionLimits& limits);
  void find_far(const raytrace::RayScene& scene, const MirrorFacet& near, std::span<const PosedFacets> sets,
                std::size_t far_set, std::span<const Eigen::Vector3d> directions,
                const ReflectionLimits& limits);
  void reflect(const raytrace::RayScene& scene, const MirrorFacet& near, const PosedFacets& set,
               std::span<const BeamIndex::Match> matches, std::span<const Eigen::Vector3d> directions,
               const ReflectionLimits& limits);
  void keep_clear(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna,
                  std::span<const Eigen::Vector3d> directions);
  void sort_and_drop_doubles(const Eigen::Vector3d& antenna);

  /// A set at its pose near the antenna.
  struct NearbySet {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< ENU, of a sphere about all its facets
    bool in_reach = false;
    bool hidden = false;
    BeamIndex::Blocks blocks;
  };

  DirectionBins bins_;
  const FacingFacets* facing_of_city_ = nullptr;  ///< during a search
  NearFacets near_;                               ///< of instances
  FacingFacets facing_;
  std::vector<Occluders::Hidden> hidden_regions_;
  Occluders::Scratch occluders_;
  std::vector<std::uint8_t> hidden_;
  std::vector<NearbySet> around_;
  std::vector<BeamIndex::Match> matches_;
  NearPairs* near_pairs_ = nullptr;  ///< during a search: of the city, if valid
  std::vector<FoundPaths> found_;
  ClearRays clear_rays_;
};

}  // namespace canyon::propagation
