#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/run/epoch.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/run/virtual_station.hpp"

namespace canyon::simulation {

/// An epoch of one receiver that a run has to make.
struct DueEpoch {
  std::size_t receiver = 0;
  geodesy::GpsTime time;
};

/// Transports corrections between receivers that are known by number, and makes their epochs in the order
/// that this needs.
class CorrectionLinks {
 public:
  CorrectionLinks() = default;
  /// Those of a scenario. Throws as check_corrections().
  CorrectionLinks(const std::vector<ReceiverConfig>& receivers, std::uint64_t seed);

  /// From now on `rover` takes the corrections of `base`, and of no other.
  /// @param states_place the base states its true place; false: its fix of each epoch
  /// @param options of the rover @param seed of the link's jitter and losses
  void connect(std::size_t rover, std::size_t base, bool states_place,
               const receiver::ReceiverOptions& options, std::uint64_t seed);
  /// It takes none.
  void disconnect(std::size_t rover);
  /// The receiver whose corrections one takes.
  [[nodiscard]] std::optional<std::size_t> base_of(std::size_t receiver) const;
  /// The order of the epochs of an instant: each of `receivers` behind its base, else as they are given.
  [[nodiscard]] std::vector<std::size_t> order(std::vector<std::size_t> receivers) const;

  /// Makes the epoch due[i] from the corrections that have come for it; null: none have. The epoch must live
  /// until make_epochs() returns; null: there was none.
  using Make = std::function<const Epoch*(std::size_t i, std::shared_ptr<const relative::Corrections>)>;
  /// The one loop over epochs, of runs and of hosts' worlds: takes the corrections of each epoch, makes it,
  /// and sends its own corrections to those that take them. Epochs of a receiver must be in order of time,
  /// and behind those of its base.
  /// @param parallel make epochs of receivers that need nothing of each other on several threads
  void make_epochs(std::span<const DueEpoch> due, bool parallel, const Make& make);

 private:
  /// A receiver, and what is on its way to it.
  struct Node {
    std::optional<std::size_t> base;
    bool states_place = false;
    std::optional<relative::CorrectionLink> link;
    std::optional<VirtualStation> station;         // where it asks for one
    std::optional<Eigen::Vector3d> place_ecef;     // of its latest epoch [m]
    std::optional<Eigen::Vector3d> reported_ecef;  // its latest fix [m]
  };
  Node& node(std::size_t receiver);
  void send(std::size_t receiver, const Epoch& epoch);

  std::vector<Node> nodes_;  // by receiver
};

}  // namespace canyon::simulation
