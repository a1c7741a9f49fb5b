#pragma once

#include <filesystem>
#include <memory>
#include <set>
#include <vector>

#include "canyon/base/read_report.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::orbit {

/// Satellites from SP3-c or SP3-d precise orbits. A Kepler orbit with J2's secular rates is subtracted from
/// the positions, turned to axes that do not rotate; the rest, kilometres of it, is a Lagrange polynomial
/// through 11 records, velocity its derivative (within 1 mm/s). Clocks are linear between records, relativity
/// of eccentric orbits added (-2 r.v/c^2, which SP3 clocks leave out). Leaving out every second record of a
/// 15-minute file gives the left-out ones back within 5 cm, the eccentric Galileo satellites included; at the
/// very ends of the file, where the 11 records lie on one side, the error grows to decimetres.
///
/// No answer beyond the file's first and last epoch, in gaps of more than `kMaxGap` records, between two
/// records with a maneuver (flag M) or a jump of the clock (E) between them, next to records
/// that the file marks as bad in position (0.000000) or clock (999999.999999), and where fewer than 11
/// records follow one another. Positions refer to the centre of mass. The group delay is 0, and GLONASS
/// frequencies, which SP3 does not have, are those of the nominal constellation.
class PreciseSky final : public Sky {
 public:
  static constexpr int kMaxGap = 2;  ///< records

  /// Plain or gzip. Records of other systems, velocities (V) and correlations (EP, EV) are passed over.
  /// Throws InputError with file and line for anything that is not SP3-c/d, for where most of its records are
  /// damaged, and where no satellite of `systems` is in it.
  explicit PreciseSky(const std::filesystem::path& path,
                      std::set<gnss::System> systems = {gnss::kConstellations.begin(),
                                                        gnss::kConstellations.end()});
  explicit PreciseSky(TextFile file, std::set<gnss::System> systems = {gnss::kConstellations.begin(),
                                                                       gnss::kConstellations.end()});
  /// Files of several days, in any order, as one: IGS files end at 23:45, so that a run over midnight needs
  /// two. Where several files have records of one instant, that of the earliest file counts, unless it is
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

}  // namespace canyon::orbit
