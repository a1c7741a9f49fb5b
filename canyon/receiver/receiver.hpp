#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/observation.hpp"
#include "canyon/receiver/positioning/fusion/dead_reckoning.hpp"
#include "canyon/receiver/receiver_options.hpp"

namespace canyon::rtk {
struct Corrections;
}

namespace canyon::receiver {

/// The vehicle's sensors as available to a receiver.
struct VehicleSensors {
  positioning::SensorMounting mounting;
  positioning::SensorReadings readings;  ///< since the epoch before
};

/// Inputs of a receiver at an epoch.
struct EpochContext {
  propagation::Antenna antenna;
  propagation::Arrival& arrival;  ///< from the environment; disturbed in place
  const orbit::Sky& sky;          ///< for the fix, if arrival.broadcast is null
  /// Needed if ReceiverOptions::ionosphere or FixOptions::correct_ionosphere is on.
  const std::map<gnss::System, gnss::Klobuchar>& klobuchar;
  /// Corrections received from a reference station since the last epoch; null: none.
  const rtk::Corrections* corrections = nullptr;
  /// Used with ReceiverOptions::dead_reckoning; null: satellites only.
  const VehicleSensors* sensors = nullptr;
};

/// The state of one antenna's receiver: disturbances, clock, noise, channels and filters. Equal options and
/// seed give equal results, independent of other receivers and (with independent_noise: false) of its name.
/// Epochs must be given in order of time.
///
/// If corrections of at most CorrectionOptions::max_age_s exist, the fix is differential: it uses the
/// satellites with a correction (CodeCorrections). Without a solution or corrections, it uses all.
///
/// P = r + excess + c (bias - (satellite clock - group delay)) + ionosphere + troposphere + orbit error +
/// noise; r: geometric range to the satellite at transmission, rotated with the Earth (docs/receiver.md).
class Receiver {
 public:
  /// @param disturbances applied after that of SignalOptions::shadowing, in this order
  /// @param models replace the receiver's weights and position solver; empty: none. Throws InputError if
  /// options.validate() does, or a disturbance cannot be made.
  Receiver(ReceiverOptions options, std::uint64_t seed,
           std::span<const disturbance::DisturbanceSource> disturbances = {}, const ModelSource& models = {});
  ~Receiver();
  Receiver(Receiver&&) noexcept;
  Receiver& operator=(Receiver&&) noexcept;

  [[nodiscard]] const ReceiverOptions& options() const;

  /// Disturbs the arrival, then measures it. The fixes are the computed ones: FixFaults applies the events
  /// of reported fixes. Times must not run backwards; a containment other than Free
  /// gives status NoSignal. Throws InputError, naming the receiver, for a pose that is not finite, time
  /// running backwards, missing Klobuchar coefficients, corrections that are not numbers, and, with strength,
  /// code correlators too far apart for a satellite's signal. With strength, paths need the inputs of their
  /// strength (PathGeometry, Path::reflector, Path::scattered_power).
  [[nodiscard]] ReceiverEpoch observe(const EpochContext& context);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::receiver
