#pragma once

#include <Eigen/Core>
#include <complex>
#include <limits>
#include <optional>

#include "canyon/paths/propagation/paths.hpp"

namespace canyon::disturbance {

using propagation::Body;

/// A ray from an antenna towards where a signal comes from, and the upright plane that holds it.
struct Sight {
  /// @param arrival unit vector from the antenna
  /// @param leg_m to what reflects the signal, infinite for a satellite: bodies beyond do nothing
  Sight(const Eigen::Vector3d& antenna, const Eigen::Vector3d& arrival,
        double leg_m = std::numeric_limits<double>::infinity());
  [[nodiscard]] double height(double along_m) const { return from.z() + along_m * slope; }

  Eigen::Vector3d from;
  Eigen::Vector2d along;  ///< unit, horizontal
  double cosine, sine, slope;
  double ahead_m;  ///< horizontal length of the leg
};

/// Effect of a body on a wave behind it.
struct Blockage {
  double amplitude = 1;  ///< of the field behind it over the field without it
  bool cuts = false;     ///< the ray meets it
  double detour_m = 0;   ///< around its nearest edge, where the ray meets it
};

/// propagation::knife_edge_field() within 2e-4, and 0.3 % beyond nu = 12, in a tenth of its time: its steady
/// part, without the phase of the detour, from a table.
[[nodiscard]] std::complex<double> edge_field(double nu);

/// A box between an antenna and what its signal comes from: the field of a plane wave beside a rectangular
/// screen, |1 - X Y| with X = 1 - F(nu_left) - F(nu_right), Y = 1 - F(nu_below) - F(nu_above), F Fresnel's
/// knife edge (propagation::knife_edge_field()). That is Kirchhoff's field of the screen by Babinet's
/// principle, the field that 3GPP TR 38.901 7.6.4.2 (blockage model B) approximates. Its edges are the
/// outline of the box as the antenna sees it, each at its own distance. Bodies behind one another multiply.
/// Kind::Crown does nothing here, see crown_depth_m().
[[nodiscard]] Blockage blockage(const Body& body, const Sight& sight, double wavelength_m);

/// Length of a ray in the crown of a tree [m].
[[nodiscard]] double crown_depth_m(const Body& body, const Eigen::Vector3d& antenna,
                                   const Eigen::Vector3d& arrival, double leg_m);

/// The reflection of a plane wave from `satellite` (unit, to the satellite) by one of a box's four sides
/// (0 to 3), by the image method; its amplitude_factor is |X Y| of the side as the image of the antenna sees
/// it: a side is a mirror as far as it covers the first Fresnel zones. Empty where antenna or satellite is
/// behind the side, or where the factor is below `least`.
[[nodiscard]] std::optional<propagation::Path> side_reflection(const Body& body, int side,
                                                               const Eigen::Vector3d& antenna,
                                                               const Eigen::Vector3d& satellite,
                                                               double wavelength_m, double least);

}  // namespace canyon::disturbance
