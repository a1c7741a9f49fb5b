// Disturbances of a calling program, through Simulation and ReceiverRunner.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "canyon/base/random.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/disturbances.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation::disturbances_test {
namespace {

using canyon::test::without;
using propagation::Antenna;
using propagation::Arrival;
using propagation::Path;
using propagation::SatelliteView;
using propagation::Visibility;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class Collector final : public EpochSink {
 public:
  void write(const Epoch& epoch) override { epochs.push_back(epoch); }
  void finish() override {}
  std::vector<Epoch> epochs;
};

/// White noise from the zenith with `fraction` times the receiver's own power: k (211 K + 290 K (10^0.2 - 1))
/// of the link budget's defaults, the patch antenna's gain of 3 dBic.
propagation::Interference white(double fraction) {
  propagation::Interference wave;
  wave.spectrum.shape = propagation::Spectrum::Shape::Band;
  wave.spectrum.width_hz = 1e9;
  wave.power_dbw = 10 * std::log10(fraction * 1e9 * 1.380649e-23 * (211 + 290 * (std::pow(10, 0.2) - 1))) - 3;
  wave.polarisation = propagation::Polarisation::Right;
  return wave;
}
disturbance::DisturbanceSource noise(double fraction) {
  return canyon::test::always(
      "noise", [fraction](Arrival& arrival) { arrival.interference.push_back(white(fraction)); });
}

Scenario street(std::vector<disturbance::DisturbanceSource> disturbances, bool strength = true) {
  Scenario scenario = parse_scenario(R"(
city: {synthetic: {}}
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T08:00:00Z
trajectory:
  waypoints: [{east_m: -30, north_m: 0, up_m: 1.5}, {east_m: 30, north_m: 0, up_m: 1.5}]
  speed_mps: 6
rate_hz: 1
receivers: [{name: car, profile: ideal, elevation_mask_deg: 10, noise: {enabled: true},
             signal: {enabled: true, lock: {warm_start: true}}}]
seed: 9
)",
                                     "scenario.yaml");
  scenario.receivers.front().options.signal.enabled = strength;
  scenario.receivers.front().disturbances = std::move(disturbances);
  return scenario;
}

Simulation made(const Scenario& scenario) {
  return {scenario, city::synthetic_city({})};
}
std::vector<Epoch> simulated(const Simulation& simulation) {
  Collector collector;
  (void)simulation.run({&collector});
  return collector.epochs;
}
std::vector<Epoch> simulated(std::vector<disturbance::DisturbanceSource> disturbances, bool strength = true) {
  return simulated(made(street(std::move(disturbances), strength)));
}

/// The same drive by a host with its own clock.
class Host {
 public:
  explicit Host(std::vector<disturbance::DisturbanceSource> disturbances)
      : simulation_(made(street({}))), live_(config(std::move(disturbances)), scene(), simulation_.begin()) {}

  std::vector<Epoch> drive() {
    std::vector<Epoch> epochs;
    const geodesy::LocalFrame& frame = simulation_.environment().city().frame;
    for (std::size_t k = 0; k < simulation_.epoch_count(); ++k) {
      const double seconds = static_cast<double>(k) * simulation_.interval_s();
      const Pose pose = simulation_.antenna_pose(0, simulation_.begin() + seconds);
      RigidPose antenna;
      antenna.position_m = frame.local_from_geodetic(pose.position);
      antenna.linear_velocity =
          frame.ecef_from_local_rotation().transpose() *
          (geodesy::enu_from_ecef_rotation(pose.position).transpose() * pose.velocity_enu_mps);
      epochs.push_back(live_.observe(seconds, antenna).epoch);
    }
    return epochs;
  }

 private:
  static RunnerConfig config(std::vector<disturbance::DisturbanceSource> disturbances) {
    return RunnerConfig(street(std::move(disturbances)));
  }
  static std::shared_ptr<CityScene> scene() { return std::make_shared<CityScene>(city::synthetic_city({})); }

  Simulation simulation_;
  ReceiverRunner live_;
};

const receiver::SatelliteObservation* find(const Epoch& epoch, gnss::SatelliteId id) {
  for (const receiver::SatelliteObservation& each : epoch.observed.satellites) {
    if (each.id == id) return &each;
  }
  return nullptr;
}

