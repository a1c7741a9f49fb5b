#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "canyon/base/options/fwd.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/disturbance/faults/fault.hpp"
#include "canyon/paths/propagation/index/facets.hpp"
#include "canyon/paths/propagation/paths.hpp"

namespace canyon::disturbance {

/// Pattern of a transmitter's antenna: isotropic, or one beam.
struct BeamOptions {
  /// Half power to half power [deg], (0, 360]; infinite: isotropic.
  double width_deg = std::numeric_limits<double>::infinity();
  double azimuth_deg = 0;    ///< of its axis, from north, clockwise, [0, 360)
  double elevation_deg = 0;  ///< of its axis, [-90, 90]
  /// Power on the axis over power in directions far from it.
  static constexpr double kFrontToBack_db = 20;
};
void visit(options::Visitor& v, BeamOptions& o);
/// Gain over the gain of the axis [dB], <= 0: a parabola in dB, 12 (angle / width)^2, down to the
/// front-to-back ratio (the antenna element of 3GPP TR 36.814, table A.2.1.1-2).
[[nodiscard]] double beam_gain_db(const BeamOptions& beam, const Eigen::Vector3d& direction);

struct TransmitterOptions {
  CourseOptions course;
  BeamOptions beam;
  void validate() const;
};
/// Visits its fields: those of the course, and `beam`.
void visit(options::Visitor& v, TransmitterOptions& o);

/// One path of a transmitter's wave to an antenna.
struct TransmitterPath {
  Eigen::Vector3d arrival = Eigen::Vector3d::UnitZ();  ///< unit, ENU, from the antenna towards its origin
  double length_m = 0;
  /// Power at an isotropic antenna over the transmitter's EIRP on the beam's axis [dB].
  double gain_db = 0;
  /// The loss by obstacles [dB]: 0 or above; about 1 dB less next to an edge.
  double obstruction_db = 0;
  std::uint64_t reflector = 0;  ///< of the path; 0: none
};

/// A transmitter in a city.
///
/// With a free line of sight its power falls as in free space, (lambda / 4 pi d)^2, d at least a wavelength.
/// If the city blocks the line, the wave over the roofs is that of Bullington's equivalent knife edge over
/// the profile of the surfaces below the line (K. Bullington, Proc. IRE 35(10), 1947; ITU-R P.526-15, 4.5.1,
/// without its correction for terrain). The waves around both sides of the first and the last wall use the
/// same method in the horizontal plane, each if its legs are clear. Powers add.
///
/// Walls reflect by the method of images, once: the mean power of both linear polarisations by the half space
/// of their material (signal::reflect_half_space()). No second reflections, no edges with walls.
class Transmitter {
 public:
  /// Throws InputError if options do not validate() or the context has no city.
  Transmitter(const TransmitterOptions& options, const FaultContext& context);

  [[nodiscard]] Eigen::Vector3d position(geodesy::GpsTime time) const { return course_.at(time); }
  /// The straight path to an antenna, or the diffracted one if obstacles block it.
  /// @param antenna_enu [m] in the city's frame
  [[nodiscard]] TransmitterPath shortest_path(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu,
                                              double frequency_hz) const;
  /// The straight path, and the paths by walls within kReach_m of the antenna.
  [[nodiscard]] std::vector<TransmitterPath> paths(geodesy::GpsTime time, const Eigen::Vector3d& antenna_enu,
                                                   double frequency_hz) const;
  static constexpr double kReach_m = 300;

 private:
  Course course_;
  BeamOptions beam_;
  std::shared_ptr<const raytrace::RayScene> rays_;
  std::shared_ptr<const city::City> city_;
  std::shared_ptr<const propagation::FacetSet> facets_;
  double top_m_ = 0;  // of the city
};

/// One carrier of a jammer: a band, a tone or a chirp; by default of 20 MHz in 10 us.
struct EmissionOptions {
  propagation::Spectrum spectrum{propagation::Spectrum::Shape::Band, gnss::kL1_hz, 20e6, 10e-6};
  double power_dbm = 10;  ///< equivalent isotropically radiated, on the beam's axis, [-100, 100]
};
void visit(options::Visitor& v, EmissionOptions& o);

/// A transmitter that jams.
struct JammingOptions {
  TransmitterOptions transmitter;
  propagation::Polarisation polarisation = propagation::Polarisation::Linear;
  /// A known kind of jammer instead of emissions: "privacy_l1", "privacy_l1_l2", "noise_l1".
  std::string preset;
  std::vector<EmissionOptions> emissions;
  /// Throws InputError naming the field that is missing or out of range.
  void validate() const;
};
void visit(options::Visitor& v, JammingOptions& o);

/// Adds its emissions to the interference at the antenna (propagation::Arrival::interference), each
/// attenuated by the city (Transmitter).
class Jamming : public Disturbance {
 public:
  /// Throws InputError if options do not validate().
  Jamming(const JammingOptions& options, FaultContext context);
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  std::vector<EmissionOptions> emissions_;
  propagation::Polarisation polarisation_;
  Transmitter transmitter_;
};

}  // namespace canyon::disturbance
