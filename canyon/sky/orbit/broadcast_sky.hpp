#pragma once

#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::orbit {

/// Satellite position, velocity and clock from one ephemeris of any age (IS-GPS-200 table 20-IV; Galileo
/// OS-SIS-ICD 5.1.1; BDS-SIS-ICD B1I 5.2.4.12 with the GEO rotation). Position within 1 mm and clock within
/// 0.1 ns of RTKLIB's.
[[nodiscard]] SatelliteState propagate(const gnss::KeplerEphemeris& ephemeris, geodesy::GpsTime t);
/// ICD GLONASS L1, L2 5.1, A.3.1.2: fourth-order Runge-Kutta, steps of at most 60 s. Within 1 cm of RTKLIB's.
[[nodiscard]] SatelliteState propagate(const gnss::GlonassEphemeris& ephemeris, geodesy::GpsTime t);
/// The same result, bit for bit, from states at whole steps of half an hour about toe, which the first call
/// computes. Thread-safe.
class GlonassOrbit {
 public:
  [[nodiscard]] SatelliteState propagate(const gnss::GlonassEphemeris& ephemeris, geodesy::GpsTime t) const;

 private:
  struct Steps;
  mutable std::once_flag computed_;
  mutable std::shared_ptr<const Steps> steps_;
};
/// RTCA DO-229 A.4.4.11: position, velocity and acceleration of the message in the rotating frame. Position
/// within 1e-6 m and clock within 1e-15 s of RTKLIB's.
[[nodiscard]] SatelliteState propagate(const gnss::SbasEphemeris& ephemeris, geodesy::GpsTime t);

struct BroadcastOptions {
  std::set<gnss::System> systems{gnss::kConstellations.begin(), gnss::kConstellations.end()};
  /// A record is used from toe - before to toe + after: half the fit interval on either side for GPS and QZSS
  /// (2 h if not given), Galileo 0.5 h and 4 h, BeiDou 1 h and 3 h, GLONASS 0.5 h and 0.5 h, SBAS 360 s and
  /// 360 s; reasons: validity() in broadcast_messages.hpp. With allow_stale any age (reported by source()).
  bool allow_stale = false;
  bool allow_unhealthy = false;
};

/// Satellites from broadcast ephemerides: for each satellite and time the record with the smallest |t - toe|
/// within the validity of its system; of equal ones (0.3 s) the newer. If this record is unhealthy, the
/// satellite is not available; an older healthy record would hide this. Galileo uses I/NAV if available (its
/// clock and BGD E5b/E1 belong to E1), else F/NAV. broadcast_messages.hpp defines "healthy" for each system.
class BroadcastSky final : public Sky {
 public:
  /// Throws InputError if no record is left after `systems`.
  explicit BroadcastSky(gnss::NavigationData data, BroadcastOptions options = {});
  ~BroadcastSky() override;

  [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override;
  [[nodiscard]] std::optional<SatelliteState> state(gnss::SatelliteId id, geodesy::GpsTime t) const override;
  [[nodiscard]] std::string source(gnss::SatelliteId id, geodesy::GpsTime t) const override;

  /// That of the record in use.
  [[nodiscard]] SatelliteHealth health(gnss::SatelliteId id, geodesy::GpsTime t) const override;
  /// "unhealthy (health 63)"; empty if health() is not Unhealthy.
  [[nodiscard]] std::string health_text(gnss::SatelliteId id, geodesy::GpsTime t) const;

  [[nodiscard]] const gnss::NavigationData& data() const { return data_; }
  /// True if a record is valid at `t` (used for "the trajectory is outside the ephemerides").
  [[nodiscard]] bool covers(geodesy::GpsTime t) const;
  /// First and last toe [GPST] over all records.
  [[nodiscard]] std::pair<geodesy::GpsTime, geodesy::GpsTime> span() const;

 private:
  struct Index;

  gnss::NavigationData data_;
  BroadcastOptions options_;
  std::vector<GlonassOrbit> glonass_;  ///< of data_.glonass
  std::unique_ptr<Index> index_;
};

}  // namespace canyon::orbit
