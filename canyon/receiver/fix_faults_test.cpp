#include "canyon/receiver/fix_faults.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace canyon::receiver {
namespace {

using disturbance::FixEdit;
using disturbance::ReceiverEvents;

const geodesy::GpsTime kFirst = geodesy::GpsTime::from_week(2400, 0);

geodesy::GpsTime at(double seconds) {
  return kFirst + seconds;
}

/// The largest number of fixes stored after an epoch, in two hours at 10 Hz, and the age of the last reported
/// fix.
struct StoredFix {
  std::size_t maximum = 0;
  double age_s = 0;
};
StoredFix after_two_hours(const std::function<ReceiverEvents(double)>& events_at) {
  FixHistory history;
  StoredFix kept;
  for (int k = 0; k < 72'000; ++k) {
    const double now_s = k / 10.0;
    const ReceiverEvents events = events_at(now_s);
    positioning::Fix fix;
    fix.position_ecef.x() = now_s;
    history.add(at(now_s), fix, events);
    kept.maximum = std::max(kept.maximum, history.size());
    if (events.fix_edits.empty()) continue;
    const positioning::Fix* found = history.find(events.fix_edits.front());
    kept.age_s = found != nullptr ? now_s - found->position_ecef.x() : -1;
  }
  return kept;
}

ReceiverEvents edit_of(double edit_s, bool first = false) {
  ReceiverEvents events;
  events.fix_edits.emplace_back();
  events.fix_edits[0].of = at(edit_s);
  events.fix_edits[0].first = first;
  return events;
}

// 10 Hz: 0.4 s are four epochs, plus the newest as the fifth fix.
TEST(FixHistory, KeepsOnlyWhatFaultsMayStillReport) {
  const StoredFix none = after_two_hours([](double) { return ReceiverEvents(); });
  EXPECT_EQ(none.maximum, 0U);
  const StoredFix offset = after_two_hours([](double) {
    ReceiverEvents events;
    events.fix_edits.emplace_back();
    return events;
  });
  EXPECT_EQ(offset.maximum, 0U);

  const StoredFix stuck = after_two_hours([](double) { return edit_of(0, true); });
  EXPECT_EQ(stuck.maximum, 1U);
  EXPECT_DOUBLE_EQ(stuck.age_s, 7'199.9);

  const auto late = [](double now_s) {
    ReceiverEvents events = edit_of(now_s - 0.4);
    events.fixes_from = at(now_s - 0.4);
    return events;
  };
  EXPECT_EQ(after_two_hours(late).maximum, 5U);
  EXPECT_NEAR(after_two_hours(late).age_s, 0.4, 1e-9);

  // Each fix three times, and a late fault that begins after an hour.
  EXPECT_EQ(after_two_hours([](double now_s) { return edit_of(now_s - std::fmod(now_s, 0.3)); }).maximum, 1U);
  const StoredFix to_come = after_two_hours([](double now_s) {
    ReceiverEvents events = now_s < 3600 ? ReceiverEvents() : edit_of(now_s - 2);
    events.fixes_from = at(std::max(now_s, 3600.0) - 2);
    return events;
  });
  EXPECT_EQ(to_come.maximum, 21U);
  EXPECT_NEAR(to_come.age_s, 2, 1e-9);

  // A stuck one and a late one together.
  const StoredFix both = after_two_hours([&](double now_s) {
    ReceiverEvents events = edit_of(10.05, true);
    events.fix_edits.push_back(late(now_s).fix_edits[0]);
    events.fixes_from = at(now_s - 0.4);
    return events;
  });
  EXPECT_EQ(both.maximum, 6U);
  EXPECT_NEAR(both.age_s, 7'199.9 - 10.1, 1e-9) << "the first at or after 10.05 s";
}

TEST(FixHistory, HasNoFixFromBeforeItsFirst) {
  FixHistory history;
  ReceiverEvents events = edit_of(-2);
  events.fixes_from = at(-2);
  history.add(at(0), {}, events);
  EXPECT_EQ(history.find(events.fix_edits[0]), nullptr);
  events = edit_of(0);
  EXPECT_NE(history.find(events.fix_edits[0]), nullptr);
}

}  // namespace
}  // namespace canyon::receiver
