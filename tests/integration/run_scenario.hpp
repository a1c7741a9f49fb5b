#pragma once

#include <string>
#include <vector>

#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/loaded_city.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::test {

/// Stores every epoch, without its paths, which are valid only during the call.
class Recorder final : public simulation::EpochSink {
 public:
  void write(const simulation::Epoch& epoch) override {
    epochs.push_back(epoch);
    epochs.back().arrival = nullptr;
  }
  void finish() override { ++finished; }
  std::vector<simulation::Epoch> epochs;
  int finished = 0;
};

inline simulation::Simulation prepare(const std::string& yaml, const std::filesystem::path& folder) {
  simulation::Scenario scenario = simulation::parse_scenario(yaml, folder / "scenario.yaml");
  city::City city = test::loaded_city(scenario.city);
  return simulation::Simulation(std::move(scenario), std::move(city));
}

/// Runs a scenario, writes its files to `out` and returns all epochs.
inline std::vector<simulation::Epoch> run_and_write(const simulation::Simulation& simulation,
                                                    const std::filesystem::path& out, int threads = 0) {
  Recorder recorder;
  const auto files = encoding::make_file_sinks(simulation, out);
  std::vector<simulation::EpochSink*> sinks{&recorder};
  for (const auto& file : files) sinks.push_back(file.get());
  simulation::RunOptions options;
  options.threads = threads;
  simulation.run(sinks, options);
  return std::move(recorder.epochs);
}

}  // namespace canyon::test
