#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// Scattering by facades that are no mirrors: windows, balconies, rough stone. docs/diffuse.md has the
/// sources.
struct DiffuseOptions {
  /// Directions about the antenna that facades are looked for in, spread evenly over the sphere's part above
  /// `lowest_elevation_rad`. [8, 4096].
  int rays = 192;
  /// S, amplitude scattered over amplitude that a smooth wall would reflect, [0, 1]. Fits at 1296 MHz: 0.05
  /// metal hangar, 0.2 plain brick, 0.4 walls with windows and doors, more in dense cities (V. Degli-Esposti
  /// et al., IEEE Trans. AP 55(1), 2007).
  double scattering_coefficient = 0.4;
  /// rho, power that a smooth wall would reflect of both polarisations' mean, over all angles, [0, 1].
  double wall_reflectance = 0.3;
  /// alpha_R of the directive lobe about the specular direction, [0, 20]; 0 is Lambert's lobe. Fits at 1296
  /// MHz: 3 for walls with windows, 4 for plain ones (ibid.).
  int lobe_exponent = 0;
  /// Below it nothing is looked for [rad]; [-pi/2, pi/2).
  double lowest_elevation_rad = -0.17453292519943295;  // -10 deg
  /// Reach [m] of these rays, (0, 100,000].
  double max_range_m = 300;
  /// Classes whose power is farther below the line of sight's are dropped [dB], [-100, 0].
  double min_power_db = -40;
  /// Width [m] of the classes of detour that ways are gathered in, [0.1, 100,000].
  double class_m = 10;
  /// Classes of one satellite that are kept, the strongest ones. [1, 64].
  int max_paths = 6;
  [[nodiscard]] bool operator==(const DiffuseOptions&) const = default;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};

/// F [sr], the directive lobe ((1 + cos psi) / 2)^exponent over the half space in front of a wall, psi from
/// the specular direction of a wave incident at theta: with x = sin^2(theta) / 4
///   F = 2^-exponent sum_j C(exponent, j) I_j,  I_j = 2 pi / (j + 1) for even j,
///   I_j = 2 pi / (j + 1) cos(theta) sum_{w = 0}^{(j - 1) / 2} C(2w, w) x^w for odd j
/// (Degli-Esposti et al., 2007). Relative error below 1e-12.
/// @param exponent [0, 20], @param cos_incidence [0, 1]; InputError outside
[[nodiscard]] double lobe_integral(int exponent, double cos_incidence);

/// One class of ways from satellite over facades to antenna. Points and directions in the city's ENU frame.
struct DiffusePath {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< on a facade: of the strongest way in the class
  Eigen::Vector3d arrival = Eigen::Vector3d::Zero();  ///< unit, from the antenna towards the point
  double excess_m = 0;                                ///< of the class: mean weighted by power
  double power = 0;            ///< over the line of sight's, at isotropic antennas: sum of the class
  std::uint32_t triangle = 0;  ///< at `point`, of `instance`
  std::uint32_t instance = 0;
  std::uint32_t bin = 0;  ///< number of the class: floor(excess / class_m) of its ways
};

/// Effective roughness model (Degli-Esposti et al., 2007), the satellite at infinity: a facade patch of area
/// dA at distance r from the antenna, lit by the satellite at theta_i and seen at theta_s, scatters by
/// Lambert's lobe the power
///   dP / P_los = S^2 rho cos(theta_i) cos(theta_s) dA / (pi r^2) = S^2 rho cos(theta_i) d(Omega) / pi,
/// d(Omega) the solid angle that the antenna sees it in, rho the wall's reflectance; by the directive lobe
///   dP / P_los = S^2 rho cos(theta_i) ((1 + cos psi) / 2)^alpha_R / F(theta_i) d(Omega) / cos(theta_s),
/// psi between the way to the antenna and the specular one, F = lobe_integral(). Either way a patch scatters
/// S^2 rho of the power that falls on it. So each ray of an even sphere of directions (a golden spiral, fixed
/// in ENU) stands for its share of solid angle, whatever it meets. Const, thread-safe; no allocation once
/// its thread's memory and the results have grown. The scene must outlive it.
class DiffuseScattering {
 public:
  /// Throws InputError for options that do not validate().
  DiffuseScattering(const city::Mesh& city, const raytrace::RayScene& scene, DiffuseOptions options = {});
  ~DiffuseScattering();
  DiffuseScattering(DiffuseScattering&&) noexcept;
  DiffuseScattering& operator=(DiffuseScattering&&) noexcept;

  [[nodiscard]] const DiffuseOptions& options() const;

  /// Of satellites in the given directions (unit, ENU, antenna to satellite) with wanted[i], by excess path,
  /// at most options().max_paths each; result[i] belongs to directions[i] and is empty where not wanted. The
  /// antenna must be finite and wanted directions unit to 1e-6 (InputError). Buildings and vehicles scatter,
  /// terrain and foliage do not; patches must see the satellite. Spans of one length.
  void trace(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
             std::span<const bool> wanted, std::span<std::vector<DiffusePath>> result) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::propagation
