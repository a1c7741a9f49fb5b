#pragma once

#include <filesystem>
#include <memory>
#include <set>

#include "canyon/base/text_file.hpp"
#include "canyon/orbit/sky.hpp"

namespace canyon::orbit {

/// Satellites from SP3-c or SP3-d precise orbits: Lagrange polynomials of 11 points over the ECEF positions
/// turned to a common epoch, clocks linear between records, relativity of eccentric orbits added.
/// No answer beyond the file's first and last epoch, in gaps of more than `kMaxGap` records, or where the file
/// marks position (0.000000) or clock (999999.999999) as bad. Positions refer to the centre of mass.
class PreciseSky final : public Sky {
 public:
  static constexpr int kMaxGap = 2;  ///< records

  /// Plain or gzip. Throws InputError with file and line for anything that is not SP3-c/d.
  explicit PreciseSky(const std::filesystem::path& path,
                      std::set<System> systems = {kAllSystems.begin(), kAllSystems.end()});
  explicit PreciseSky(TextFile file, std::set<System> systems = {kAllSystems.begin(), kAllSystems.end()});
  ~PreciseSky() override;

  [[nodiscard]] std::vector<SatelliteId> satellites() const override;
  [[nodiscard]] std::optional<SatelliteState> state(SatelliteId id, geodesy::GpsTime t) const override;
  [[nodiscard]] std::string source(SatelliteId id, geodesy::GpsTime t) const override;

  [[nodiscard]] std::pair<geodesy::GpsTime, geodesy::GpsTime> span() const;

 private:
  struct Table;
  std::unique_ptr<Table> table_;
};

}  // namespace canyon::orbit
