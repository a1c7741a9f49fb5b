#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/paths/propagation/propagation_options.hpp"

namespace canyon::propagation {

/// rho [1]: fraction of power that a smooth wall of the material reflects at 1575.42 MHz, mean of both
/// polarisations and of all directions of incidence: Fresnel's coefficients of a slab of the material's
/// default thickness (signal::radio_material(), ITU-R P.2040-3) over the half space, within 0.006. 0 for
/// foliage.
[[nodiscard]] double reflectance(city::Material material);

/// One class of paths from satellite over facades to antenna; point and triangle belong to the facade next to
/// the antenna. Points and directions in the city's ENU frame.
struct DiffusePath {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< on a facade: of the strongest path in the class
  Eigen::Vector3d arrival = Eigen::Vector3d::Zero();  ///< unit, from the antenna towards the point
  double excess_m = 0;                                ///< of the class: mean weighted by power
  double power = 0;  ///< over the line of sight's, at isotropic antennas: sum of the class, by strength
  std::uint32_t triangle = 0;  ///< at `point`, of `instance`
  std::uint32_t instance = 0;
  std::uint32_t bin = 0;  ///< number of the class: floor(excess / class_m) of its paths
};

/// Effective roughness model (Degli-Esposti et al., 2007), the satellite at infinity. A facade patch of area
/// dA at distance r from the antenna, lit by the satellite at theta_i and seen at theta_s, scatters with
/// Lambert's lobe the power
///   dP / P_los = S^2 rho cos(theta_i) cos(theta_s) dA / (pi r^2) = S^2 rho cos(theta_i) d(Omega) / pi,
/// d(Omega) the solid angle of the patch at the antenna, rho the wall's reflectance: S^2 rho of the incident
/// power. So each ray of an even sphere of directions (a golden spiral, fixed in ENU) represents its fraction
/// of the solid angle, whatever it hits.
///
/// Several facades: each ray is followed over one more wall, with the first wall's reflectance. A fraction
/// S^2 of the rays leaves the first wall by Lambert's law, in directions of an even sequence; the others
/// leave it as by a mirror. The next patch that the ray hits scatters towards the satellite. Walls after a
/// patch that scattered are Lambertian with all their reflected power: a mirror there has the same mean
/// power. Paths over mirrors alone are not diffuse (FirstOrderSearch, SecondOrderSearch).
///
/// The illumination of the city's patches is looked up for cells of a facade and directions of about a degree
/// (FacadeLight). Patches of movable instances, and their shadows, have rays of their own.
///
/// Strengths: the power of a class is multiplied by 10^((median + sigma n) / 10), n normal, by seed, number
/// of the class and the cube of 8 m that contains its point. So it changes as antenna or satellite move along
/// a facade, and is the same for every receiver. All points of movable instances count as one.
/// Const, thread-safe; no allocation once its memory has grown. The scene must outlive it.
class DiffuseScattering {
 public:
  /// Throws InputError for options that do not validate().
  /// @param seed of strengths
  DiffuseScattering(const city::Mesh& city, const raytrace::RayScene& scene, DiffuseOptions options = {},
                    std::uint64_t seed = 0);

  [[nodiscard]] const DiffuseOptions& options() const;

  /// Classes of satellites in the given directions (unit, ENU, antenna to satellite) with wanted[i], by
  /// excess, at most options().max_paths each. result[i] belongs to directions[i] and is empty if not wanted.
  /// Wanted directions must be unit to 1e-6 (InputError). Buildings and vehicles scatter, terrain and foliage
  /// do not; patches must see the satellite. All spans have one length; precondition:
  /// raytrace::check_position(antenna) passes.
  void trace(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
             std::span<const bool> wanted, std::span<std::vector<DiffusePath>> result) const;

  /// Path::glint of a Reflected or Diffracted path over a building or a vehicle.
  [[nodiscard]] Eigen::Vector3d scattering_offset(const Path& path) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace canyon::propagation
