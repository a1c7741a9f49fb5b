#include "canyon/simulation/trace_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"

namespace canyon::simulation {
namespace {

using geodesy::GpsTime;
using propagation::Arrival;
using propagation::Path;

struct Drive {
  propagation::PropagationOptions options = [] {
    propagation::PropagationOptions o;
    o.reflection_order = 2;
    o.diffraction = o.diffuse = true;
    return o;
  }();
  GpsTime begin = geodesy::parse_time("2026-06-01T08:00:00.3Z");
  Environment environment{city::synthetic_city({}),
                          std::make_shared<orbit::BroadcastSky>(
                              orbit::nominal_constellation(begin, begin + 3600.0, {gnss::System::GPS}))};

  static Eigen::Vector3d point_at(std::size_t k) { return {0.25 * static_cast<double>(k) - 50, 0.3, 2}; }
  [[nodiscard]] GpsTime at(std::size_t k) const { return begin + 0.1 * static_cast<double>(k); }
};

void expect_equal(const Arrival& a, const Arrival& b) {
  ASSERT_EQ(a.views.size(), b.views.size());
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    ASSERT_EQ(a.views[i].paths.paths.size(), b.views[i].paths.paths.size());
    for (std::size_t k = 0; k < a.views[i].paths.paths.size(); ++k) {
      EXPECT_EQ(a.views[i].paths.paths[k].excess_m, b.views[i].paths.paths[k].excess_m);
    }
  }
}

// A run in any order, and a live receiver: the same arrivals.
TEST(Retracing, RunsAndLiveReceiversHaveTheSameArrivals) {
  const Drive drive;
  constexpr std::size_t kCount = 40;
  const std::vector<propagation::Propagator> propagators{drive.environment.make_propagator(drive.options)};
  RetracedAntenna live(propagators.front());
  std::vector<Arrival> expected;
  std::size_t others = 0;
  for (std::size_t k = 0; k < kCount; ++k) {
    expected.push_back(live.arrival(drive.environment, drive.at(k), Drive::point_at(k)));
    const Arrival restarted = drive.environment.arrival(drive.at(k), Drive::point_at(k), propagators.front());
    ASSERT_EQ(expected.back().views.size(), restarted.views.size());
    for (std::size_t i = 0; i < restarted.views.size(); ++i) {
      const auto& kept = expected.back().views[i].paths.paths;
      others += !std::equal(kept.begin(), kept.end(), restarted.views[i].paths.paths.begin(),
                            restarted.views[i].paths.paths.end(),
                            [](const Path& a, const Path& b) { return a.excess_m == b.excess_m; });
    }
  }
  EXPECT_GT(others, 0U);  // far paths were kept
  // Epochs that trace paths come first, the others in any order.
  RetracedAntenna run(propagators.front());
  std::vector<RetracedAntenna::Epoch> epochs;
  for (std::size_t k = 0; k < kCount; ++k) epochs.push_back(run.next(drive.at(k), Drive::point_at(k)));
  std::vector<Arrival> got(kCount);
  for (const bool first : {true, false}) {
    for (std::size_t k = kCount; k-- > 0;) {
      if (epochs[k].first == first) got[k] = run.arrival(drive.environment, epochs[k]);
    }
  }
  for (std::size_t k = 0; k < kCount; ++k) expect_equal(expected[k], got[k]);
}

// An epoch alone in its interval, or far from the previous one, is traced separately.
TEST(Retracing, EpochsApartAreTracedAnew) {
  Drive drive;
  const propagation::Propagator propagator = drive.environment.make_propagator(drive.options);
  RetracedAntenna live(propagator);
  for (std::size_t k = 0; k < 5; ++k) {  // seconds apart
    expect_equal(live.arrival(drive.environment, drive.at(10 * k), Drive::point_at(k)),
                 drive.environment.arrival(drive.at(10 * k), Drive::point_at(k), propagator));
  }
  for (std::size_t k = 0; k < 5; ++k) {  // 1.25 m apart
    expect_equal(live.arrival(drive.environment, drive.at(100), Drive::point_at(5 * k)),
                 drive.environment.arrival(drive.at(100), Drive::point_at(5 * k), propagator));
  }
  live.forget();
  expect_equal(live.arrival(drive.environment, drive.at(100), Drive::point_at(21)),
               drive.environment.arrival(drive.at(100), Drive::point_at(21), propagator));
}

// Switched off, and cases to which it does not apply.
TEST(Retracing, IsAnOption) {
  Drive drive;
  for (int what = 0; what < 3; ++what) {
    propagation::PropagationOptions options = drive.options;
    if (what == 0) options.retrace_interval_s = 0;
    if (what == 1) options.retrace_distance_m = 0;
    if (what == 2) options.model = propagation::Model::Mirror;
    const propagation::Propagator propagator = drive.environment.make_propagator(options);
    RetracedAntenna live(propagator);
    for (std::size_t k = 0; k < 5; ++k) {
      expect_equal(live.arrival(drive.environment, drive.at(k), Drive::point_at(k)),
                   drive.environment.arrival(drive.at(k), Drive::point_at(k), propagator));
    }
  }
}

// Intervals are of time since 1980, so that all receivers have the same.
TEST(Retracing, IntervalsAreOfTimeAlone) {
  propagation::PropagationOptions options;
  const GpsTime t = geodesy::parse_time("2026-06-01T08:00:00Z");
  EXPECT_EQ(retrace_interval(options, t), retrace_interval(options, t + 0.999));
  EXPECT_EQ(retrace_interval(options, t) + 1, retrace_interval(options, t + 1.0));
  EXPECT_EQ(retrace_interval(options, GpsTime::from_nanoseconds(-1)), -1);
  EXPECT_EQ(retrace_interval(options, GpsTime::from_nanoseconds(-1'000'000'000)), -1);
  options.retrace_interval_s = 10;
  EXPECT_EQ(retrace_interval(options, GpsTime::from_nanoseconds(20'000'000'000)), 2);
}

}  // namespace
}  // namespace canyon::simulation
