#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/receiver/receiver.hpp"

namespace canyon::receiver {

/// The fixes that faults may still report instead of a receiver's newest one.
class FixHistory {
 public:
  /// Adds the fix of the next epoch, in order of time, and drops those that no later fault can use.
  void add(geodesy::GpsTime time, const positioning::Fix& fix, const disturbance::ReceiverEvents& events) {
    if (events.fix_edits.empty() && !events.fixes_from) return fixes_.clear();
    fixes_.emplace_back(time, fix);
    std::vector<geodesy::GpsTime> requested;
    for (const disturbance::FixEdit& edit : events.fix_edits)
      if (const std::size_t at = position(edit.of, edit.first); at < size())
        requested.push_back(fixes_[at].first);
    std::size_t older = size();  // fixes that are not all kept
    if (events.fixes_from) {
      const std::size_t first = position(*events.fixes_from, false);
      older = first < size() ? first : 0;
    }
    const auto end = fixes_.begin() + static_cast<std::ptrdiff_t>(older);
    const auto unasked = [&](const auto& each) {
      return std::find(requested.begin(), requested.end(), each.first) == requested.end();
    };
    fixes_.erase(std::remove_if(fixes_.begin(), end, unasked), end);
  }

  /// The fix that an edit of the last epoch selects (FixEdit::of); null: there was none.
  [[nodiscard]] const positioning::Fix* find(const disturbance::FixEdit& edit) const {
    const std::size_t at = position(edit.of, edit.first);
    return at < size() ? &fixes_[at].second : nullptr;
  }
  [[nodiscard]] std::size_t size() const { return fixes_.size(); }

 private:
  /// Index of the last fix until `of`, or of the first from then on; size(): there is none.
  [[nodiscard]] std::size_t position(const std::optional<geodesy::GpsTime>& of, bool first) const {
    if (!of) return size();
    const auto after = std::partition_point(fixes_.begin(), fixes_.end(), [&](const auto& each) {
      return first ? each.first < *of : each.first <= *of;
    });
    const auto before = static_cast<std::size_t>(after - fixes_.begin());
    if (first) return before;
    return before > 0 ? before - 1 : size();
  }

  std::deque<std::pair<geodesy::GpsTime, positioning::Fix>> fixes_;
};

/// The stage after a Receiver: replaces its computed fixes by those that faults report
/// (ReceiverEvents::forced, fix_edits). Receivers never use the result: their filters, dead reckoning and
/// spoofing checks continue from the computed fixes. The default state is that of a receiver as constructed.
class FixFaults {
 public:
  /// Changes ReceiverEpoch::fix, single_epoch and SatelliteObservation::used. Epochs in order of time.
  /// @param antenna of the epoch
  void apply(const propagation::Antenna& antenna, ReceiverEpoch& epoch);

 private:
  /// Edits of one of an epoch's two fixes.
  struct Edits {
    void apply(const ReceiverEpoch& epoch, positioning::Fix& fix);

    FixHistory fixes;
    std::optional<geodesy::GpsTime> last, back;  // the last fix; the first one after an outage
  };

  Edits fix_, single_epoch_;
};

}  // namespace canyon::receiver
