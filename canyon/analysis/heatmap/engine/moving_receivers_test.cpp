#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numeric>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/simulation/receiver_surroundings.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/downtown.hpp"

namespace canyon::heatmap::moving_receivers_test {
namespace {

using Eigen::Vector3d;
using simulation::Motion;
using simulation::ReceiverConfig;
using test::CircularSky;
using test::downtown;

constexpr geodesy::GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);
constexpr double kPace_mps = 8, kHeight_m = 2, kEnd_m = 288;
/// Streets of downtown, east-west ones by their north coordinate.
constexpr double kStreets_m[]{-152, -76, 0, 76, 152};

ReceiverConfig module() {
  ReceiverConfig receiver =
      simulation::parse_profile(std::string(simulation::built_in_profile("ublox-m10").text), "").receiver;
  receiver.options.signal.shadowing.enabled = true;
  receiver.options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Auto;
  receiver.options.signal.shadowing.skyline.fraction = 0.4;
  return receiver;
}

/// A map's median errors at points of a street.
std::vector<double> mapped(const ReceiverConfig& receiver, double north_m, Motion motion,
                           const std::vector<double>& east_m) {
  Request request;
  request.grid = Grid::covering(-kEnd_m, north_m - 7, kEnd_m, north_m + 7, 2);
  request.grid.tile_size = 512;
  request.times = {kTime};
  request.altitudes_m = {kHeight_m};
  request.samples.samples = 16;
  request.motion = {motion, kPace_mps};
  request.layers = {Layer::HorizontalErrorP50};
  const Heatmap map(downtown(), receiver, request, "");
  EXPECT_EQ(map.request().motion.motion, motion == Motion::Auto ? Motion::Driving : motion);
  const TileValues values = map.compute(0);
  std::vector<double> errors;
  for (const double east : east_m) {
    const auto column = static_cast<std::size_t>((east + kEnd_m) / 2);
    errors.push_back(double{values.values[3 * request.grid.columns + column]});
  }
  return errors;
}

/// Median errors of receivers at the points of a street: eastwards and westwards, several seeds.
std::vector<double> driven(const ReceiverConfig& receiver, double north_m,
                           const std::vector<double>& east_m) {
  receiver::ReceiverOptions options =
      simulation::with_surroundings(receiver, downtown().scene(), downtown().city(), {});
  simulation::decide_options(options, downtown().errors().get(), &downtown().sky());
  const propagation::Propagator propagator = downtown().make_propagator(receiver.propagation);
  const geodesy::LocalFrame& frame = downtown().city().frame;
  std::vector<std::vector<double>> errors(east_m.size());
  for (const int route : {1, -1}) {
    std::vector<receiver::Receiver> receivers;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) receivers.emplace_back(options, seed);
    for (std::size_t k = 0; k < east_m.size(); ++k) {
      const std::size_t index = route > 0 ? k : east_m.size() - 1 - k;
      const geodesy::GpsTime time = kTime + static_cast<double>(k) * 1.0;
      const Vector3d at(east_m[index], north_m, kHeight_m);
      const propagation::Antenna antenna{
          time, frame.ecef_from_local(at),
          frame.ecef_from_local_rotation() * Vector3d(route * kPace_mps, 0, 0)};
      const propagation::Arrival arrival = downtown().arrival(time, at, propagator);
      for (receiver::Receiver& one : receivers) {
        propagation::Arrival own = arrival;
        const positioning::Fix fix =
            one.observe({antenna, own, downtown().sky(), downtown().klobuchar()}).fix;
        if (!fix.solved() || k < 15) continue;  // the filter's first 15 s
        errors[index].push_back(
            (frame.ecef_from_local_rotation().transpose() * (fix.position_ecef - antenna.position_ecef))
                .head<2>()
                .norm());
      }
    }
  }
  std::vector<double> medians;
  for (std::vector<double>& each : errors) medians.push_back(median(each).value_or(std::nan("")));
  return medians;
}

double rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto ranks = [](const std::vector<double>& values) {
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](auto i, auto j) { return values[i] < values[j]; });
    std::vector<double> rank(values.size());
    for (std::size_t i = 0; i < order.size(); ++i) rank[order[i]] = static_cast<double>(i);
    return rank;
  };
  const std::vector<double> x = ranks(a), y = ranks(b);
  const double n = static_cast<double>(x.size());
  double squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) squares += (x[i] - y[i]) * (x[i] - y[i]);
  return 1 - 6 * squares / (n * (n * n - 1));
}

// docs/heatmap.md has the numbers that this prints.
TEST(MovingReceivers, HaveTheErrorsOfReceiversThatDriveThrough) {
  const ReceiverConfig receiver = module();
  std::vector<double> east_m;
  for (double east = -kEnd_m + 9; east < kEnd_m; east += kPace_mps) east_m.push_back(east);
  std::vector<double> drives, is_stationary, driving;
  for (const double north_m : kStreets_m) {
    const std::vector<double> errors = driven(receiver, north_m, east_m);
    const std::vector<double> still = mapped(receiver, north_m, Motion::Stationary, east_m);
    const std::vector<double> moving = mapped(receiver, north_m, Motion::Auto, east_m);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      if (!std::isfinite(errors[i] + still[i] + moving[i])) continue;
      drives.push_back(errors[i]);
      is_stationary.push_back(still[i]);
      driving.push_back(moving[i]);
    }
  }
  const double expected_m = *median(drives);
  const auto ratio = [&](const std::vector<double>& map) { return *median(map) / expected_m; };
  std::cout << drives.size() << " cells, receivers that drive through: median " << expected_m << " m\n"
            << "standing: " << ratio(is_stationary) << " times, rank correlation "
            << rank_correlation(is_stationary, drives) << "\ndriving: " << ratio(driving)
            << " times, rank correlation " << rank_correlation(driving, drives) << "\n";
  EXPECT_GT(ratio(driving), 0.7);
  EXPECT_LT(ratio(driving), 1.4);
  EXPECT_GT(ratio(is_stationary), 1.5 * ratio(driving));
  EXPECT_GT(rank_correlation(driving, drives), rank_correlation(is_stationary, drives) + 0.1);
}

TEST(MovingReceivers, AreThoseWithAFilterWhosePlaceIsNotFixed) {
  Request request;
  request.grid = Grid::covering(-8, -8, 8, 8, 2);
  request.times = {kTime};
  request.motion = {};
  const auto chosen = [&](const ReceiverConfig& receiver) {
    return Heatmap(downtown(), receiver, request, "").request().motion.motion;
  };
  EXPECT_EQ(chosen(module()), Motion::Flying);
  request.altitudes_m = {1.5};
  EXPECT_EQ(chosen(module()), Motion::Driving);
  ReceiverConfig base = module();
  base.fixed.emplace();
  EXPECT_EQ(chosen(base), Motion::Stationary);
  ReceiverConfig unfiltered = module();
  unfiltered.options.filter.enabled = false;
  EXPECT_EQ(chosen(unfiltered), Motion::Stationary);
  request.motion.motion = Motion::Driving;
  EXPECT_THROW(chosen(unfiltered), InputError);
  request.receivers.model = ReceiverModel::Run;
  EXPECT_THROW(chosen(module()), InputError);
}

}  // namespace
}  // namespace canyon::heatmap::moving_receivers_test
