#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/city/facades.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::test {

/// Four minutes through a synthetic city whose true position differs from its map, as a recording: RINEX
/// observations and true positions as files.
class SimulatedRecording {
 public:
  using Change = std::function<void(simulation::ReceiverConfig&)>;
  using Facades = std::map<std::string, double>;

  /// @param moved true position of the city relative to its map; @param change of the recording receiver
  /// @param heights of its houses; @param facades fractions of their facades, only in the truth
  explicit SimulatedRecording(const validation::Registration& moved = {}, const Change& change = {},
                              const std::string& heights = "min_height_m: 12, max_height_m: 90",
                              const Facades& facades = {}) {
    simulation::Scenario scenario = simulation::parse_scenario(R"(
city: {synthetic: {blocks_east: 6, blocks_north: 6, seed: 7, )" + heights +
                                                                   R"(},
       origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}}
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T08:00:00Z
rate_hz: 1
trajectory:
  waypoints: [{east_m: -152, north_m: -152}, {east_m: -152, north_m: 76}, {east_m: 76, north_m: 76},
              {east_m: 76, north_m: -152}, {east_m: 0, north_m: -152}, {east_m: 0, north_m: 152},
              {east_m: 152, north_m: 152}, {east_m: 152, north_m: 0}]
  speed_mps: 6
  height_above_terrain_m: 1.5
receivers: [{name: car, profile: ideal, elevation_mask_deg: 10}]
shadowing: {skyline: {share: 0}}
)",
                                                               folder_ / "scenario.yaml");
    if (change) change(scenario.receivers.front());
    scenario.receivers.front().options.independent_noise = false;
    const city::City map = city::synthetic_city(*scenario.city.as<city::SyntheticCityOptions>());
    city::City truth = dressed(map, facades, 1);
    const Eigen::Rotation2Dd rotation(moved.heading_rad);
    for (Eigen::Vector3d& v : truth.mesh.vertices) {
      v.head<2>() = (rotation * (v.head<2>() - moved.pivot) + moved.pivot +
                     Eigen::Vector2d(moved.east_m, moved.north_m))
                        .eval();
    }
    const simulation::Simulation simulation(scenario, std::move(truth));
    const auto rinex =
        encoding::open_file("rinex_observation", obs, 0, encoding::describe_receiver(simulation, 0));
    const auto nmea_file = encoding::open_file("nmea", nmea, 0, encoding::describe_receiver(simulation, 0));
    TruthFile truth_file(truth_csv);
    simulation.run({rinex.get(), nmea_file.get(), &truth_file, &epochs_});
    scenario_ = scenario;
    sky_ =
        simulation::build_sky(scenario.sky, simulation.begin(), simulation.begin() + 300, map.frame.origin())
            .sky;
    environment_ = std::make_unique<simulation::Environment>(map, sky_);
  }

  [[nodiscard]] validation::Recording read() const {
    validation::RecordingOptions options;
    options.ionosphere = options.troposphere = false;
    options.nmea = nmea;
    return validation::read_recording(scenario_, *environment_, obs, truth_csv, "csv", options);
  }
  [[nodiscard]] const simulation::Scenario& scenario() const { return scenario_; }
  /// The environment with the map's city, if facades are sampled.
  [[nodiscard]] const simulation::Environment& environment() const { return *environment_; }
  /// The same with sampled facades.
  [[nodiscard]] std::unique_ptr<simulation::Environment> environment_with(const Facades& facades,
                                                                          std::uint64_t seed) const {
    return std::make_unique<simulation::Environment>(dressed(environment_->city(), facades, seed), sky_);
  }
  [[nodiscard]] const std::vector<simulation::Epoch>& epochs() const { return epochs_.all; }

 private:
  TemporaryFolder folder_;

 public:
  const std::filesystem::path obs = folder_ / "car.obs", truth_csv = folder_ / "truth.csv",
                              nmea = folder_ / "car.nmea";

 private:
  static city::City dressed(city::City city, const Facades& fractions, std::uint64_t seed) {
    if (fractions.empty()) return city;
    city::FacadeOptions options;
    options.fractions = fractions;
    (void)city::assign_facades(city, options, false, seed);
    return city;
  }

  struct TruthFile final : simulation::EpochSink {
    explicit TruthFile(const std::filesystem::path& path) : out(path) {
      out << "time,latitude_deg,longitude_deg,height_m\n";
    }
    void write(const simulation::Epoch& e) override {
      out << fmt::format("{} GPST,{:.11f},{:.11f},{:.5f}\n",
                         geodesy::format_gpst(e.observed.time, 9).substr(0, 29),
                         geodesy::degrees(e.truth.position.latitude_rad),
                         geodesy::degrees(e.truth.position.longitude_rad), e.truth.position.height_m);
    }
    void finish() override { out.close(); }
    std::ofstream out;
  };
  struct EpochRecorder final : simulation::EpochSink {
    void write(const simulation::Epoch& e) override { all.push_back(e); }
    void finish() override {}
    std::vector<simulation::Epoch> all;
  };

  EpochRecorder epochs_;
  simulation::Scenario scenario_;
  std::shared_ptr<const orbit::Sky> sky_;
  std::unique_ptr<simulation::Environment> environment_;
};

/// A receiver with signal strength, without noise: the basis of later tests of C/N0.
inline void with_strength(simulation::ReceiverConfig& receiver) {
  receiver.options.signal.enabled = true;
  receiver.options.signal.loop_noise = false;
  receiver.options.signal.lock.warm_start = true;
  receiver.propagation.diffraction = true;
}

}  // namespace canyon::test
