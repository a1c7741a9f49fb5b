// Samples of adjacent antennas: phase differences give the directions of arrival of signals.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/samples/generator.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/wall_reflection.hpp"

namespace canyon::samples::antennas_test {
namespace {

using Complex = std::complex<double>;
constexpr double kTwoPi = 2 * geodesy::kPi;
constexpr double kWavelength_m = geodesy::kSpeedOfLight / gnss::kL1_hz;
constexpr double kApart_m = 0.1, kWall_m = 30;

/// Keeps the direct paths of one satellite or of all; with a wall, its reflections by a wall 30 m west of the
/// origin.
class NearbySet final : public disturbance::Disturbance {
 public:
  NearbySet(int only, int reflected) : only_(only), reflected_(reflected) {}
  void apply(const propagation::Antenna& /*antenna*/, propagation::Arrival& arrival) override {
    std::erase_if(arrival.views,
                  [&](const auto& view) { return only_ != 0 && view.line.id.number != only_; });
    for (propagation::SatelliteView& view : arrival.views) {
      if (view.line.id.number != reflected_) continue;
      view.paths.paths.front() = test::wall_reflection(arrival, view, kWall_m);
    }
  }

 private:
  int only_, reflected_;
};

/// Half a second of three antennas: at the origin, 0.1 m ahead of it and 0.1 m to the left.
simulation::Simulation simulate(int only, int reflected) {
  std::string text =
      "city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
      "sky: {nominal: true, systems: [GPS]}\nstart: 2026-06-01T08:00:00Z\nrate_hz: 4\nduration_s: 0.5\n"
      "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}], hold_s: 2}\nreceivers:\n";
  for (const char* own :
       {"name: a", "name: b, lever_arm: {forward_m: 0.1}", "name: c, lever_arm: {left_m: 0.1}"}) {
    text +=
        "  - {independent_noise: false, clock: {bias_s: 0, drift: 1e-7, drift_walk: 0}, signal: {enabled: "
        "true}, " +
        std::string(own) + "}\n";
  }
  simulation::Scenario scenario = simulation::parse_scenario(text, "test.yaml");
  for (simulation::ReceiverConfig& receiver : scenario.receivers) {
    receiver.disturbances.push_back({"around", [only, reflected](std::uint64_t, const std::string&) {
                                       return std::make_unique<NearbySet>(only, reflected);
                                     }});
  }
  city::City city;
  city.frame = geodesy::LocalFrame(*scenario.city.origin);
  return {scenario, std::move(city)};
}

class Recorder final : public simulation::EpochSink {
 public:
  Recorder(const simulation::Simulation& simulation, std::size_t receiver, bool noise) : receiver_(receiver) {
    FrontEnd front_end;
    front_end.noise = noise;
    front_end.rate_hz = 2.5e6;
    generator_.emplace(simulation.scenario().receivers[receiver].options, simulation.scenario().seed,
                       simulation.environment().klobuchar(), front_end);
  }
  void write(const simulation::Epoch& epoch) override {
    if (epoch.receiver != receiver_) return;
    last = epoch;
    generator_->next(epoch, [this](const SampleBlock& block, std::size_t count) {
      for (std::size_t n = 0; n < count; ++n) values.emplace_back(block.re[n], block.im[n]);
    });
  }
  void finish() override {}
  simulation::Epoch last;
  std::vector<std::complex<float>> values;

