#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <vector>

#include "canyon/base/record_notes.hpp"
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
  RecordNotes notes;
};

/// Reads the P records of `systems`; epochs out of order and records that contradict those around them are
/// left out, with warnings. Throws InputError as PreciseSky says.
[[nodiscard]] Sp3File read_sp3(TextFile& file, const std::set<gnss::System>& systems);

/// Leaves out the records that contradict the others of their satellite, and marks where orbits and clocks
/// jump. Positions are judged by gravity (Earth's mass and J2): of three records in a row the middle one is
/// where the outer ones and their accelerations put it, within 10 m and six times what is usual for the
/// satellite, at most 1e-4 m/s^2 of acceleration unexplained (some 20 m in steps of 5 min, 90 m of 15 min).
/// Clocks are judged likewise by straight lines, within 100 ns. Throws InputError where most satellites of
/// the file do not move as satellites do, or have no clock.
void review_sp3(Sp3File& sp3);

}  // namespace canyon::orbit
