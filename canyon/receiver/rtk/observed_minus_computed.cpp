#include "canyon/receiver/rtk/observed_minus_computed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"

namespace canyon::rtk {

using geodesy::kSpeedOfLight;
using positioning::Measurement;
using positioning::RangedSatellite;

namespace {

constexpr double kUsualCn0_dbhz = 45;

}  // namespace

bool before(const ObservedMinusComputed& a, const ObservedMinusComputed& b) {
  if (a.id != b.id) return a.id < b.id;
  return gnss::index_of(*a.signal) < gnss::index_of(*b.signal);
}

std::vector<ObservedMinusComputed> observed_minus_computed(
    geodesy::GpsTime receiver_time, std::span<const SignalMeasurement> observations, const orbit::Sky& sky,
    const positioning::FixOptions& options, const Eigen::Vector3d& point,
    const std::map<gnss::System, gnss::Klobuchar>& klobuchar) {
  // Signals of a satellite leave it within nanoseconds: one state is enough.
  std::vector<Measurement> firsts;
  for (const SignalMeasurement& seen : observations)
    if (firsts.empty() || firsts.back().id != seen.measurement.id) firsts.push_back(seen.measurement);
  std::vector<RangedSatellite> satellites;
  range_satellites(receiver_time, firsts, sky, {}, satellites);
  const geodesy::Geodetic geodetic = geodesy::geodetic_from_ecef(point);
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(geodetic);

  // A receiver without any C/N0 is assumed to be in the open.
  const bool reported =
      std::any_of(observations.begin(), observations.end(),
                  [](const SignalMeasurement& seen) { return seen.measurement.cn0_dbhz.has_value(); });
  const double unknown_dbhz = reported ? positioning::kUnknownCn0_dbhz : kUsualCn0_dbhz;

  std::vector<ObservedMinusComputed> result;
  result.reserve(observations.size());
  for (RangedSatellite& satellite : satellites) {
    for (int i = 0; i < 3; ++i) update_satellite_geometry(satellite, point);
    const Eigen::Vector3d enu = enu_from_ecef * satellite.direction;
    const geodesy::AzimuthElevation look_angles = geodesy::azimuth_elevation_from_enu(enu);
    if (look_angles.elevation_rad < options.elevation_mask_rad || look_angles.elevation_rad == 0) continue;
    for (const SignalMeasurement& seen : observations) {
      const Measurement& m = seen.measurement;
      if (m.id != satellite.measured->id) continue;
      if (m.cn0_dbhz && *m.cn0_dbhz < options.cn0_mask_dbhz) continue;
      if (!std::isfinite(m.pseudorange_m) || !(m.carrier_frequency_hz > 0) ||
          (m.carrier_phase_cycles && !std::isfinite(*m.carrier_phase_cycles))) {
        throw InputError(fmt::format("{} of {} is invalid", seen.signal->name, gnss::to_string(m.id)),
                         "give finite pseudoranges and phases, and carriers above 0 Hz");
      }
      ObservedMinusComputed o;
      o.id = m.id;
      o.signal = seen.signal;
      o.direction = satellite.direction;
      o.elevation_rad = look_angles.elevation_rad;
      o.sigma_m = m.sigma_m;
      o.wavelength_m = kSpeedOfLight / m.carrier_frequency_hz;
      const receiver::ModelState model{&options,      &klobuchar, &satellite.state,
                                       seen.signal,   m.id,       m.carrier_frequency_hz,
                                       receiver_time, geodetic,   look_angles};
      const receiver::CodeAndCarrier sent = modelled_range(receiver::RangeTermOf::Satellite, model);
      const receiver::CodeAndCarrier space = modelled_range(receiver::RangeTermOf::Space, model);
      o.code_m = m.pseudorange_m - (satellite.range_m + space.code) - sent.code;
      if (m.carrier_phase_cycles) {
        o.phase_m =
            *m.carrier_phase_cycles * o.wavelength_m - (satellite.range_m + space.carrier) - sent.carrier;
      }
      const double cn0 = m.cn0_dbhz.value_or(unknown_dbhz);
      o.variance = 1 + 1 / (enu.z() * enu.z()) + std::pow(10, (45 - cn0) / 10);
      if (m.doppler_hz) o.doppler_mps = -*m.doppler_hz * o.wavelength_m;
      o.phase_since = m.phase_since;
      o.half_cycle = m.half_cycle;
      o.aligned = seen.aligned;
      result.push_back(o);
    }
  }
  std::sort(result.begin(), result.end(), before);
  return result;
}

}  // namespace canyon::rtk