 private:
  std::size_t receiver_;
  std::optional<Generator> generator_;
};

struct Direction {
  int satellite = 0;
  double elevation_deg = 0;
  std::array<double, 2> found{}, expected{}, sigma{};  ///< along both baselines [1]
};

/// Directions of all satellites above 5 degrees, or of one. @param reflected the satellite with a reflection
std::vector<Direction> directions(int reflected) {
  const simulation::Simulation simulation = simulate(0, reflected);
  Recorder a(simulation, 0, true), b(simulation, 1, true), c(simulation, 2, true);
  (void)simulation.run({&a, &b, &c});
  std::array<Eigen::Vector3d, 3> points;
  for (std::size_t i = 0; i < 3; ++i) {
    points[i] = simulation.environment().city().frame.local_from_geodetic(
        simulation.antenna_pose(i, simulation.begin()).position);
  }
  std::vector<Direction> all;
  for (int number = 1; number <= 32; ++number) {
    if (reflected != 0 && number != reflected) continue;
    const auto line = orbit::line_of_sight(simulation.environment().sky(),
                                           {gnss::System::GPS, static_cast<std::uint8_t>(number)},
                                           simulation.begin() + 0.25, a.last.truth_ecef);
    if (!line || line->elevation_rad < geodesy::radians(5.0)) continue;
    // The first antenna's samples with only this satellite are the replica.
    const simulation::Simulation alone = simulate(number, reflected);
    Recorder replica(alone, 0, false);
    (void)alone.run({&replica});
    std::array<Complex, 3> prompt;
    double power = 0;
    const std::array<const Recorder*, 3> recorded{&a, &b, &c};
    for (std::size_t n = 0; n < replica.values.size(); ++n) {
      const Complex wiped = std::conj(Complex(replica.values[n]));
      power += std::norm(wiped);
      for (std::size_t i = 0; i < 3; ++i) prompt[i] += Complex(recorded[i]->values.at(n)) * wiped;
    }
    Eigen::Vector3d arrival = geodesy::enu_from_ecef_rotation(a.last.truth.position) * line->direction_ecef;
    if (reflected != 0) arrival.x() = -arrival.x();
    Direction& direction = all.emplace_back();
    direction.satellite = number;
    direction.elevation_deg = geodesy::degrees(line->elevation_rad);
    for (std::size_t i = 0; i < 2; ++i) {
      const double metres_per_cycle = kWavelength_m / kApart_m;
      const Eigen::Vector3d baseline = points[i + 1] - points[0];
      EXPECT_NEAR(baseline.norm(), kApart_m, 1e-6);
      direction.expected[i] = baseline.dot(arrival) / kApart_m;
      // Noise of variance 2: of the phase of a sum of power P 1 / P, and of two 2 / P.
      direction.sigma[i] = std::sqrt(2 / power) / kTwoPi * metres_per_cycle;
      const double cycles = std::arg(prompt[i + 1] * std::conj(prompt[0])) / kTwoPi;
      // 0.1 m are half a wavelength and a little more: beyond 0.95 the phase is ambiguous.
      direction.found[i] =
          direction.expected[i] +
          std::remainder(cycles - direction.expected[i] / metres_per_cycle, 1) * metres_per_cycle;
    }
  }
  return all;
}

TEST(Antennas, PhaseDifferencesGiveEachSatellitesDirection) {
  const std::vector<Direction> all = directions(0);
  ASSERT_GE(all.size(), 8U);
  double square = 0;
  for (const Direction& each : all) {
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LT(each.sigma[i], 0.02) << each.satellite;
      // Codes of the others add a little to the noise.
      EXPECT_NEAR(each.found[i], each.expected[i], 4 * each.sigma[i] + 0.002) << each.satellite;
      square += std::pow((each.found[i] - each.expected[i]) / each.sigma[i], 2);
    }
  }
  // The errors are neither smaller nor larger than the noise.
  const double rms = std::sqrt(square / (2 * static_cast<double>(all.size())));
  EXPECT_GT(rms, 0.6);
  EXPECT_LT(rms, 1.6);
}

TEST(Antennas, AReflectionThatStandsAloneHasItsOwnDirection) {
  const std::vector<Direction> all = directions(9);
  ASSERT_EQ(all.size(), 1U);
  const Direction& each = all.front();
  EXPECT_LT(each.expected[0], -0.3);  // from the west, the side of the wall
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT(each.sigma[i], 0.02);
    EXPECT_NEAR(each.found[i], each.expected[i], 4 * each.sigma[i] + 0.002) << i;
  }
}

}  // namespace
}  // namespace canyon::samples::antennas_test
