#pragma once

#include <span>
#include <string>
#include <vector>

#include "canyon/calibration/levels.hpp"

// From levels of single satellites to those of groups. Private to canyon/calibration.

namespace canyon::calibration {

/// How much stronger a satellite's signal was in clear view than the receiver's budget says.
struct SatelliteLevel {
  std::size_t drive = 0;
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;
  geodesy::GpsTime time;
  double elevation_rad = 0;  ///< mean
  double level_db = 0, variance_db2 = 1;
  std::vector<double>
      drawn_db;  ///< level_db of blocks of time drawn with replacement, alike for all satellites
};

/// Levels of groups by a model of random effects: group + N(0, spread between satellites) + error of each.
/// The reference system's goes into the link budget, others' beside it into offsets, and those of blocks that
/// stand out (2.5 standard errors and 0.5 dB from the rest of their system). The spread is that of Paule and
/// Mandel (J. Res. NBS 87, 1982). Adds estimates, notes and values.
void add_satellite_levels(std::span<const SatelliteLevel> satellites, std::span<const std::string> drives,
                          const simulation::ReceiverConfig& receiver, Levels& levels);

}  // namespace canyon::calibration
