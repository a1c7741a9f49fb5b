#include "canyon/geodesy/rollover.hpp"

#include <gtest/gtest.h>

#include "canyon/geodesy/time_scales.hpp"

namespace canyon::geodesy {
namespace {

TEST(Rollover, WeeksThatAReceiverLost) {
  // 7,168 days are 1,024 weeks: 2004-09-15 and 2024-05-01.
  const GpsTime now = parse_time("2024-05-01T10:00:00Z"), lost = parse_time("2004-09-15T10:00:00Z");
  EXPECT_EQ(rollover_text(lost, now),
            "; 1024 weeks later it would be near: has a receiver's GPS week rolled over?");
  EXPECT_EQ(rollover_text(now, lost),
            "; 1024 weeks earlier it would be near: has a receiver's GPS week rolled over?");
  EXPECT_NE(rollover_text(lost + 7 * 86'400.0, now), "");
  EXPECT_EQ(rollover_text(lost + 9 * 86'400.0, now), "");
  EXPECT_EQ(rollover_text(now, now), "");
}

}  // namespace
}  // namespace canyon::geodesy