/// A satellite that is tracked at every epoch.
gnss::SatelliteId tracked_satellite(const std::vector<Epoch>& epochs) {
  for (const receiver::SatelliteObservation& each : epochs.front().observed.satellites) {
    const bool always_there = std::all_of(epochs.begin(), epochs.end(), [&](const Epoch& epoch) {
      const receiver::SatelliteObservation* seen = find(epoch, each.id);
      return seen != nullptr && seen->measurement;
    });
    if (always_there) return each.id;
  }
  ADD_FAILURE() << "no satellite is tracked all the time";
  return {};
}

TEST(Disturbances, TakeASatelliteOutAndLeaveTheOthersAsTheyWere) {
  const std::vector<Epoch> plain = simulated({});
  const gnss::SatelliteId gone = tracked_satellite(plain);
  const std::vector<Epoch> offline = simulated({without(gone)});
  const std::vector<Epoch> live = Host({without(gone)}).drive();
  ASSERT_THAT(offline, SizeIs(plain.size()));
  ASSERT_THAT(live, SizeIs(plain.size()));
  for (std::size_t k = 0; k < plain.size(); ++k) {
    EXPECT_EQ(find(offline[k], gone), nullptr);
    EXPECT_EQ(find(live[k], gone), nullptr);
    EXPECT_THAT(offline[k].observed.satellites, SizeIs(plain[k].observed.satellites.size() - 1));
    EXPECT_THAT(live[k].observed.satellites, SizeIs(plain[k].observed.satellites.size() - 1));
    for (const receiver::SatelliteObservation& other : offline[k].observed.satellites) {
      // Each satellite has its own random streams.
      const receiver::SatelliteObservation* before = find(plain[k], other.id);
      ASSERT_NE(before, nullptr);
      EXPECT_EQ(other.cn0_dbhz, before->cn0_dbhz);
      EXPECT_EQ(other.excess_m, before->excess_m);
      EXPECT_EQ(other.noise_m, before->noise_m);
    }
  }
}

TEST(Disturbances, RaiseTheNoiseByTheirPower) {
  // Nine times the receiver's own noise added to it: 10 dB. Twice nine times: 10 lg 19. Powers add.
  const std::vector<Epoch> plain = simulated({});
  const std::vector<Epoch> once = simulated({noise(9)});
  const std::vector<Epoch> twice = simulated({noise(9), noise(9)});
  const std::vector<Epoch> live = Host({noise(9)}).drive();
  std::size_t compared = 0, lost = 0;
  for (std::size_t k = 0; k < plain.size(); ++k) {
    for (const receiver::SatelliteObservation& clear : plain[k].observed.satellites) {
      // A loop that lost its lock may converge to another point; at the first epoch all are equal.
      if (k > 0 || !clear.cn0_dbhz) continue;
      ++compared;
      const receiver::SatelliteObservation& jammed = *find(once[k], clear.id);
      // The noise ends 500 MHz away, where a thousandth of a signal's power is left.
      EXPECT_NEAR(*jammed.cn0_dbhz, *clear.cn0_dbhz - 10, 0.005);
      EXPECT_NEAR(*find(twice[k], clear.id)->cn0_dbhz, *clear.cn0_dbhz - 10 * std::log10(19), 0.005);
      EXPECT_NEAR(*find(live[k], clear.id)->cn0_dbhz, *jammed.cn0_dbhz, 1e-5);
    }
    lost += once[k].observed.visible < plain[k].observed.visible;
  }
  EXPECT_GT(compared, 5U);
  EXPECT_GT(lost, 0U) << "weak signals are not tracked any more";
}

TEST(Disturbances, SayWhatHappensToTheReceiver) {
  class Mistaken final : public disturbance::Disturbance {
   public:
    void happen(const Antenna& /*antenna*/, disturbance::ReceiverEvents& events) override {
      events.clock_bias_s += 1e-4;
      events.weeks_off -= 1024;
    }
  };
  const disturbance::DisturbanceSource mistaken{
      "mistaken", [](std::uint64_t, const std::string&) { return std::make_unique<Mistaken>(); }};
  const std::vector<Epoch> plain = simulated({}, false);
  const std::vector<Epoch> twice = simulated({mistaken, mistaken}, false);
  ASSERT_EQ(twice.size(), plain.size());
  for (std::size_t k = 0; k < plain.size(); ++k) {
    EXPECT_NEAR(twice[k].observed.clock_bias_s, plain[k].observed.clock_bias_s + 2e-4, 1e-15);
    EXPECT_EQ(twice[k].observed.events.weeks_off, -2048);
    EXPECT_EQ(twice[k].observed.reported_time() - twice[k].observed.time, -2048.0 * 604800);
    EXPECT_EQ(twice[k].observed.satellites.size(), plain[k].observed.satellites.size())
        << "what arrives is the same";
  }
}

