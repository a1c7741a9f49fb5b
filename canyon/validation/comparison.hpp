#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/orbit/satellite_id.hpp"
#include "canyon/propagation/paths.hpp"
#include "canyon/receiver/fix.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/validation/pseudorange_errors.hpp"

// The recorded receiver beside the simulated one, observation by observation.

namespace canyon::validation {

/// A rigid horizontal move of the city: a point p of its map lies at turn(p - pivot) + pivot + offset.
struct Registration {
  double east_m = 0, north_m = 0;
  double heading_rad = 0;                           ///< counter-clockwise about the pivot, as yaw
  Eigen::Vector2d pivot = Eigen::Vector2d::Zero();  ///< east, north of the city's frame

  /// Where an antenna or a direction of the true world stands in the unmoved city.
  [[nodiscard]] Eigen::Vector3d place_in_city(const Eigen::Vector3d& enu) const;
  [[nodiscard]] Eigen::Vector3d direction_in_city(const Eigen::Vector3d& enu) const;
};

/// What all comparisons of one recording share: built once.
struct Recording {
  PseudorangeResiduals residuals;  ///< by epoch
  /// Antenna of residuals.epochs in the city's ENU frame, height as the scenario says (clamped to terrain or
  /// as recorded), and its velocity and yaw.
  struct Place {
    Eigen::Vector3d enu_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_enu_mps = Eigen::Vector3d::Zero();
  };
  std::vector<Place> places;
  /// Measured fixes are solved from these: all recorded L1 signals of systems with ephemerides.
  std::vector<std::vector<receiver::Measurement>> measurements;  ///< one list for each of residuals.epochs
  std::vector<std::string> warnings;
};

/// One satellite at one epoch, above the scenario's elevation mask: measured, simulated or both.
struct ComparedSatellite {
  orbit::SatelliteId id;
  double azimuth_rad = 0, elevation_rad = 0;
  bool clear = false;  ///< the city says that the direct path is (LOS)

  bool measured = false;                   ///< a pseudorange was recorded that is not gross
  std::optional<double> measured_error_m;  ///< pseudorange error
  std::optional<double> measured_cn0_dbhz;

  bool simulated = false;  ///< a pseudorange was simulated
  propagation::Visibility visibility = propagation::Visibility::Blocked;
  std::optional<double> simulated_error_m;  ///< by paths and noise, of a tracked signal
  std::optional<double> simulated_cn0_dbhz;
  /// The path that explains an NLOS signal: the strongest at the correlator where signals have strength, else
  /// the shortest; and the code delay [m] that the receiver model makes of all paths, noise left out. Given
  /// for blocked direct paths whether the simulated channel tracks or not. Empty: no path.
  struct Prediction {
    propagation::PathKind kind = propagation::PathKind::Reflected;
    int order = 1;
    double excess_m = 0;  ///< code delay without noise
  };
  std::optional<Prediction> prediction;
  bool used_measured = false, used_simulated = false;  ///< in the fixes
};

struct ComparedFix {
  bool solved = false;
  Eigen::Vector3d error_enu_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  int used = 0;
};

struct ComparedEpoch {
  geodesy::GpsTime time;
  Eigen::Vector3d place_enu_m = Eigen::Vector3d::Zero();  ///< true, in the (moved) city
  std::size_t first = 0, count = 0;                       ///< of Comparison::satellites
  ComparedFix measured, simulated;
  ClockSource clock = ClockSource::None;
  std::size_t segment = 0;  ///< of the street: Comparison::segments
};

/// A stretch of the drive along one street: heading within 30 degrees, at least 50 m or standing.
struct Segment {
  std::size_t first = 0, count = 0;  ///< of Comparison::epochs
  double length_m = 0;
  double heading_deg = 0;  ///< from north, clockwise, [0, 360)
};

struct Comparison {
  std::string name;  ///< of the model: "specular, second order"
  Registration registration;
  std::vector<ComparedEpoch> epochs;
  std::vector<ComparedSatellite> satellites;  ///< by epoch
  std::vector<Segment> segments;
};

/// Reads recording and truth and brings them to the scenario's sky and city. `obs` RINEX, `truth` of
/// `truth_format` (simulation::read_trajectory). The scenario's first receiver gives mask, corrections,
/// lever arm. Throws InputError where files are unreadable, or nothing of the recording lies in the truth.
[[nodiscard]] Recording read_recording(const simulation::Scenario& scenario,
                                       const simulation::Environment& environment,
                                       const std::filesystem::path& obs, const std::filesystem::path& truth,
                                       const std::string& truth_format);

struct CompareOptions {
  int threads = 0;
  std::function<void(std::size_t, std::size_t)> progress;  ///< epochs done, in all
};
/// Simulates the scenario's first receiver (its propagation options included) at the recorded epochs, in the
/// city moved by `registration`, and solves both fixes with the receiver's FixOptions (no position filter).
/// Clocks of the measured errors come from satellites that the moved city says are clear.
[[nodiscard]] Comparison compare(const Recording& recording, const simulation::ReceiverConfig& receiver,
                                 const simulation::Environment& environment, const Registration& registration,
                                 std::uint64_t seed, const CompareOptions& options = {});

}  // namespace canyon::validation
