#include "canyon/heatmap/cells/tile_errors.hpp"

#include "canyon/receiver/receiver_draws.hpp"
#include "canyon/receiver/signal_range.hpp"

namespace canyon::heatmap {

const gnss::Signal* TileErrors::signal_of(gnss::SatelliteId id) const {
  std::vector<const gnss::Signal*> tracked;
  receiver::signals_to_track(options, id, time, tracked);
  return tracked.empty() ? nullptr : tracked.front();
}

double TileErrors::error_m(const propagation::SatelliteView& view, const gnss::Signal& signal,
                           double carrier_hz) const {
  const orbit::LineOfSight& line = view.line;
  const receiver::DelaysInSignal delays =
      receiver::delays_in_signal(options, klobuchar, view, carrier_hz, time, centre);
  const double corrected_m = positioning::atmosphere_m(
      options.fix.correct_ionosphere, options.fix.correct_troposphere, klobuchar, line.id.system, carrier_hz,
      time, centre, {line.azimuth_rad, line.elevation_rad});
  return delays.ionosphere_m + delays.troposphere_m - corrected_m + delays.orbit_error_m +
         receiver::fixed_bias_m(options.biases, line.id, signal, carrier_hz, time);
}

double TileErrors::sigma_factor(gnss::SatelliteId id, const gnss::Signal& signal) const {
  double product = 1;
  for (const auto& [group, factor] : options.ranging.sigma_factor) {
    if (gnss::in_group(group, id, signal, time)) product *= factor;
  }
  return product;
}

geodesy::Geodetic seen_from(const orbit::LineOfSight& line) {
  return geodesy::geodetic_from_ecef(line.position_at_reception_m - line.range_m * line.direction_ecef);
}

std::vector<FixSatellite> fix_satellites(const std::vector<orbit::LineOfSight>& lines,
                                         const geodesy::Geodetic& centre) {
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(centre);
  std::vector<FixSatellite> satellites;
  satellites.reserve(lines.size());
  for (const orbit::LineOfSight& line : lines) {
    satellites.push_back({line.id.system, enu_from_ecef * line.direction_ecef});
  }
  return satellites;
}

}  // namespace canyon::heatmap
