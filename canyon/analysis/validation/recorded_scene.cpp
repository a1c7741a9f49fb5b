#include "canyon/analysis/validation/recorded_scene.hpp"

#include <fmt/format.h>

#include <set>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::validation {

void resolve_truth(const simulation::Scenario& scenario, ListedRecording& files, std::string_view option) {
  const simulation::TrajectoryConfig& trajectory = scenario.trajectory;
  if (files.truth || (!trajectory.file && trajectory.waypoints.size() == 1)) return;
  if (!trajectory.file) {
    throw InputError(
        std::string(option) + " is missing, and the scenario's trajectory is neither a file nor a position",
        "give the file of true positions, or LATITUDE,LONGITUDE,HEIGHT of a fixed antenna");
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
  city::City city = simulation::load_city(simulation::city_config(scenario), scenario.seed);
  // The sky is for the recording's time: the scenario's own trajectory is not simulated.
  scene.sky = simulation::build_sky(scenario.sky, recorded.epochs.front().receiver_time,
                                    recorded.epochs.back().receiver_time, city.frame.origin());
  scene.environment = std::make_unique<simulation::Environment>(simulation::make_environment(
      std::make_shared<simulation::CityScene>(std::move(city)), scene.sky, scenario.sky, scenario.seed));
  // The recorded systems are those of the radio.
  for (simulation::ReceiverConfig& receiver : scenario.receivers)
    simulation::decide_options(receiver.options, scene.environment->errors().get(), nullptr);
  RecordingOptions options;
  options.ionosphere = options.troposphere = atmosphere;
  options.nmea = files.nmea;
  scene.recording = join_recording(scenario, *scene.environment, *files.obs, std::move(recorded),
                                   files.truth.value_or(""), files.truth_format, options);
  return scene;
}

std::unique_ptr<simulation::Environment> ResampledCity::draw(const simulation::BuiltSky& sky,
                                                             simulation::Scenario scenario) {
  if (!source_) source_ = simulation::load_city_source(simulation::city_config(scenario));
  scenario.city.georeference = {};
  return std::make_unique<simulation::Environment>(simulation::make_environment(
      std::make_shared<simulation::CityScene>(simulation::draw_city(*source_, scenario)), sky, scenario.sky,
      scenario.seed));
}

namespace {

constexpr std::size_t kMaxRecordings = 50;
constexpr std::size_t kMaxBytes = std::size_t{1} << 20;
constexpr std::string_view kOneNeeded = "each recording needs a name, a scenario and observations";

options::Document document_of(const std::filesystem::path& path) {
  options::Document document;
  document.file = path;
  document.kind = "list of recordings";
  document.page = "docs/methods.md";
  document.known = options::describe<RecordingList>().paths();
  return document;
}

}  // namespace

void visit(options::Visitor& v, ListedRecording& r) {
  for (const std::string_view key : {"name", "scenario", "obs"}) v.require(key, kOneNeeded);
  v.text({"name", "", "name in tables, and of the folder of its view"}, r.name);
  if (v.reads()) options::check_folder_name(v, "name", r.name);
  v.text({"class", "", "of its receiver: recordings of one class are pooled", "none"}, r.receiver_class);
  v.file({"scenario", "", "city, sky and first receiver"}, r.scenario);
  v.file({"obs", "", "recorded observations: RINEX 2, 3 or 4, or a log of Android's GnssLogger"}, r.obs);
  v.file({"truth", "", "true positions", "the scenario's trajectory file"}, r.truth);
  const std::vector<std::string>& formats = simulation::trajectory_formats();
  v.word({"truth_format", "", "of the true positions", "detected from the file's content"}, r.truth_format,
         std::vector<std::string_view>(formats.begin(), formats.end()));
  // Paths are relative to the list's folder, as all are.
  if (v.reads() && v.has("profile")) {
    v.text({"profile", "", "its word"}, r.profile);
    if (simulation::is_profile_path(r.profile)) {
      std::optional<std::filesystem::path> file;
      v.file({"profile", "", "its file"}, file);
      r.profile = std::filesystem::absolute(*file).string();
    } else {
      try {
        (void)simulation::built_in_profile(r.profile);
      } catch (const InputError& e) {
        throw v.fault("profile", e.problem(), e.hint());
      }
    }
  } else if (!v.reads()) {
    v.text({"profile", "", "one of 'canyon profiles', or a profile file: of the scenario's first receiver",
            "the scenario's"},
           r.profile);
  }
  v.file({"nmea", "", "the fixes that the recorded receiver reported: GGA with RMC or ZDA"}, r.nmea);
  v.boolean({"align", "", "estimate the city's offset on the first part; metrics are then of the rest"},
            r.align);
  v.boolean({"align_heading", "", "also estimate its heading"}, r.align_heading);
  v.number({"split", "", "fraction of epochs in the first part", "0.5"}, r.split, {0, 1, true, true});
  if (v.reads() && r.align_heading && !r.align)
    throw v.fault("align_heading", "there is nothing to align", "add align: true");
}

void visit(options::Visitor& v, RecordingList& list) {
  v.require("recordings", kOneNeeded);
  std::set<std::string> names;
  v.list("recordings", list.recordings, [&](ListedRecording& r) {
    visit(v, r);
    if (v.reads() && !names.insert(r.name).second)
      throw v.fault("name", fmt::format("'{}' names two recordings", r.name), "give each its own name");
  });
  if (v.reads() && list.recordings.size() > kMaxRecordings) {
    throw v.fault("recordings", fmt::format("{} recordings are too many", list.recordings.size()),
                  fmt::format("give {} at most", kMaxRecordings));
  }
}

bool is_recording_list(const std::filesystem::path& path) {
  const TextFile file(path, kMaxBytes);
  try {
    const options::Node root = options::parse_yaml(std::string(file.text()), {}, "");
    return root.kind == options::Node::Kind::Mapping && root.find("recordings") != nullptr;
  } catch (const InputError&) {
    return false;  // the reader of scenarios reports the error
  }
}

RecordingList read_recording_list(const std::filesystem::path& path) {
  const TextFile file(path, kMaxBytes);
  const options::Document document = document_of(path);
  RecordingList list;
  options::read(options::parse_yaml(std::string(file.text()), document, kOneNeeded), document, list);
  return list;
}

}  // namespace canyon::validation
