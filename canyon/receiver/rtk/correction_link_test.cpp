#include "canyon/receiver/rtk/correction_link.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>

#include "canyon/base/random.hpp"

namespace canyon::rtk {
namespace {

using geodesy::GpsTime;

/// Number of a minute's epochs, one a second, that pass a link with this rate.
int count_through(double rate_hz, double jitter_s) {
  CorrectionOptions options;
  options.rate_hz = rate_hz;
  CorrectionLink link(options, 1, "rover");
  RandomStream random(7, "arrival");
  int came = 0;
  for (int i = 0; i < 60; ++i) {
    auto epoch = std::make_shared<Corrections>();
    epoch->receiver_time = GpsTime::from_week(2300, 1000.0 + i);
    const GpsTime now = epoch->receiver_time + jitter_s * random.uniform();
    link.send(now, std::move(epoch), std::nullopt);
    if (link.take(now)) ++came;
  }
  return came;
}

TEST(CorrectionLink, JitterOfArrivalDropsNoEpoch) {
  EXPECT_EQ(count_through(0, 0.2), 60);
  EXPECT_EQ(count_through(1, 0), 60);
  EXPECT_EQ(count_through(1, 0.2), 60);
  EXPECT_EQ(count_through(0.5, 0.2), 30);
  EXPECT_EQ(count_through(0.2, 0.2), 12);
}

}  // namespace
}  // namespace canyon::rtk
