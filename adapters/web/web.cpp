// No header declares it: the page (viewer/src/web_worker.ts) calls it by name. Files are in the module's own
// file system, which has no external access.
#include <emscripten.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_request.hpp"
#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/pictures/map_view.hpp"
#include "canyon/base/json.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/outputs/view/page.hpp"
#include "canyon/outputs/view/probe.hpp"
#include "canyon/outputs/view/view_sink.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "cli/commands.hpp"
#include "cli/scenario_run.hpp"

namespace {

using namespace canyon;
namespace fs = std::filesystem;

EM_JS(void, report_progress, (double done, double planned), { Module['progress'](done, planned); });

/// The shown run.
struct ShownPicture {
  std::shared_ptr<simulation::CityScene> scene;
  std::unique_ptr<simulation::Simulation> simulation;
  std::unique_ptr<view::Probe> probe;
};
ShownPicture shown;

/// The scenario written by `canyon new` for {"files"} and for those of {"kept"} that they do not replace:
/// {"files", "messages", "yaml", "facts"}, or without the last two while files wait for a city or for the
/// {"origin"} of a mesh. A rejected file is left out, with a message; without {"kept"} it is an error.
Json make_scenario(const Json& given) {
  std::map<std::string, cli::ScenarioPart> dropped, kept;
  Json messages = Json::array();
  const auto refuse = [&](const InputError& error) {
    if (!given.contains("kept")) throw;
    messages.push_back(error.what());
  };
  const auto names = [&](const char* key) {
    return given.contains(key) ? given.at(key).get<std::vector<std::string>>() : std::vector<std::string>{};
  };
  const auto sort = [&](const char* key, auto& files) {
    for (const std::string& name : names(key)) try {
        const cli::ScenarioPart part = cli::scenario_part(name);
        files[name] = part == cli::ScenarioPart::Precise ? cli::ScenarioPart::Navigation : part;
      } catch (const InputError& error) {
        refuse(error);
      }
  };
  sort("files", dropped);
  sort("kept", kept);
  const std::string origin = given.contains("origin") ? given.at("origin").get<std::string>() : "";
  const bool again = names("files").empty();
  while (again || !dropped.empty()) {
    std::map<cli::ScenarioPart, std::vector<std::string>> parts;
    for (const auto& [name, part] : dropped) parts[part].push_back(name);
    for (const auto& file : kept)
      if (std::none_of(dropped.begin(), dropped.end(),
                       [&](const auto& d) { return d.second == file.second; }))
        parts[file.second].push_back(file.first);
    std::vector<std::string> files;
    for (const auto& [part, names] : parts) files.insert(files.end(), names.begin(), names.end());
    Json made = {{"files", files}, {"messages", messages}};
    const bool mesh = simulation::is_file_of<simulation::MeshCity>(files.empty() ? "" : files.front());
    try {
      if (mesh) (void)cli::parse_position(origin, files.front() + ": the position of its zero");
      if (parts[cli::ScenarioPart::City].empty()) throw InputError("no file is a city", "give one as well");
    } catch (const InputError& error) {
      refuse(error);
      made["messages"] = messages;
      return made;
    }
    try {
      const cli::NewScenario scenario = cli::new_scenario(files, "scenario.yaml", mesh ? origin : "");
      made["yaml"] = scenario.yaml;
      made["facts"] = scenario.facts;
      return made;
    } catch (const InputError& error) {
      const std::string name = fs::path(error.file()).filename().string();
      if (std::find(files.begin(), files.end(), name) == files.end()) throw;
      refuse(error);
      dropped.erase(name);
      kept.erase(name);
    }
  }
  Json files = Json::array();
  for (const auto& [name, part] : kept) files.push_back(name);
  return {{"files", files}, {"messages", messages}};
}

/// Runs scenario.yaml as `canyon simulate --view` does, or its first {"seconds"}, into out/, and exports its
/// view as out/page.html: {"files", "report", "seconds"}.
Json run(const Json& given) {
  shown = {};
  fs::remove_all("out");
  simulation::Scenario scenario = simulation::read_scenario("scenario.yaml");
  if (given.contains("seconds")) scenario.duration_s = given.at("seconds").get<double>();
  shown.scene = std::make_shared<simulation::CityScene>(simulation::load_city(scenario));
  shown.simulation = std::make_unique<simulation::Simulation>(std::move(scenario), shown.scene);
  const auto files = encoding::make_file_sinks(*shown.simulation, "out");
  view::ViewOptions kept;
  kept.skyline_step_m = 9;  // rays of skylines would take half of the time
  const auto view = view::make_view(*shown.simulation, "out/view", kept);
  std::vector<simulation::EpochSink*> sinks{view.get()};
  for (const auto& file : files) sinks.push_back(file.get());
  simulation::RunOptions options;
  options.progress = [](std::size_t done, std::size_t planned) {
    report_progress(static_cast<double>(done), static_cast<double>(planned));
  };
  const simulation::RunResult result = shown.simulation->run(sinks, options);
  view::export_page("viewer.html", "out/view", "out/page.html");
  Json report = Json::array();
  for (const auto& [level, line] : shown.simulation->report().entries())
    report.push_back(std::string(ReadReport::name(level)) + ": " + line);
  for (const std::string& warning : result.warnings) report.push_back("warning: " + warning);
  Json names = Json::array();
  for (const auto& entry : fs::recursive_directory_iterator("out"))
    if (entry.is_regular_file() && entry.path().parent_path() != "out/view")
      names.push_back(entry.path().string());
  return {{"files", names}, {"report", report}, {"seconds", result.wall_s}};
}

/// A heat map in memory, at one altitude and instant.
class ComputedMap final : public heatmap::MapReader {
 public:
  explicit ComputedMap(const heatmap::Heatmap& map, const geodesy::LocalFrame& frame) {
    const heatmap::Request& request = map.request();
    about_ = {request.grid,
              frame,
              request.times,
              request.altitudes_m,
              request.altitude_kind,
              request.layers,
              simulation::describe(request.motion)};
    for (std::size_t unit = 0; unit < map.unit_count(); ++unit) {
      tiles_.push_back(map.compute(unit));
      report_progress(static_cast<double>(unit + 1), static_cast<double>(map.unit_count()));
    }
  }
  [[nodiscard]] const MapInfo& about() const override { return about_; }
  [[nodiscard]] std::optional<heatmap::MapSample> at(const Eigen::Vector2d& enu, double altitude_m,
                                                     geodesy::GpsTime time) const override {
    const heatmap::Grid& grid = about_.grid;
    const auto column = static_cast<std::uint32_t>((enu.x() - grid.west_m) / grid.spacing_m);
    const auto row = static_cast<std::uint32_t>((enu.y() - grid.south_m) / grid.spacing_m);
    const std::size_t number = row / grid.tile_size * grid.tiles_across() + column / grid.tile_size;
    const heatmap::Tile tile = grid.tile(number);
    const std::size_t cell = std::size_t{row - tile.first_row} * tile.columns + (column - tile.first_column);
    const heatmap::TileValues& values = tiles_[number];
    heatmap::MapSample result{{}, values.state[cell], time, altitude_m};
    for (std::size_t k = 0; k < about_.layers.size(); ++k)
      result.values.push_back(values.values[k * tile.cells() + cell]);
    return result;
  }

