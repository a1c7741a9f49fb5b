#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/virtual_station.hpp"

namespace canyon::simulation {

/// An epoch of one receiver that a run has to compute.
struct DueEpoch {
  std::size_t receiver = 0;
  geodesy::GpsTime time;
};

/// Delivers corrections between receivers (given by index), and computes their epochs in the required order.
class CorrectionLinks {
 public:
  CorrectionLinks() = default;
  /// Links of a scenario. Throws as check_corrections().
  CorrectionLinks(const std::vector<ReceiverConfig>& receivers, std::uint64_t seed);

  /// From now on `rover` receives the corrections of `base` only.
  /// @param reports_true_position true: the base reports its true position; false: its fix of each epoch
  /// @param options of the rover @param seed of the link's jitter and losses
  void connect(std::size_t rover, std::size_t base, bool reports_true_position,
               const receiver::ReceiverOptions& options, std::uint64_t seed);
  /// The receiver gets no corrections any more.
  void disconnect(std::size_t rover);
  /// The base of a receiver; empty: it receives no corrections.
  [[nodiscard]] std::optional<std::size_t> base_of(std::size_t receiver) const;
  /// The order of the epochs of an instant: each receiver after its base, otherwise the given order.
  [[nodiscard]] std::vector<std::size_t> order(std::vector<std::size_t> receivers) const;

  /// Computes the epoch due[i] from the corrections that have arrived for it (null: none). The epoch must
  /// live until make_epochs() returns; null: there was no epoch.
  using Make = std::function<const Epoch*(std::size_t i, std::shared_ptr<const rtk::Corrections>)>;
  /// The epoch loop of runs and hosts' worlds: gets the corrections of an epoch, computes it, and sends its
  /// own corrections to its rovers. Epochs of a receiver must be in order of time and after its base's.
  /// @param parallel compute epochs of independent receivers on several threads
  void make_epochs(std::span<const DueEpoch> due, bool parallel, const Make& make);

 private:
  /// A receiver, and the corrections in transit to it.
  struct Node {
    std::optional<std::size_t> base;
    bool reports_true_position = false;
    std::optional<rtk::CorrectionLink> link;
    std::optional<VirtualStation> station;                 // if it uses one
    std::optional<Eigen::Vector3d> antenna_position_ecef;  // of its latest epoch [m]
    std::optional<Eigen::Vector3d> reported_ecef;          // its latest fix [m]
  };
  Node& node(std::size_t receiver);
  void send(std::size_t receiver, const Epoch& epoch);

  std::vector<Node> nodes_;  // by receiver
};

}  // namespace canyon::simulation
