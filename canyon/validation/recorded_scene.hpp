#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/validation/comparison.hpp"
#include "canyon/validation/recording_list.hpp"

// Part of canyon::io.

namespace canyon::validation {

/// A recording in its scenario's city, under the sky of its time.
struct RecordedScene {
  simulation::BuiltSky sky;
  std::unique_ptr<simulation::Environment> environment;
  Recording recording;
  std::vector<std::string> warnings;  ///< of the city
};

/// Fills in the true positions' file and format where `files` leaves them to the scenario. Throws InputError,
/// naming the `option` that gives them, where the scenario's trajectory is not a file.
void settle_truth(const simulation::Scenario& scenario, ListedRecording& files, std::string_view option);

/// Loads the scenario's city and reads the observations and, after settle_truth(), the true positions.
/// simulation::decide_options() settles what the receivers leave to the sky's errors. Throws InputError as
/// read_recording(), simulation::load_city() and simulation::build_sky() do.
[[nodiscard]] RecordedScene read_recorded_scene(simulation::Scenario& scenario, const ListedRecording& files,
                                                bool atmosphere);

/// A scenario's city, drawn anew under a recording's sky. The map's files are read at the first call.
class RedrawnCity {
 public:
  /// The city as `scenario` draws it by its seed, where its map has it: its georeference draws no place.
  /// @param scenario of the same map in every call
  [[nodiscard]] std::unique_ptr<simulation::Environment> draw(const simulation::BuiltSky& sky,
                                                              simulation::Scenario scenario);

 private:
  std::optional<city::City> source_;
};

}  // namespace canyon::validation
