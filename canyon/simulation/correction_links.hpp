#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/receiver/corrections.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::simulation {

/// Throws InputError where receivers[index] cannot take the corrections that it names: of no receiver of the
/// run, of itself, of one without a fixed place, of one that needs its own in turn, or of one that draws the
/// same noise.
void check_corrections(const std::vector<ReceiverConfig>& receivers, std::size_t index);

/// What receivers of a run are given of each other.
class CorrectionLinks {
 public:
  /// Throws as check_corrections(). Call FixedPlace::settle() of fixed places first.
  explicit CorrectionLinks(const std::vector<ReceiverConfig>& receivers);

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
  struct Sent {
    geodesy::GpsTime time;
    std::shared_ptr<const relative::Corrections> corrections;
  };
  std::vector<std::optional<std::size_t>> base_;
  std::vector<std::size_t> order_;
  std::vector<std::deque<Sent>> on_their_way_;  // to each receiver, in order of time
};

}  // namespace canyon::simulation
