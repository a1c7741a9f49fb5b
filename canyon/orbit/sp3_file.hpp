#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <vector>

#include "canyon/base/read_report.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/satellite_id.hpp"

namespace canyon::orbit {

/// One position-and-clock record.
struct Sp3Record {
  geodesy::GpsTime t;
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< ECEF of the instant
  double clock_bias_s = 0;                               ///< without the periodic relativity
  bool good_position = true;
  bool good_clock = true;
  /// Events since the record before, or at this one (flags M and E).
  bool maneuver = false, clock_event = false;
  int line = 0;
};

/// An SP3-c or SP3-d file ("The Extended Standard Product 3 Orbit Format", IGS 2016) as it is written.
struct Sp3File {
  std::vector<geodesy::GpsTime> epochs;                         ///< ascending
  std::map<gnss::SatelliteId, std::vector<Sp3Record>> records;  ///< ascending in time
  double step_s = 0;                                            ///< the most frequent one between epochs
  ReadReport report;
};

/// Reads the P records of `systems`. An epoch that does not follow the one before is left out, and told in
/// `report`, as damaged lines are. Throws InputError as PreciseSky says.
[[nodiscard]] Sp3File read_sp3(TextFile& file, const std::set<gnss::System>& systems);

}  // namespace canyon::orbit
