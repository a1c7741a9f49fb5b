#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "canyon/disturbance/receiver_events.hpp"
#include "canyon/propagation/arrival.hpp"

namespace canyon::disturbance {

/// An effect that no map and no orbit knows: traffic, foliage, jamming, spoofing, a restart. It stands
/// between what arrives at one antenna and its receiver, offline and live alike, and may have memory. It
/// overrides apply(), happen() or both.
class Disturbance {
 public:
  virtual ~Disturbance() = default;
  Disturbance() = default;
  Disturbance(const Disturbance&) = delete;
  Disturbance& operator=(const Disturbance&) = delete;

  /// Changes what arrives at one epoch; called once for each, in order of time. It may
  /// - weaken a path (Path::amplitude_factor), delay it (excess_m, never below 0 but on a spoofer's), take it
  /// out, or
  ///   add one;
  /// - take a satellite's view out, or add one (sorted by id at the end);
  /// - add what interferes (Arrival::interference): each signal's noise follows from its spectrum.
  /// Order of paths and Visibility are made anew behind the last disturbance. Where arrival.placement is not
  /// Free no path arrives.
  virtual void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& /*arrival*/) {}
  /// Reports events of the receiver itself at this epoch; called right behind apply(). Clock and date: add to
  /// the values of others. The last of several restarts at one epoch counts.
  virtual void happen(const propagation::Antenna& /*antenna*/, ReceiverEvents& /*events*/) {}
};

/// Maker of one receiver's disturbance, in its state before the first epoch.
struct Source {
  /// Stands for all that `make` depends on but its arguments: "jammer at 114.18, 22.3, 10 W". Sources of one
  /// name are taken as the same where heat maps are stored.
  std::string name;
  /// @param seed of the run; @param receiver name: random streams are RandomStream(seed, receiver + "/..."),
  /// and so do not depend on what else runs.
  std::function<std::unique_ptr<Disturbance>(std::uint64_t seed, const std::string& receiver)> make;
};

}  // namespace canyon::disturbance
