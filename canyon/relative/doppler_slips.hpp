#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "canyon/gnss/satellite_id.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/relative/corrections.hpp"
#include "canyon/relative/observed_minus_computed.hpp"

namespace canyon::relative {

/// Finds phases of one receiver that moved by something else than their Doppler since the epoch before.
class DopplerSlips {
 public:
  /// Takes the next epoch, `dt_s` after the last one. @param rover those to look at @param measured all, with
  /// phase and Doppler. More than four steps must be known: their median is the receiver's clock.
  void update(double dt_s, std::span<const ObservedMinusComputed> rover,
              std::span<const SignalMeasurement> measured);
  /// Whether this phase slipped in the last epoch.
  [[nodiscard]] bool contains(gnss::SatelliteId id, const gnss::Signal* signal) const;

 private:
  struct Step {
    double phase_m = 0, doppler_mps = 0, apart_m = 0;
  };
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Step> last_steps_;
  std::vector<std::pair<gnss::SatelliteId, const gnss::Signal*>> slipped_;
};

}  // namespace canyon::relative
