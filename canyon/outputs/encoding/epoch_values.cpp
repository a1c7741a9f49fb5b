#include "canyon/outputs/encoding/epoch_values.hpp"

#include <fmt/format.h>
#include <array>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::encoding {

std::string_view no_fix_reason(const positioning::Fix& fix, raytrace::Containment containment) {
  if (fix.status == positioning::FixStatus::NoSignal && containment == raytrace::Containment::Unknown)
    return "no pose: the antenna's position is not known";
  return positioning::reason(fix.status);
}

std::string_view containment_word(raytrace::Containment containment) {
  static constexpr std::array<std::string_view, 4> kWords{"free", "inside building", "under terrain",
                                                          "unknown"};
  return kWords.at(static_cast<std::size_t>(containment));
}

bool measured(const receiver::SatelliteObservation& satellite) {
  return satellite.measurement || std::any_of(satellite.more.begin(), satellite.more.end(),
                                              [](const auto& s) { return s.measurement.has_value(); });
}

std::optional<bool> wrong_fix(const simulation::Epoch& epoch) {
  const positioning::Fix& fix = epoch.observed.fix;
  if (fix.kind() != positioning::FixKind::Fixed) return std::nullopt;
  const double km = fix.baseline ? fix.baseline->length_m() / 1e3 : 0;
  return horizontal_m(epoch.error_enu_m) > 0.1 + 1e-3 * km ||
         std::abs(epoch.error_enu_m.z()) > 0.2 + 2e-3 * km;
}

std::optional<double> heading_deg(const positioning::Fix& fix, int decimals) {
  const auto& baseline = fix.baseline;
  if (!baseline || !baseline->moving_base || baseline->kind != positioning::FixKind::Fixed)
    return std::nullopt;
  return wrapped_azimuth_deg(baseline->heading_rad(), decimals);
}

double wrapped_azimuth_deg(double azimuth_rad, int decimals) {
  double deg = std::fmod(geodesy::degrees(azimuth_rad), 360.0);
  if (deg < 0) deg += 360.0;
  const double half_step = 0.5 * std::pow(10.0, -decimals);
  return deg >= 360.0 - half_step ? 0.0 : deg;
}

std::string fault_names(const std::vector<std::string>& faults) {
  return fmt::format("{}", fmt::join(faults, "; "));
}

double horizontal_m(const Eigen::Vector3d& error_enu_m) {
  return std::hypot(error_enu_m.x(), error_enu_m.y());
}

std::complex<double> first_signal_amplitude(const receiver::SatelliteObservation& satellite,
                                            const propagation::SatelliteView& view,
                                            const propagation::Path& path,
                                            const tracking::SignalOptions& signal) {
  if (!signal.enabled) return 0;
  const gnss::Signal& first =
      satellite.signal != nullptr ? *satellite.signal : gnss::signals_of(satellite.id.system).front();
  const double carrier_hz = gnss::carrier_hz(first, view.line.state.carrier_frequency_hz);
  return signal::path_amplitude(path, view.line.elevation_rad, carrier_hz, signal.antenna, signal.strength);
}

}  // namespace canyon::encoding
