#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "canyon/live/hosted_receiver.hpp"
#include "canyon/simulation/correction_links.hpp"

namespace canyon::live {

/// Corrections between the receivers of one world: `corrections.from` of one is the name of another. A base
/// on the same vehicle moves, and gives the vehicle's heading. One elsewhere is a station that states its
/// true place. Not thread-safe.
class HostBases {
 public:
  /// @param vehicle the same for receivers of one vehicle
  void add(HostedReceiver& receiver, std::uint64_t vehicle);
  void remove(const HostedReceiver& receiver);

  /// Call it between HostedReceiver::begin() and finish() of the receivers of an instant. It finds their
  /// bases, and puts these before those that take their corrections; others keep their order.
  void sort(std::vector<HostedReceiver*>& due);
  /// HostedReceiver::finish() with the corrections that have come, and sends those of its epoch. Receivers of
  /// one instant in the order of sort().
  void finish(HostedReceiver& receiver);

 private:
  struct Member {
    HostedReceiver* receiver = nullptr;
    std::uint64_t vehicle = 0;
    HostedReceiver* base = nullptr;  // found; null: it has none, or it is not there
    std::optional<simulation::CorrectionLinks> links;
    std::int64_t last_ns = 0;
  };
  [[nodiscard]] Member* member_of(const HostedReceiver* receiver);
  [[nodiscard]] Member* named(const std::string& name, const HostedReceiver& except);
  void find_base(Member& member);
  [[nodiscard]] std::string names() const;

  std::vector<Member> members_;
};

}  // namespace canyon::live
