#include "canyon/receiver/spoofing_check.hpp"

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::receiver {

bool SpoofingCheck::gain_without_loss(const ReceiverEpoch& epoch) {
  constexpr double kMemory_s = 60;
  bool failed = false;
  for (const BandState& band : epoch.bands) {
    double sum = 0;
    int count = 0;
    const auto add = [&](const SignalObservation& signal) {
      if (!signal.measurement || !signal.measurement->cn0_dbhz) return;
      if (signal.signal->carrier_hz != band.carrier_hz) return;
      sum += *signal.measurement->cn0_dbhz;
      ++count;
    };
    for (const SatelliteObservation& satellite : epoch.satellites) satellite.for_each_signal(add);
    if (count == 0) continue;
    const double mean_dbhz = sum / count, agc_reduction_db = -20 * std::log10(band.agc());
    const auto [known, fresh] = strengths_.try_emplace(band.carrier_hz, Strength{mean_dbhz, epoch.time});
    Strength& before = known->second;
    if (agc_reduction_db >= options_.gain_db) {
      failed = failed || (!fresh && mean_dbhz >= before.mean_dbhz - agc_reduction_db / 2);
      continue;
    }
    before.mean_dbhz +=
        (mean_dbhz - before.mean_dbhz) * -std::expm1(-std::max(0.0, epoch.time - before.time) / kMemory_s);
    before.time = epoch.time;
  }
  return failed;
}

bool SpoofingCheck::jumped(const ReceiverEpoch& epoch) const {
  constexpr double kMax_s = 5;
  const positioning::Fix& now = epoch.fix;
  const double elapsed_s = epoch.time - fix_time_;
  if (!fix_ || elapsed_s > kMax_s) return false;
  if (now.velocity_enu_mps) {
    const Eigen::Vector3d velocity =
        geodesy::enu_from_ecef_rotation(now.position).transpose() * *now.velocity_enu_mps;
    if ((now.position_ecef - fix_->position_ecef - velocity * elapsed_s).norm() >= options_.jump_m)
      return true;
  }
  for (const auto& [system, bias_s] : now.clock_bias_s) {
    const auto before = fix_->clock_bias_s.find(system);
    if (before == fix_->clock_bias_s.end() || !now.clock_drift) continue;
    const double jump_s = bias_s - before->second - *now.clock_drift * elapsed_s;
    if (std::abs(jump_s) * geodesy::kSpeedOfLight >= options_.jump_m) return true;
  }
  return false;
}

SpoofingState SpoofingCheck::update(const ReceiverEpoch& epoch) {
  if (gain_without_loss(epoch)) gain_failed_ = epoch.time;
  if (epoch.fix.solved() && jumped(epoch)) jump_failed_ = epoch.time;
  if (epoch.fix.solved()) {
    fix_ = epoch.fix;
    fix_time_ = epoch.time;
  }
  const auto counts = [&](const std::optional<geodesy::GpsTime>& failed) {
    return failed && epoch.time - *failed <= options_.hold_s;
  };
  const bool gain = counts(gain_failed_), jump = counts(jump_failed_);
  if (gain && jump) return SpoofingState::Multiple;
  return gain || jump ? SpoofingState::Indicated : SpoofingState::None;
}

}  // namespace canyon::receiver