TEST(Disturbances, SeeTheirPathsPutInOrder) {
  // Direct path removed, a strong copy 100 m later instead: only the late signal is left.
  const auto late = canyon::test::always("late copy", [](Arrival& arrival) {
    for (SatelliteView& view : arrival.views) {
      std::vector<Path>& paths = view.paths.paths;
      if (paths.empty() || paths.front().kind != propagation::PathKind::Direct) {
        paths.clear();
        continue;
      }
      Path copy = paths.front();
      copy.kind = propagation::PathKind::Reflected;
      copy.excess_m = 100;
      paths = {copy};
    }
  });
  const std::vector<Epoch> plain = simulated({}, false);
  const std::vector<Epoch> shifted = simulated({late}, false);
  std::size_t moved = 0;
  for (std::size_t k = 0; k < plain.size(); ++k) {
    for (const receiver::SatelliteObservation& before : plain[k].observed.satellites) {
      const receiver::SatelliteObservation& after = *find(shifted[k], before.id);
      const bool direct =
          before.visibility == Visibility::LOS || before.visibility == Visibility::LOSMultipath;
      EXPECT_EQ(after.visibility, direct ? Visibility::NLOS : Visibility::Blocked);
      if (!direct) continue;
      ++moved;
      EXPECT_EQ(after.excess_m, 100);
    }
  }
  EXPECT_GT(moved, 20U);
}

TEST(Disturbances, HaveMemoryAndSeedsOfTheirOwn) {
  // Noise that changes from epoch to epoch, by seed and receiver.
  class Wandering final : public disturbance::Disturbance {
   public:
    explicit Wandering(RandomStream stream) : stream_(stream) {}
    void apply(const Antenna& /*antenna*/, Arrival& arrival) override {
      fraction_ += stream_.uniform();
      arrival.interference.push_back(white(fraction_));
    }

   private:
    RandomStream stream_;
    double fraction_ = 0;
  };
  const disturbance::DisturbanceSource wandering{
      "wandering noise", [](std::uint64_t seed, const std::string& receiver) {
        return std::make_unique<Wandering>(RandomStream(seed, receiver + "/wandering noise"));
      }};
  const auto levels = [](const std::vector<Epoch>& epochs) {
    std::vector<std::optional<double>> result;
    for (const Epoch& epoch : epochs) {
      for (const auto& satellite : epoch.observed.satellites) result.push_back(satellite.cn0_dbhz);
    }
    return result;
  };
  // Every run restarts it.
  const Simulation simulation = made(street({wandering}));
  const auto first = levels(simulated(simulation));
  EXPECT_EQ(levels(simulated(simulation)), first);
  // The jammer weakens the first signal by an amount that differs by seed.
  const auto taken_db = [&](std::uint64_t seed) {
    Scenario jammed = street({wandering}), plain = street({});
    jammed.seed = plain.seed = seed;
    const auto noisy = levels(simulated(made(jammed))), clear = levels(simulated(made(plain)));
    std::size_t i = 0;
    while (!clear.at(i)) ++i;
    return *clear[i] - *noisy.at(i);
  };
  EXPECT_GT(taken_db(9), 0);
  EXPECT_GT(taken_db(10), 0);
  EXPECT_GT(std::abs(taken_db(9) - taken_db(10)), 1e-3);
  // The same for a host whose world is reset.
  Host host({wandering});
  const auto live = levels(host.drive());
  EXPECT_EQ(levels(host.drive()), live);
}

TEST(Disturbances, ThatAreNotMadeAreNamed) {
  const disturbance::DisturbanceSource broken{"broken", [](std::uint64_t, const std::string&) {
                                                return std::unique_ptr<disturbance::Disturbance>();
                                              }};
  EXPECT_THAT(test::error_of([&] { (void)simulated({broken}); }).what(), HasSubstr("'broken'"));
}

}  // namespace
}  // namespace canyon::simulation::disturbances_test
