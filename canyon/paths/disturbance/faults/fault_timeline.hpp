#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "canyon/paths/disturbance/faults/fault.hpp"

namespace canyon::disturbance {

/// Content of a timeline.
struct FaultState {
  std::string name;
  std::string_view kind;
  double from_s = 0;
  std::optional<double> until_s;
  bool active = false;
};

/// The faults of one receiver, which may change while it runs. Not thread-safe: changes belong between two
/// epochs.
class FaultTimeline {
 public:
  /// Surroundings of the receiver, for effects that need them.
  struct Surroundings {
    std::shared_ptr<const orbit::Sky> sky;
    std::shared_ptr<const city::City> city;
    std::shared_ptr<const raytrace::RayScene> rays;
    friend bool operator==(const Surroundings&, const Surroundings&) = default;
  };

  /// @param start where seconds count from @param receiver those of `faults` that do not name it are left out
  FaultTimeline(geodesy::GpsTime start, const std::vector<Fault>& faults, std::string receiver);

  /// Effects that are at work are made anew in other surroundings, and have no memory of before. Throws as
  /// Fault::check().
  void set_surroundings(Surroundings surroundings);
  /// False where it does not concern this receiver. Throws InputError for a name that stands there already,
  /// beyond 10,000 faults, and as Fault::check().
  bool add(Fault fault);
  /// Throws InputError where none of that name is still to come or at work, naming those that are.
  void end(const std::string& name, double at_s);
  [[nodiscard]] std::vector<FaultState> states(double now_s) const;
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  /// Number of the next fault, from 1; it makes a free name behind the fault's kind.
  [[nodiscard]] int next_number() const { return static_cast<int>(next_) + 1; }

  /// Source of a timeline: applies each fault's effect while begin <= now < end, in the timeline's order,
  /// made at its first epoch. Sets ReceiverEvents::faults.
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
