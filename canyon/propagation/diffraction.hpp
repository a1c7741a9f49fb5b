#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/propagation/edges.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::propagation {

/// Loss [dB] of a knife edge against free space: J(nu) = 6.9 + 20 log10(sqrt((nu - 0.1)^2 + 1) + nu - 0.1),
/// 0 up to nu = -0.78 (ITU-R P.526-15, equation 31). 6.03 dB at grazing, nu = 0. Within 0.31 dB of the
/// Fresnel integral (equation 30) from nu = -0.78 on; ripples of the lit side beyond that, up to 1.4 dB, are
/// left out.
[[nodiscard]] double diffraction_loss_db(double nu);

/// The nu [-] whose diffraction_loss_db() is `loss_db`, in closed form. `loss_db` above 0.01 (asserted).
[[nodiscard]] double diffraction_nu_of_loss(double loss_db);

/// Fresnel-Kirchhoff parameter [-] without its sign: nu = 2 sqrt(excess / wavelength), for an excess path
/// [m] >= 0 and a wavelength [m] > 0.
///
/// The phase of the way around the edge, 2 pi excess / wavelength, is the Fresnel integral's pi nu^2 / 2. For
/// small angles that is P.526-15's equation 27, nu = theta sqrt(2 d / wavelength), the satellite at infinity;
/// at any angle and on any cone it is the argument of Sommerfeld's half-plane (R. G. Kouyoumjian and
/// P. H. Pathak, Proc. IEEE 62 (1974), 1448-1461, k L a with L = d sin^2(beta), a = 2 cos^2), which this
/// therefore continues without P.526's limit of 12 deg.
[[nodiscard]] double diffraction_nu(double excess_m, double wavelength_m);

struct DiffractionOptions {
  /// Carrier [Hz], for nu and the loss; excess paths do not depend on it. [1e8, 1e11].
  double frequency_hz = 1575.42e6;  // L1, E1, B1C: IS-GPS-200, 3.3.1.1
  /// Reach [m] of the leg from the antenna to the edge. (0, 100,000].
  double max_range_m = 300;
  /// Largest angle [rad] between the leg and the direction to the satellite. Deeper in the shadow of a
  /// right-angled wedge the knife edge loses over 2.4 dB more than the wedge does (docs/diffraction.md).
  /// (0, pi].
  double max_bending_rad = 1.0471975511965976;  // 60 deg
  /// Largest loss [dB] of a path that is kept. GPS L1 C/A arrives with at least -128.5 dBm (IS-GPS-200,
  /// 3.3.1.6), and the most sensitive receivers track down to -160 to -167 dBm by their data sheets. At L1
  /// 35 dB are an excess path of 7.9 m. [7, 100].
  double max_loss_db = 35;
  /// Paths of one satellite that are kept, the strongest ones. [1, 100].
  int max_paths = 3;
  EdgeOptions edges;

  /// Largest excess path [m] within max_loss_db: wavelength nu^2 / 4.
  [[nodiscard]] double max_excess_m() const;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};

/// One way from satellite to antenna around one edge. Points and directions are in the city's ENU frame.
struct DiffractedPath {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();    ///< on the edge
  Eigen::Vector3d arrival = Eigen::Vector3d::Zero();  ///< unit, from the antenna towards the point
  double excess_m = 0;                                ///< longer than the straight line by this much
  double bending_rad = 0;                             ///< between arrival and the direction to the satellite
  double nu = 0;           ///< of the sign of EdgePoint::shadowed: positive in the edge's own shadow
  double loss_db = 0;      ///< see EdgeDiffraction::trace
  std::uint32_t edge = 0;  ///< of the instance's EdgeSet
  std::uint32_t instance = 0;
};

/// Finds the paths around single edges of a city and of the scene's movable instances (as they stood at its
/// last commit()). Const, thread-safe; edges are prepared once. The scene must outlive it; `city` is the mesh
/// that the scene was built from, and is not kept.
class EdgeDiffraction {
 public:
  /// Throws InputError for options that do not validate().
  EdgeDiffraction(const city::Mesh& city, const raytrace::RayScene& scene, DiffractionOptions options = {});
  ~EdgeDiffraction();
  EdgeDiffraction(EdgeDiffraction&&) noexcept;
  EdgeDiffraction& operator=(EdgeDiffraction&&) noexcept;

  [[nodiscard]] const DiffractionOptions& options() const;
  /// The city's edges; DiffractedPath::edge of instance 0 counts these.
  [[nodiscard]] const EdgeSet& edges() const;

  /// Paths of satellites in the given directions (unit, ENU, antenna to satellite) at one antenna, by excess
  /// path, at most options().max_paths each; result[i] belongs to directions[i]. `blocked[i]`: the straight
  /// line is, as RayScene::occluded() says. The antenna must be finite (InputError).
  ///
  /// Where the straight line is blocked, a path is what arrives around the edge instead, weaker than free
  /// space by J(|nu|): also around an edge that is not in the way itself (nu < 0), while something else is;
  /// what an edge scatters depends on the distance from its shadow boundary, not on the side. Where it is
  /// not blocked, paths are the edges within |nu| < 0.78 of it, and `loss_db` = J(-|nu|), from 0 to 6 dB, is
  /// that of direct signal and edge together: it weakens the direct signal and is no signal of its own.
  ///
  /// Legs to the antenna and to the satellite are clear, cast from a point lifted off both faces by
  /// RayScene::surface_offset_m(); an antenna within twice that of a face's plane does not see that face.
  /// Paths nearer to an edge's ends than that may be kept or missed. Paths at the same place (2 mm) of edges
  /// drawn twice are one. Not modelled: ends of edges (corners) as scatterers, two edges in a row, edges and
  /// reflections.
  void trace(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions,
             std::span<const bool> blocked, std::span<std::vector<DiffractedPath>> result) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::propagation