 private:
  MapInfo about_;
  std::vector<heatmap::TileValues> tiles_;  ///< one unit each
};

/// A heat map of {"box"} (west, south, east, north [m], city's frame) in cells of {"spacing_m"} is added to
/// the view of the last run, at its first instant and its antenna's height, and exported again.
Json map(const Json& given) {
  if (!shown.simulation) throw InputError("there is no run for a heat map", "run a scenario first");
  const simulation::Scenario& scenario = shown.simulation->scenario();
  const auto box = given.at("box").get<std::vector<double>>();
  heatmap::Request request;
  request.grid = heatmap::Grid::covering(box.at(0), box.at(1), box.at(2), box.at(3),
                                         given.at("spacing_m").get<double>());
  request.altitudes_m = {heatmap::usual_altitude_m(scenario, request.altitude_kind)};
  request.times = {shown.simulation->begin()};
  request.samples.seed = scenario.seed;
  request.motion = scenario.map;
  const city::City& city = shown.scene->city;
  heatmap::check_box({{box[0], box[1]}, {box[2], box[3]}}, city);
  const heatmap::Heatmap heat(shown.simulation->environment(), scenario.receivers.front(), std::move(request),
                              "");
  heatmap::add_map(ComputedMap(heat, city.frame), "heat map", city, "out/view");
  view::export_page("viewer.html", "out/view", "out/page.html");
  return Json::object();
}

/// The response to a page that sets an antenna: {"answer"}, a message of docs/view-format.md.
Json probe(const Json& given) {
  const auto message = given.at("message").get<std::string>();
  if (!shown.simulation) return {{"answer", view::no_probe(message, "run a scenario first")}};
  if (!shown.probe)
    shown.probe = std::make_unique<view::Probe>(*shown.simulation, shown.scene,
                                                view::ViewOptions{}.paths_per_satellite);
  return {{"answer", shown.probe->handle_request(message)}};
}

}  // namespace

/// @param question {"do": "new", "run", "map" or "probe", ...}; returns that function's result, or {"error"}.
/// The text is valid until the next call.
extern "C" EMSCRIPTEN_KEEPALIVE const char* canyon_do(const char* question) {
  static std::string response;
  try {
    const Json given = Json::parse(question);
    const auto what = given.at("do").get<std::string>();
    response = (what == "new"   ? make_scenario
                : what == "run" ? run
                : what == "map" ? map
                                : probe)(given)
                   .dump();
  } catch (const std::exception& error) {
    response = Json{{"error", error.what()}}.dump();
  }
  return response.c_str();
}
