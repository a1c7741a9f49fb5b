#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <optional>
#include <span>

#include "canyon/city/city.hpp"
#include "canyon/propagation/antenna_pattern.hpp"
#include "canyon/propagation/foliage.hpp"
#include "canyon/propagation/fresnel.hpp"

namespace canyon::propagation {

/// Behaviour of the strength model, for all paths.
struct StrengthOptions {
  /// Facades are slabs in air, of their material's default thickness or Incidence::thickness_m; false: half
  /// spaces, as if every wall were thick. Ground and metal always are half spaces.
  bool slabs = true;
  /// Standard deviation [m] of the heights of every reflecting surface about its plane, for
  /// roughness_factor(); [0, 1]. 0: mirrors.
  double roughness_m = 0;
  FoliageModel foliage = FoliageModel::Woodland;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};

/// One reflection on the way.
struct Incidence {
  double incidence_rad = 0;  ///< between ray and normal, [0, pi/2]
  city::Material material = city::Material::Unknown;
  std::optional<double> thickness_m;  ///< of the slab; empty: the material's default
  double plane_turn_rad = 0;  ///< of the plane of incidence since the reflection before; 0 for the first
};

/// What the strength of a path depends on: any sequence of reflections, one edge, foliage. All empty: the
/// direct path.
struct PathGeometry {
  std::array<Incidence, 2> incidences;  ///< in the order from the satellite
  int incidence_count = 0;              ///< 0 to 2
  /// Of the edge that the ray bends around (signed_knife_edge_nu()): > 0 where it blocks; < 0: the wave that
  /// an edge beside a clear path adds to it (edge_wave()).
  std::optional<double> edge_nu;
  double excess_m = 0;  ///< longer than the straight line by this much, all detours together, >= 0
  double arrival_elevation_rad = 0;  ///< of the direction that the ray comes from, [-pi/2, pi/2]
  double foliage_depth_m = 0;        ///< of vegetation along the ray, >= 0
};

/// The wave at the antenna over the RHCP wave that arrives on a clear direct path: what reflections, edge and
/// foliage leave, with the phase of the detour, e^(-2 pi j excess / lambda) (time dependence exp(+j w t)). An
/// edge's own detour, lambda nu^2 / 4, is part of edge_wave() and not counted twice. Spreading is that of a
/// plane wave: a detour of 300 m is 0.1 mdB at 20,000 km. Phases from the orientation of the antenna
/// (wind-up) are left out. The satellite's own ellipticity (below 1.2 dB on L1, IS-GPS-200 3.3.1.8) too.
/// @param frequency_hz carrier, 1 to 10 GHz
/// InputError for options or values out of range.
[[nodiscard]] CircularWave arriving_wave(const PathGeometry& path, double frequency_hz,
                                         const StrengthOptions& options = {});

/// Output amplitude of an antenna over that of an ideal 0 dBic antenna in a clear RHCP wave. How an antenna
/// adds its two hands depends on azimuth and is known of none; the magnitude is the mean over azimuth, |a|^2
/// = G_R |R|^2 + G_L |L|^2, the phase that of sqrt(G_R) R + sqrt(G_L) L.
[[nodiscard]] std::complex<double> antenna_output(const CircularWave& wave, const AntennaGain& gain);

/// Amplitude [1] of a path at the antenna's output over that of the unobstructed line of sight to the same
/// satellite at `satellite_elevation_rad`: what multiplies a correlator. 1 for the direct path.
[[nodiscard]] std::complex<double> path_amplitude(const PathGeometry& path, double satellite_elevation_rad,
                                                  double frequency_hz, const AntennaPattern& antenna,
                                                  const StrengthOptions& options = {});

/// How paths add.
enum class PathSum : std::uint8_t {
  Power,     ///< sum of |a|^2: the mean over unknown phases
  Coherent,  ///< |sum of a|^2: fading as it is at this place
};
/// Power [1] of all paths together over the line of sight's; 0 for none.
[[nodiscard]] double summed_power(std::span<const std::complex<double>> amplitudes, PathSum sum);

/// C/N0 [dB-Hz] of paths whose line of sight would have `los_cn0_dbhz`; empty where they leave no power.
[[nodiscard]] std::optional<double> summed_cn0_dbhz(double los_cn0_dbhz,
                                                    std::span<const std::complex<double>> amplitudes,
                                                    PathSum sum);

}  // namespace canyon::propagation
