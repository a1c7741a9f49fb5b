#pragma once

#include <cstdint>
#include <optional>

#include "canyon/base/options/fwd.hpp"

namespace canyon::propagation {

/// Paths around edges. The last four fields are parameters of the search, without keys.
struct DiffractionOptions {
  /// Reach [m] of the leg from the antenna to the edge. (0, 100,000].
  double max_range_m = 300;
  /// Radius [m] by which edges are rounded for blocked satellites, [0, 100]; 0: knife edges
  /// (rounded_edge_loss_db()). It represents the higher loss of real edges: parapets, gutters, relief.
  double edge_radius_m = 0;
  /// Edges of the terrain as well: crests of its triangles.
  bool terrain = false;
  /// Largest angle [rad] between the leg and the direction to the satellite. Deeper in the shadow of a
  /// right-angled wedge the knife edge loses over 2.3 dB more than the wedge does (docs/propagation.md).
  double max_bending_rad = 1.0471975511965976;  // 60 deg
  /// Largest loss [dB] of a path that is kept. GPS L1 C/A arrives with at least -128.5 dBm (IS-GPS-200,
  /// 3.3.1.6), and the most sensitive receivers track down to -160 to -167 dBm by their data sheets. At L1
  /// 35 dB are an excess path of 7.8 m.
  double max_loss_db = 35;
  /// Largest |nu| [-] of edges near a clear straight line. Beyond 0.78 P.526-15 (4.1) has no loss, but the
  /// neglected part there is an edge wave of 0.24 (edge_wave()), beyond 2 of 0.11 (-19 dB).
  double max_clear_nu = 2;
  /// Number of paths kept per satellite, the strongest ones.
  int max_paths = 3;

  /// Largest excess path [m] within max_loss_db at L1: wavelength nu^2 / 4 at the nu with that loss.
  [[nodiscard]] double max_excess_m() const;
  [[nodiscard]] bool operator==(const DiffractionOptions&) const = default;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, DiffractionOptions& o);

/// Scattering by facades that are no mirrors: windows, balconies, rough stone. docs/propagation.md has the
/// sources. The fields from `rays` on are parameters of the search and the model, without keys.
struct DiffuseOptions {
  /// S, amplitude scattered over amplitude that a smooth wall would reflect, [0, 1]. Fits at 1296 MHz: 0.05
  /// metal hangar, 0.2 plain brick, 0.4 walls with windows and doors, more in dense cities (V. Degli-Esposti
  /// et al., IEEE Trans. AP 55(1), 2007).
  double scattering_coefficient = 0.4;
  /// Largest number of facades of a path, [1, 8]. Between them waves continue as by a mirror or as scattered.
  int bounces = 3;
  /// Reach [m] of these rays, (0, 100,000].
  double max_range_m = 300;
  /// A facade is no mirror: each piece has a scattering centre near the specular point. Standard deviation of
  /// the angle between them as seen by the antenna [rad, small angles], in two directions, [0, 1]; 0.4 of it
  /// at edges. It is visible in Dopplers: 0.25 gives those of five recordings (docs/results.md).
  double glint_sigma = 0.25;
  /// Number of search rays around the antenna, spread evenly over the sphere's part above
  /// `lowest_elevation_rad`.
  int rays = 192;
  double lowest_elevation_rad = -0.17453292519943295;  // -10 deg
  /// rho of all walls, the fraction of power that a smooth one reflects, mean of both polarisations and all
  /// angles, [0, 1]; empty: reflectance() of each wall's material.
  std::optional<double> wall_reflectance;
  /// Classes with less power relative to the line of sight are dropped [dB].
  double min_power_db = -40;
  /// Width [m] of the classes of detour that group the paths.
  double class_m = 10;
  /// Number of classes kept per satellite, the strongest ones.
  int max_paths = 6;
  /// Pieces of facades scatter more or less than their mean: powers are multiplied by log-normal numbers with
  /// this standard deviation and this median [dB]. 0 and 0: the effective roughness model alone. Local means
  /// of urban paths are log-normal (H. Suzuki, IEEE Trans. Communications 25(7), 1977); both numbers are from
  /// recordings (docs/propagation.md).
  double strength_sigma_db = 8, strength_median_db = -3;
  [[nodiscard]] bool operator==(const DiffuseOptions&) const = default;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, DiffuseOptions& o);

enum class Model : std::uint8_t { Specular, Mirror };

struct PropagationOptions {
  Model model = Model::Specular;
  /// Largest number of reflections of a path: 0 (direct only), 1 or 2. Specular only.
  int reflection_order = 1;
  /// Reach [m] of the mirror ray, and of the distance along a path from the antenna to its last reflection
  /// point (of the second order: the sum of two legs). (0, 100,000].
  double max_range_m = 300;
  /// Largest angle of incidence [rad] of a reflection that is kept. (0, pi/2]. Specular only.
  double max_incidence_rad = 1.5533430342749532;  // 89 deg
  /// Reflections from terrain as well. Specular only.
  bool ground_reflection = false;
  /// Paths around edges (EdgeDiffraction with `edges`): of blocked satellites, and of others as the wave that
  /// an edge adds to a clear signal. Specular only.
  bool diffraction = false;
  DiffractionOptions edges;
  /// Diffuse paths (DiffuseScattering with `scattering`), and Incidence::specular_factor sqrt(1 - S^2) of all
  /// reflections by buildings and vehicles. Specular only.
  bool diffuse = false;
  DiffuseOptions scattering;
  /// Vegetation weakens the direct path (PathGeometry::foliage_depth_m; FoliageVolumes) instead of blocking
  /// it; it still blocks all other paths. Specular only.
  bool through_foliage = false;
  /// Reflections of the second order, diffuse paths and the choice of edges are searched once per this
  /// interval [s], [0, 10], and if the antenna is this far [m] from the position of the last search, [0, 10].
  /// In between they are updated for the motion of antenna and satellites (FarPath). 0: searched in every
  /// epoch, as also while a movable instance in reach moves. Specular.
  double retrace_interval_s = 1, retrace_distance_m = 1;
  [[nodiscard]] bool operator==(const PropagationOptions&) const = default;
  /// Throws InputError naming the field and its bound, of `edges` and `scattering` too, in use or not.
  void validate() const;
};
void visit(options::Visitor& v, PropagationOptions& o);

}  // namespace canyon::propagation
