#include "canyon/validation/recorded_scene.hpp"

#include <string>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/rinex/observation_reader.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::validation {

void settle_truth(const simulation::Scenario& scenario, ListedRecording& files, std::string_view option) {
  const simulation::TrajectoryConfig& trajectory = scenario.trajectory;
  if (files.truth) return;
  if (!trajectory.file) {
    throw InputError(std::string(option) + " is missing, and the scenario's trajectory is not a file",
                     "give the file of true positions");
  }
  files.truth = trajectory.file;
  if (files.truth_format.empty()) files.truth_format = trajectory.format;
}

RecordedScene read_recorded_scene(simulation::Scenario& scenario, const ListedRecording& files,
                                  bool atmosphere) {
  rinex::ObservationOptions wanted;
  wanted.systems = scenario.sky.systems;
  wanted.all_signals = true;
  rinex::RinexObservations recorded = rinex::read_observations(*files.obs, wanted);
  RecordedScene scene;
  city::City city = simulation::load_city(simulation::city_config(scenario), scene.warnings, scenario.seed);
  // The sky is of the recording's time: the scenario's own trajectory is not simulated.
  scene.sky = simulation::build_sky(scenario.sky, recorded.epochs.front().receiver_time,
                                    recorded.epochs.back().receiver_time, city.frame.origin());
  scene.environment = std::make_unique<simulation::Environment>(simulation::make_environment(
      std::make_shared<simulation::CityScene>(std::move(city)), scene.sky, scenario.sky, scenario.seed));
  // The systems that were recorded are those of the radio.
  for (simulation::ReceiverConfig& receiver : scenario.receivers) {
    simulation::decide_options(receiver.options, scene.environment->errors().get(), nullptr);
  }
  RecordingOptions options;
  options.ionosphere = options.troposphere = atmosphere;
  options.nmea = files.nmea;
  scene.recording = join_recording(scenario, *scene.environment, *files.obs, std::move(recorded),
                                   *files.truth, files.truth_format, options);
  return scene;
}

std::unique_ptr<simulation::Environment> RedrawnCity::draw(const simulation::BuiltSky& sky,
                                                           simulation::Scenario scenario) {
  std::vector<std::string> ignored;  // the recording's scene has said the same
  if (!source_) source_ = simulation::load_city_source(simulation::city_config(scenario), ignored);
  scenario.city.georeference = {};
  return std::make_unique<simulation::Environment>(simulation::make_environment(
      std::make_shared<simulation::CityScene>(simulation::draw_city(*source_, scenario, ignored)), sky,
      scenario.sky, scenario.seed));
}

}  // namespace canyon::validation
