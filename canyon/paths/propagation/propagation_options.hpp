#pragma once

#include <cstdint>
#include <optional>

#include "canyon/base/options/fwd.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"

namespace canyon::propagation {

struct DiffractionOptions {
  /// Carrier [Hz], for nu and the loss; excess paths do not depend on it. [1e8, 1e11].
  double frequency_hz = 1575.42e6;  // L1, E1, B1C: IS-GPS-200, 3.3.1.1
  /// Reach [m] of the leg from the antenna to the edge. (0, 100,000].
  double max_range_m = 300;
  /// Largest angle [rad] between the leg and the direction to the satellite. Deeper in the shadow of a
  /// right-angled wedge the knife edge loses over 2.3 dB more than the wedge does (docs/propagation.md).
  /// (0, pi].
  double max_bending_rad = 1.0471975511965976;  // 60 deg
  /// Largest loss [dB] of a path that is kept. GPS L1 C/A arrives with at least -128.5 dBm (IS-GPS-200,
  /// 3.3.1.6), and the most sensitive receivers track down to -160 to -167 dBm by their data sheets. At L1
  /// 35 dB are an excess path of 7.8 m. [7, 100].
  double max_loss_db = 35;
  /// Radius [m] that edges are rounded with for satellites that are blocked, [0, 100]; 0: knife edges
  /// (rounded_edge_loss_db()). It stands for what makes real edges lose more: parapets, gutters, relief.
  double edge_radius_m = 0;
  /// With the straight line clear, edges up to this |nu| [-] from it are given. Beyond 0.78 P.526-15 (4.1)
  /// has no loss; up to 2, say, where edge_wave() is added to the direct signal (0.11 of it there). [0, 100].
  double max_clear_nu = 0.78;
  /// Paths of one satellite that are kept, the strongest ones. [1, 100].
  int max_paths = 3;
  EdgeOptions edges;

  /// Largest excess path [m] within max_loss_db: wavelength nu^2 / 4 of the nu that loses so much.
  [[nodiscard]] double max_excess_m() const;
  [[nodiscard]] bool operator==(const DiffractionOptions&) const = default;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, DiffractionOptions& o);

/// Scattering by facades that are no mirrors: windows, balconies, rough stone. docs/propagation.md has the
/// sources.
struct DiffuseOptions {
  /// Directions about the antenna that facades are looked for in, spread evenly over the sphere's part above
  /// `lowest_elevation_rad`. [8, 4096].
  int rays = 192;
  /// S, amplitude scattered over amplitude that a smooth wall would reflect, [0, 1]. Fits at 1296 MHz: 0.05
  /// metal hangar, 0.2 plain brick, 0.4 walls with windows and doors, more in dense cities (V. Degli-Esposti
  /// et al., IEEE Trans. AP 55(1), 2007).
  double scattering_coefficient = 0.4;
  /// rho of every wall, power that a smooth one would reflect of both polarisations' mean, over all angles,
  /// [0, 1]; empty: reflectance() of each wall's material.
  std::optional<double> wall_reflectance;
  /// Facades on a way at most, [1, 8]. Between them waves go on as by a mirror or as scattered.
  int bounces = 3;
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
  /// Pieces of facades scatter more or less than their mean: powers are multiplied by log-normal numbers with
  /// this standard deviation [dB], [0, 30], and this median [dB], [-30, 30]. 0 and 0: the effective roughness
  /// model alone. Local means of urban paths are log-normal (H. Suzuki, IEEE Trans. Communications 25(7),
  /// 1977); both numbers are of recordings (docs/propagation.md).
  double strength_sigma_db = 8;
  double strength_median_db = -3;
  /// Length [m] of a piece, (0, 1000].
  double strength_piece_m = 8;
  /// A facade is no mirror: on each piece something beside the mirror's point leads. Standard deviation of
  /// the angle between them as seen by the antenna [rad, small angles], in two directions, [0, 1]; 0.4 of it
  /// at edges. It shows in Dopplers: 0.25 gives those of five recordings (docs/results.md).
  double glint_sigma = 0.25;
  [[nodiscard]] bool operator==(const DiffuseOptions&) const = default;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, DiffuseOptions& o);

enum class Model : std::uint8_t { Specular, Mirror };

struct PropagationOptions {
  Model model = Model::Specular;
  /// Reflections on a path at most: 0 (direct only), 1 or 2. Specular only.
  int reflection_order = 1;
  /// Reach [m] of the mirror ray, and of the way along a path from the antenna to its last reflection point
  /// (of the second order: the sum of two legs). (0, 100,000].
  double max_range_m = 300;
  /// Largest angle of incidence [rad] of a reflection that is kept. (0, pi/2]. Specular only.
  double max_incidence_rad = 1.5533430342749532;  // 89 deg
  /// Reflect from terrain as well. Specular only.
  bool ground_reflection = false;
  /// Paths around edges (EdgeDiffraction with `edges`), of blocked satellites and, as the wave that an edge
  /// adds to a clear signal, of others. Specular only.
  bool diffraction = false;
  /// Beside clear signals out to |nu| = 2, not 0.78: what is missing beyond is an edge wave of 0.11 (-19 dB,
  /// edge_wave()), where 0.78 would cut one of 0.24. Its frequency is for the search alone.
  DiffractionOptions edges = default_edges();
  /// Diffuse paths (DiffuseScattering with `scattering`), and Incidence::specular_factor sqrt(1 - S^2) of
  /// everything that is reflected by buildings and vehicles.
  /// Specular only.
  bool diffuse = false;
  DiffuseOptions scattering;
  /// Vegetation weakens the direct path (PathGeometry::foliage_depth_m; FoliageVolumes) instead of blocking
  /// it; all other paths it blocks as ever. Specular only.
  bool through_foliage = false;
  /// Reflections of the second order, diffuse paths and the choice of edges are found anew once in this
  /// interval [s], [0, 10], and where the antenna is this far [m] from the place where they were found last,
  /// [0, 10]. In between they go along with antenna and satellites (FarPath). 0: in every epoch. Specular;
  /// while a movable instance in reach moves, in every epoch.
  double retrace_interval_s = 1, retrace_distance_m = 1;
  [[nodiscard]] bool operator==(const PropagationOptions&) const = default;
  /// Throws InputError naming the field and its bound, of `edges` and `scattering` too, in use or not.
  void validate() const;

 private:
  static DiffractionOptions default_edges();
};
void visit(options::Visitor& v, PropagationOptions& o);

}  // namespace canyon::propagation
