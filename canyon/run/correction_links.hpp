#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/run/epoch.hpp"
#include "canyon/run/scenario/scenario.hpp"

namespace canyon::simulation {

/// A network's virtual reference station: a base's measurements as they would be at the place that a rover
/// reports. Codes and phases move by the difference of the terms of satellites and of space between both
/// places (receiver::range_terms(), as the base's options switch them): a network that knows the atmosphere
/// without an error. Noise and echoes stay the base's. The station keeps its place until the rover reports
/// one more than kMove_m away; then the phases begin anew.
class VirtualStation {
 public:
  static constexpr double kMove_m = 5000;

  /// @param base with Epoch::environment and options
  /// @param reported_ecef the rover's last fix [m]
  /// @return the base's epoch with measurements and true place of the virtual station. Its fix stays the
  /// base's. Empty as long as nothing was reported, as a caster that has no GGA yet sends nothing
  [[nodiscard]] std::optional<Epoch> move(const Epoch& base,
                                          const std::optional<Eigen::Vector3d>& reported_ecef);

 private:
  std::optional<Eigen::Vector3d> place_;
  geodesy::GpsTime since_;
};

/// An epoch of one receiver that a run has to make.
struct DueEpoch {
  std::size_t receiver = 0;
  geodesy::GpsTime time;
};

/// Makes the epochs of a run's receivers and transports corrections between them.
class CorrectionLinks {
 public:
  /// Throws as check_corrections(). Call FixedPlace::settle() of fixed places first.
  CorrectionLinks(const std::vector<ReceiverConfig>& receivers, std::uint64_t seed);

  /// The order of computing an epoch: a base before its rovers, else the scenario's order.
  [[nodiscard]] const std::vector<std::size_t>& order() const { return order_; }
  /// The receiver whose corrections one takes.
  [[nodiscard]] std::optional<std::size_t> base_of(std::size_t receiver) const { return base_[receiver]; }
  /// Makes the epoch due[i] from the corrections that have come for it; null: none have. The epoch must live
  /// until make_epochs() returns.
  using Make = std::function<Epoch&(std::size_t i, std::shared_ptr<const relative::Corrections>)>;
  /// The one loop over epochs, which Simulation::run(), live sessions and hosts feed: takes the corrections
  /// of each epoch, makes it, and sends its own corrections to those that take them. Epochs of a receiver
  /// must be in order of time, and behind those of its base. Sets Epoch::receiver.
  /// @param parallel make epochs of receivers that need nothing of each other on several threads
  void make_epochs(std::span<const DueEpoch> due, bool parallel, const Make& make);
  /// An epoch of Epoch::receiver was made: its corrections are on their way to those that take them.
  void send(const Epoch& epoch);
  /// The latest that has come for a receiver by `time` since the last call; null: none.
  [[nodiscard]] std::shared_ptr<const relative::Corrections> take(std::size_t receiver,
                                                                  geodesy::GpsTime time);

 private:
  std::vector<std::optional<std::size_t>> base_;
  std::vector<bool> fixed_;  // has a place
  std::vector<std::size_t> order_;
  std::vector<std::optional<relative::CorrectionLink>> links_;  // to each receiver that has a base
  std::vector<std::optional<Eigen::Vector3d>> places_;          // ECEF, of each receiver's latest epoch [m]
  std::vector<std::optional<Eigen::Vector3d>> reported_;        // and its latest fix
  std::vector<std::optional<VirtualStation>> virtual_;          // of each receiver that asks for one
};

}  // namespace canyon::simulation
