#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::orbit {

/// Satellites from SP3-c or SP3-d precise orbits. A Kepler orbit with J2's secular rates is subtracted from
/// the positions, rotated to non-rotating axes. The remainder, some kilometres, is a Lagrange polynomial
/// through 11 records; velocity is its derivative (within 1 mm/s). Clocks are linear between records, plus
/// the relativity of eccentric orbits (-2 r.v/c^2, which SP3 clocks omit). Interpolating from every second
/// record of a 15-minute file restores the others within 5 cm, also for the eccentric Galileo satellites; at
/// the ends of the file, where the 11 records are on one side, the error grows to decimetres.
///
/// No result beyond the file's first and last epoch, in gaps of more than `kMaxGap` records, between two
/// records with a maneuver (flag M) or a jump of the clock (E) between them, next to records marked as bad in
/// position (0.000000) or clock (999999.999999), and with fewer than 11 successive records. Positions refer
/// to the centre of mass. The group delay is 0, and GLONASS frequencies, which SP3 lacks, are those of the
/// nominal constellation.
class PreciseSky final : public Sky {
 public:
  static constexpr int kMaxGap = 2;  ///< records

  /// Plain or gzip. Records of other systems, velocities (V) and correlations (EP, EV) are skipped. Throws
  /// InputError with file and line for a file that is not SP3-c/d, if most of its records are damaged, and if
  /// it has no satellite of `systems`.
  explicit PreciseSky(const std::filesystem::path& path,
                      std::set<gnss::System> systems = {gnss::kConstellations.begin(),
                                                        gnss::kConstellations.end()});
  explicit PreciseSky(TextFile file, std::set<gnss::System> systems = {gnss::kConstellations.begin(),
                                                                       gnss::kConstellations.end()});
  /// Files of several days, in any order, as one: IGS files end at 23:45, so a run over midnight needs two.
  /// If several files have records of one instant, the record of the earliest file is used, unless it is
  /// marked as bad. At least one file.
  explicit PreciseSky(const std::vector<std::filesystem::path>& paths,
                      std::set<gnss::System> systems = {gnss::kConstellations.begin(),
                                                        gnss::kConstellations.end()});
  ~PreciseSky() override;

  [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override;
  [[nodiscard]] std::optional<SatelliteState> state(gnss::SatelliteId id, geodesy::GpsTime t) const override;
  [[nodiscard]] std::string source(gnss::SatelliteId id, geodesy::GpsTime t) const override;

  /// Of all files.
  [[nodiscard]] const ReadReport& report() const;
  /// First and last epoch [GPST].
  [[nodiscard]] std::pair<geodesy::GpsTime, geodesy::GpsTime> span() const;

 private:
  struct Table;
  std::unique_ptr<Table> table_;
};

/// One position-and-clock record.
struct Sp3Record {
  geodesy::GpsTime t;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< ECEF at this instant
  double clock_bias_s = 0;                               ///< without the periodic relativity
  bool good_position = true;
  bool good_clock = true;
  /// Events since the preceding record, or at this one (flags M and E).
  bool maneuver = false, clock_event = false;
  int line = 0;
};

/// The contents of an SP3-c or SP3-d file ("The Extended Standard Product 3 Orbit Format", IGS 2016).
struct Sp3File {
  std::vector<geodesy::GpsTime> epochs;                         ///< ascending
  std::map<gnss::SatelliteId, std::vector<Sp3Record>> records;  ///< ascending in time
  double step_s = 0;                                            ///< the most frequent one between epochs
  ReadReport report;
};

/// Reads the P records of `systems`. Epochs out of order and damaged lines are skipped and counted in
/// `report`. Throws InputError as described at PreciseSky.
[[nodiscard]] Sp3File read_sp3(TextFile& file, const std::set<gnss::System>& systems);

/// A Kepler orbit with the secular rates of J2, to subtract the bulk of a motion from tabulated positions:
/// the remainder is kilometres instead of the orbit's size, and its interpolation error is smaller by the
/// same factor. Axes do not rotate and have the Earth's pole as z.
class ReferenceOrbit {
 public:
  struct State {
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
    double true_anomaly_rad = 0;   ///< continuous over revolutions; grows with time
    double true_anomaly_rate = 0;  ///< [rad/s]
  };

  /// Position and velocity are zero: it subtracts nothing. The anomaly is the time [h].
  ReferenceOrbit() = default;
  /// The orbit through a position [m] and velocity [m/s] at `epoch`; the default one if they give no ellipse
  /// with e < 0.9 above the Earth.
  ReferenceOrbit(geodesy::GpsTime epoch, const Eigen::Vector3d& position, const Eigen::Vector3d& velocity);

  [[nodiscard]] State at(geodesy::GpsTime t) const;

  /// Scales the mean motion by a factor, with the position at the epoch unchanged.
  void scale_mean_motion(double factor) { mean_motion_ *= factor; }

 private:
  geodesy::GpsTime epoch_;
  double semi_major_axis_ = 0;
  double eccentricity_ = 0;
  double mean_anomaly_ = 0;                             ///< at the epoch
  double mean_motion_ = 0;                              ///< [rad/s]
  double node_rate_ = 0;                                ///< [rad/s]
  double perigee_rate_ = 0;                             ///< [rad/s]
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();  ///< perigee, along, normal at the epoch, as columns
};

}  // namespace canyon::orbit
