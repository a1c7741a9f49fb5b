#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "canyon/paths/disturbance/faults/fault.hpp"

namespace canyon::disturbance {

/// Contents of a timeline.
struct FaultState {
  std::string name;
  std::string_view kind;
  double from_s = 0;
  std::optional<double> until_s;
  bool active = false;
};

/// The faults of one receiver, which may change during a run. Not thread-safe: change it between epochs.
class FaultTimeline {
 public:
  /// Environment of the receiver, for effects that need it.
  struct Surroundings {
    std::shared_ptr<const orbit::Sky> sky;
    std::shared_ptr<const city::City> city;
    std::shared_ptr<const raytrace::RayScene> rays;
    friend bool operator==(const Surroundings&, const Surroundings&) = default;
  };

  /// @param start origin of the timeline's seconds @param receiver faults that do not act on it are left out
  FaultTimeline(geodesy::GpsTime start, const std::vector<Fault>& faults, std::string receiver);

  /// Active effects are rebuilt in the new environment and lose their memory. Throws as Fault::check().
  void set_surroundings(Surroundings surroundings);
  /// Returns false if the fault does not act on this receiver. Throws InputError if the name exists already,
  /// beyond 10,000 faults, and as Fault::check().
  bool add(Fault fault);
  /// Throws InputError if no future or active fault has that name; the message has the names that exist.
  void end(const std::string& name, double at_s);
  [[nodiscard]] std::vector<FaultState> states(double now_s) const;
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  /// Number of the next fault, from 1; kind and number together make an unused name.
  [[nodiscard]] int next_number() const { return static_cast<int>(next_) + 1; }

  /// Source of a timeline: applies each fault's effect while begin <= now < end, in the timeline's order. An
  /// effect is created at its first epoch. Sets ReceiverEvents::faults.
  [[nodiscard]] static DisturbanceSource source(std::shared_ptr<const FaultTimeline> timeline);

 private:
  class Effects;
  struct Entry {
    std::uint64_t number;
    Fault fault;
  };

  geodesy::GpsTime start_;
  std::string receiver_;
  Surroundings surroundings_;
  std::vector<Entry> entries_;
  std::uint64_t next_ = 0;
};

}  // namespace canyon::disturbance
