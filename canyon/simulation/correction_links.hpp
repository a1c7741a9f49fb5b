#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "canyon/relative/correction_link.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/simulation/scenario.hpp"
#include "canyon/simulation/virtual_station.hpp"

namespace canyon::simulation {

/// Throws InputError where receivers[index] cannot take the corrections that it names: of no receiver of the
/// run, of itself, of one without a fixed place, of one that needs its own in turn, or of one that draws the
/// same noise.
void check_corrections(const std::vector<ReceiverConfig>& receivers, std::size_t index);

/// Whether a receiver compares what it measures with a base.
[[nodiscard]] inline bool has_base(const receiver::ReceiverOptions& options) {
  return options.rtk.enabled || !options.corrections.from.empty();
}

/// The receiver of the same run whose corrections one takes; empty: it takes none, or those of a stream.
[[nodiscard]] std::optional<ReceiverConfig> base_of(const std::vector<ReceiverConfig>& receivers,
                                                    const ReceiverConfig& receiver);

/// What receivers of a run are given of each other.
class CorrectionLinks {
 public:
  /// Throws as check_corrections(). Call FixedPlace::settle() of fixed places first.
  CorrectionLinks(const std::vector<ReceiverConfig>& receivers, std::uint64_t seed);

  /// The order of computing an epoch: a receiver behind that whose corrections it takes, else as they stand.
  [[nodiscard]] const std::vector<std::size_t>& order() const { return order_; }
  /// Whose corrections a receiver takes.
  [[nodiscard]] std::optional<std::size_t> base_of(std::size_t receiver) const { return base_[receiver]; }
  /// An epoch of Epoch::receiver was made: its corrections are on their way to those that take them.
  void send(const Epoch& epoch);
  /// The latest that has come for a receiver by `time` since the last call; null: none.
  [[nodiscard]] std::shared_ptr<const relative::Corrections> take(std::size_t receiver,
                                                                  geodesy::GpsTime time);

 private:
  std::vector<std::optional<std::size_t>> base_;
  std::vector<bool> fixed_;  // has a place
  std::vector<std::size_t> order_;
  std::vector<std::optional<relative::CorrectionLink>> links_;  // to each receiver that takes any
  std::vector<std::optional<Eigen::Vector3d>> places_;          // ECEF, of each receiver's latest epoch [m]
  std::vector<std::optional<Eigen::Vector3d>> reported_;        // and its latest fix
  std::vector<std::optional<VirtualStation>> virtual_;          // of each receiver that asks for one
};

}  // namespace canyon::simulation
