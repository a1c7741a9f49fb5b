#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/propagation/index/facade_light.hpp"
#include "canyon/propagation/index/per_instance.hpp"
#include "canyon/propagation/propagation_options.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// A ray on its way over facades.
struct FacadeLeg {
  std::uint32_t ray = 0;  ///< its number on the sphere
  int bounce = 0;         ///< facades before
  double carried = 0;     ///< share of the power that it stands for
  bool scattered_before = false;
  Eigen::Vector3d towards;  ///< unit
};

/// A piece of facade that a ray met, at once or over others.
struct FacadePatch {
  FacadeLeg leg, next;         ///< that met it, and that goes on from it
  Eigen::Vector3d point;       ///< on the surface
  Eigen::Vector3d lifted;      ///< the point, off the surface
  Eigen::Vector3d normal;      ///< unit, to the side that was met
  FacadeLight::Cell cell;      ///< on the city
  bool moves = false;          ///< on a movable instance
  double onward_m = 0;         ///< from the first facade on the path
  double area_m2 = 0;          ///< of the first facade, in a steradian at the ray's start
  double scattered = 0;        ///< share of the power that falls on it at normal incidence
  std::uint32_t triangle = 0;  ///< of the first facade, of `instance`
  std::uint32_t instance = 0;
  // As the antenna sees it:
  Eigen::Vector3d arrival;  ///< unit, from the antenna towards where its waves come from
  Eigen::Vector3d towards;  ///< unit, from the antenna to the patch
  double range_m = 0;       ///< from the antenna, straight
  double detour_m = 0;      ///< of the path over other facades against that
  double arrival_m = 0;     ///< from the antenna to the first facade on the path
  double cos_seen = 0;      ///< between the normal and the ray
  double weight = 0;        ///< of its ray: the first facade's solid angle, over that at the ray's start
  double share = 0;         ///< `scattered` by weight; 0 where the path does not reach the antenna
};

/// The facades about an antenna: patches of the static city that rays from a place near it meet, and behind
/// them those of one epoch that rays meet over movable instances.
struct FacadesAbout {
  std::optional<Eigen::Vector3d> from;  ///< where the rays to the static city begin
  std::vector<FacadePatch> patches;
  std::uint32_t fixed = 0;  ///< patches of the static city
  /// Which of these a satellite lights.
  struct Lit {
    static constexpr std::uint8_t kUnknown = 0, kYes = 1, kNo = 2;
    std::uint32_t direction = ~0U;      ///< of FacadeLight
    std::vector<std::uint32_t> open;    ///< patches that are not known to be dark
    std::vector<std::uint8_t> answers;  ///< by patch
    bool darkened = false;              ///< whether some in `open` are dark by now

    /// Forgets what is known of another direction.
    void begin(std::uint32_t of, std::uint32_t patches) {
      if (direction == of) return;
      direction = of;
      answers.assign(patches, kUnknown);
      open.resize(patches);
      std::iota(open.begin(), open.end(), 0U);
    }
  };
  std::vector<Lit> lit;  ///< by satellite
};

/// Rays of an even sphere of directions (a golden spiral, fixed in ENU), and where they go on.
///
/// They begin in the middle of the block of kBlock_m about the antenna if it is in sight, else at the
/// antenna: facades hold still while it goes through the block, and ways are computed from where it is. This
/// depends on the antenna's place and the static city alone. Where a movable instance stands in the way, the
/// ray of this epoch is cast from there on.
class FacadeRays {
 public:
  static constexpr double kBlock_m = 4;

  /// The scene must outlive it.
  FacadeRays(const city::Mesh& mesh, const raytrace::RayScene& scene, const DiffuseOptions& options);

  /// Brings `facades` to an antenna: what is kept there stays while it holds.
  void look(const Eigen::Vector3d& antenna, FacadesAbout& facades) const;
  [[nodiscard]] const FacadeLight& light() const { return light_; }

 private:
  [[nodiscard]] std::optional<raytrace::Hit> cast(const raytrace::Ray& ray, bool instances) const;
  [[nodiscard]] double reflectance_of(const raytrace::Hit& hit) const;
  [[nodiscard]] Eigen::Vector3d start(const Eigen::Vector3d& antenna) const;
  [[nodiscard]] FacadeLeg onward(FacadeLeg leg, double reflected, const Eigen::Vector3d& normal) const;
  void follow(const Eigen::Vector3d& origin, FacadeLeg leg, const FacadePatch* before, bool instances,
              std::vector<FacadePatch>& patches) const;
  void follow_around_instances(const Eigen::Vector3d& antenna, FacadesAbout& facades) const;

  const raytrace::RayScene* scene_;
  DiffuseOptions options_;
  std::vector<Eigen::Vector3d> sphere_;
  double share_;              ///< of one ray: d(Omega), over pi for Lambert's lobe
  double scattered_;          ///< S^2
  std::vector<double> city_;  ///< of each triangle its reflectance, 0 where nothing scatters
  PerInstance<std::vector<double>> instances_;
  FacadeLight light_;
};

}  // namespace canyon::propagation
