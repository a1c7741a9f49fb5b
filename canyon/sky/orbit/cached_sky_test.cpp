#include "canyon/sky/orbit/cached_sky.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/rinex_sample.hpp"

namespace canyon::orbit::carried_sky_test {
namespace {

const geodesy::GpsTime kTime = geodesy::parse_time("2026-06-01T08:10:00Z");

std::shared_ptr<const Sky> nominal() {
  static const auto sky = std::make_shared<BroadcastSky>(
      nominal_constellation(kTime, kTime + 3600, {gnss::kAllSystems.begin(), gnss::kAllSystems.end()}));
  return sky;
}

/// Deviation of a carried sky from its sky at two thousand instants that are not multiples of 0.5 s.
struct Apart {
  double position_m = 0, velocity_mps = 0, clock_s = 0;
};
Apart apart(const std::shared_ptr<const Sky>& sky, geodesy::GpsTime from) {
  const CachedSky carried(sky);
  EXPECT_EQ(carried.satellites(), sky->satellites());
  Apart maximum;
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    for (const gnss::SatelliteId id : sky->satellites()) {
      const auto is = carried.state(id, from + 0.317 * i), must = sky->state(id, from + 0.317 * i);
      EXPECT_EQ(is.has_value(), must.has_value());
      if (!is || !must) continue;
      ++compared;
      maximum.position_m = std::max(maximum.position_m, (is->position_m - must->position_m).norm());
      maximum.velocity_mps = std::max(maximum.velocity_mps, (is->velocity_mps - must->velocity_mps).norm());
      maximum.clock_s = std::max(maximum.clock_s, std::abs(is->clock_bias_s - must->clock_bias_s));
      EXPECT_EQ(is->group_delay_s, must->group_delay_s);
    }
  }
  EXPECT_GE(compared, 2000);
  return maximum;
}

TEST(CachedSky, IsTheSkyWithinMicrometres) {
  const Apart ellipse_error = apart(nominal(), kTime);
  EXPECT_LT(ellipse_error.position_m, 4e-6);
  EXPECT_LT(ellipse_error.velocity_mps, 3e-5);
  EXPECT_LT(ellipse_error.clock_s, 1e-16);
  const auto messages = std::make_shared<BroadcastSky>(
      rinex::read_rinex_navigation(TextFile::from_string(test::kRinex3Sample, "sample.rnx")));
  const Apart sent = apart(messages, messages->span().first);
  EXPECT_LT(sent.position_m, 2e-6);
  EXPECT_LT(sent.velocity_mps, 5e-6);
  EXPECT_LT(sent.clock_s, 1e-16);
}

TEST(CachedSky, AnswersDoNotDependOnWhatWasAskedBefore) {
  const CachedSky one(nominal()), other(nominal());
  const gnss::SatelliteId id{gnss::System::GPS, 5};
  const Eigen::Vector3d first = one.state(id, kTime + 0.123)->position_m;
  for (const double dt : {0.0, 7.0, -3.0, 0.1}) (void)other.state(id, kTime + dt);
  EXPECT_EQ(other.state(id, kTime + 0.123)->position_m, first);
  Eigen::Vector3d in_thread;
  std::thread([&] { in_thread = one.state(id, kTime + 0.123)->position_m; }).join();
  EXPECT_EQ(in_thread, first);
}

TEST(CachedSky, AValidityThatBeginsWithinAStepIsKept) {
  class Late final : public Sky {
   public:
    [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override {
      return nominal()->satellites();
    }
    [[nodiscard]] std::optional<SatelliteState> state(gnss::SatelliteId id,
                                                      geodesy::GpsTime t) const override {
      return t - kTime < 0.05 ? std::nullopt : nominal()->state(id, t);
    }
    [[nodiscard]] std::string source(gnss::SatelliteId, geodesy::GpsTime) const override { return "late"; }
  };
  const CachedSky sky(std::make_shared<Late>());
  const gnss::SatelliteId id{gnss::System::GPS, 5};
  EXPECT_FALSE(sky.state(id, kTime + 0.04));
  EXPECT_TRUE(sky.state(id, kTime + 0.06));
  EXPECT_FALSE(sky.state({gnss::System::GPS, 63}, kTime + 1));
  EXPECT_EQ(sky.source(id, kTime), "late");
  EXPECT_EQ(sky.health(id, kTime), SatelliteHealth::Unknown);
  EXPECT_THROW(CachedSky(nullptr), InputError);
}

}  // namespace
}  // namespace canyon::orbit::carried_sky_test
