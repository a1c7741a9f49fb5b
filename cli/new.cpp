#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <queue>
#include <set>
#include <tuple>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/gzip_file.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/buildings/sources/model_kind.hpp"
#include "canyon/city/buildings/sources/osm_reader.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/orbit/precise_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "cli/commands.hpp"
#include "cli/scenario_run.hpp"

namespace canyon::cli {
namespace {

namespace fs = std::filesystem;
using geodesy::degrees;
using geodesy::GpsTime;

constexpr double kDrive_m = 500, kAntenna_m = 1.5;
/// Interval of the checks of a route, and distance checked to each side [m].
constexpr double kStep_m = 2, kLateralOffset_m = 1.2;

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

/// Files by their use in a scenario.
struct SortedFiles {
  std::vector<fs::path> cities, navigation, precise, tracks;

  explicit SortedFiles(const std::vector<std::string>& files) {
    for (const fs::path path : files)
      std::array{&cities, &navigation, &precise, &tracks}[static_cast<std::size_t>(scenario_part(path))]
          ->push_back(path);
    const auto only = [](const std::vector<fs::path>& paths, std::size_t first, const char* hint) {
      if (paths.size() > first) throw InputError(paths[first], 0, "is one file too many", hint);
    };
    if (cities.empty())
      throw InputError("no file is a city", std::string("give a map: ") + simulation::city_file_endings());
    only(tracks, 1, "give one recorded path");
    only(precise, navigation.empty() ? precise.size() : 0, "give navigation files or SP3");
    if (!are_maps()) only(cities, 1, "give one city, or several maps");
  }
  [[nodiscard]] bool are_maps() const {
    return std::all_of(cities.begin(), cities.end(), [](const fs::path& path) {
      return simulation::is_file_of<simulation::MapCity>(path);
    });
  }
};

/// Routes through a city, as corners in its frame [m].
class DriveFinder {
 public:
  using Route = std::vector<Eigen::Vector2d>;

  DriveFinder(const simulation::CityScene& scene, bool on_terrain) : scene_(scene), on_terrain_(on_terrain) {
    for (const int axis : {0, 1}) {  // the middle corner of the city
      std::vector<double> values;
      for (const Eigen::Vector3d& corner : scene.city.mesh.vertices) values.push_back(corner(axis));
      if (values.empty()) continue;
      const auto middle = values.begin() + std::ssize(values) / 2;
      std::nth_element(values.begin(), middle, values.end());
      middle_(axis) = *middle;
    }
  }
  [[nodiscard]] double antenna_m(const Eigen::Vector2d& position) const {
    const auto terrain = scene_.scene.terrain_height(position.x(), position.y());
    return kAntenna_m + terrain.value_or(-scene_.scene.height_above_ground({position.x(), position.y(), 0}));
  }
  [[nodiscard]] static double length_m(const Route& route) {
    double length_m = 0;
    for (std::size_t i = 1; i < route.size(); ++i) length_m += (route[i] - route[i - 1]).norm();
    return length_m;
  }

  /// The first route of 500 m along streets from one of the points next to the middle, else the longest.
  [[nodiscard]] Route along(const buildings::StreetMap& streets) const {
    Route points;
    for (const buildings::LonLat& at : streets.positions) {
      const auto position =
          geodesy::Geodetic::from_degrees(at.y(), at.x(), scene_.city.frame.origin().height_m);
      points.emplace_back(scene_.city.frame.local_from_geodetic(position).head<2>());
    }
    std::vector<std::vector<std::size_t>> next(points.size());
    for (const auto& [from, to] : streets.pieces) {
      next[from].push_back(to);
      next[to].push_back(from);
    }
    std::vector<std::size_t> starts(points.size());
    std::iota(starts.begin(), starts.end(), 0);
    std::stable_sort(starts.begin(), starts.end(), [&](std::size_t a, std::size_t b) {
      return (points[a] - middle_).squaredNorm() < (points[b] - middle_).squaredNorm();
    });
    if (starts.size() > 30) starts.resize(30);
    Route best;
    for (const std::size_t start : starts) {
      Route route = shortest(points, next, start);
      if (length_m(route) > length_m(best)) best = std::move(route);
      if (length_m(best) > kDrive_m - 1) break;
    }
    return best;
  }

  /// The longest straight route up to 500 m from a point near the middle.
  [[nodiscard]] Route straight() const {
    Route best;
    double max_m = 0;
    for (int k = 0; k < 11 * 11 * 24; ++k) {
      const Eigen::Vector2d from = middle_ + 20 * Eigen::Vector2d(k / 24 % 11 - 5, k / 24 / 11 - 5);
      const double azimuth = geodesy::radians(15.0 * (k % 24));
      const Eigen::Vector2d step = kStep_m * Eigen::Vector2d(std::sin(azimuth), std::cos(azimuth));
      int steps = 0;
      while (steps * kStep_m < kDrive_m && is_free(from + step * steps)) ++steps;
      if (steps * kStep_m <= max_m) continue;
      max_m = steps * kStep_m;
      best = {from, from + step * (steps - 1)};
    }
    return best;
  }

 private:
  [[nodiscard]] bool is_free(const Eigen::Vector2d& position) const {
    if (on_terrain_ && !scene_.scene.terrain_height(position.x(), position.y())) return false;
    const double up_m = antenna_m(position);
    const auto free = [&](double east_m, double north_m) {
      const Eigen::Vector3d at(position.x() + east_m, position.y() + north_m, up_m);
      return scene_.scene.containment(at) == raytrace::Containment::Free;
    };
    return free(0, 0) && free(kLateralOffset_m, 0) && free(-kLateralOffset_m, 0) &&
           free(0, kLateralOffset_m) && free(0, -kLateralOffset_m);
  }

  /// The shortest path to the nearest point that is 500 m away along it, else to the farthest (Dijkstra).
  [[nodiscard]] Route shortest(const Route& points, const std::vector<std::vector<std::size_t>>& next,
                               std::size_t start) const {
    const auto leads = [&](std::size_t from, std::size_t to) {
      const Eigen::Vector2d route = points[to] - points[from];
      const double steps = std::ceil(route.norm() / kStep_m) + 1;
      for (double i = 0; i <= steps; ++i)
        if (!is_free(points[from] + route * i / steps)) return false;
      return true;
    };
    using Step = std::tuple<double, std::size_t, std::size_t>;  // length, point, previous point
    std::priority_queue<Step, std::vector<Step>, std::greater<>> open;
    open.emplace(0.0, start, start);
    std::map<std::size_t, std::size_t> before;
    std::size_t last = start;
    double away_m = 0;
    while (!open.empty() && away_m < kDrive_m) {
      const auto [length_m, at, from] = open.top();
      open.pop();
      if (before.count(at) > 0 || !leads(from, at)) continue;
      before[at] = from;
      last = at;
      away_m = length_m;
      for (const std::size_t to : next[at]) open.emplace(away_m + (points[to] - points[at]).norm(), to, at);
    }
    if (before.empty()) return {};
    Route route{points[last]};
    for (; last != start; last = before[last]) route.push_back(points[before[last]]);
    if (away_m > kDrive_m) route[0] += (route[1] - route[0]).normalized() * (away_m - kDrive_m);
    std::reverse(route.begin(), route.end());
    return route;
  }

  const simulation::CityScene& scene_;
  bool on_terrain_;
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();
};

/// The command with which a user runs a scenario.
std::string run_command(const fs::path& scenario) {
  const auto quoted = [](const std::string& name) {
    return name.find_first_of(" '\"$&;()|<>*?`\\") == std::string::npos
               ? name
               : fmt::format("'{}'", fmt::join(split(name, '\''), R"('\'')"));
  };
  return fmt::format("canyon simulate {} --out {} --view", quoted(scenario.string()),
                     quoted("out/" + scenario.stem().string()));
}

/// Writes a scenario, part by part.
class ScenarioWriter {
 public:
  ScenarioWriter(const std::vector<std::string>& files, fs::path name)
      : files_(files), name_(std::move(name)) {}

  [[nodiscard]] NewScenario write(const std::optional<geodesy::Geodetic>& origin) {
    write_city(origin);
    write_sky();
    const std::string receivers =
        "receivers:\n  - name: car\n    profile: ublox-m10  # `canyon profiles` lists others\nseed: 1\n";
    const bool track = !files_.tracks.empty();
    const simulation::Scenario draft = simulation::parse_scenario(
        out_.yaml + (track ? "start: " + text(start_) + "\n" + path_text(true) : "") + receivers, name_,
        {false});
    const auto scene = std::make_shared<simulation::CityScene>(simulation::load_city(draft));
    const city::CitySummary summary = city::summarize(scene->city);
    log("city", fmt::format("{}, {} buildings", scene->city.name, summary.buildings));
    if (track)
      write_track(draft, *scene, summary.terrain_triangles > 0);
    else
      write_drive(*scene, summary.terrain_triangles > 0);
    log("receiver", "ublox-m10, a common module");
    out_.yaml =
        "# Written by canyon new. To run it: " + run_command(name_) + "\n" + out_.yaml + receivers +
        "# Next, without the #; all keys: `canyon scenario keys`, kinds of faults: `canyon faults list`.\n"
        "# outputs: {nmea: true, rinex_observation: true}\n"
        "# faults: [{from_s: 5, until_s: 15, outage: {satellites: Galileo}}]\n";
    out_.report = simulation::Simulation(simulation::parse_scenario(out_.yaml, name_), scene).report();
    return std::move(out_);
  }

 private:
  static std::string text(GpsTime time) {
    return geodesy::format_gpst(time, time.nanoseconds() % GpsTime::kNanosecondsPerSecond == 0 ? 0 : 9);
  }
  /// Files by their names relative to the scenario's folder.
  [[nodiscard]] std::string list(const std::vector<fs::path>& paths) const {
    std::string names;
    for (const fs::path& path : paths) {
      const bool far = tiles::is_web_address(path.string());
      fs::path name = far ? path : fs::proximate(path, fs::absolute(name_).parent_path());
      if (is_folder(path)) name /= "";
      names += (names.empty() ? "" : ", ") + Json(name.string()).dump();
    }
    return paths.size() == 1 ? names : "[" + names + "]";
  }
  void log(std::string_view part, const std::string& fact) {
    out_.facts.push_back(fmt::format("{:<12}{}", part, fact));
  }

  void write_city(const std::optional<geodesy::Geodetic>& origin) {
    const fs::path& first = files_.cities.front();
    if (!origin && simulation::is_file_of<simulation::MeshCity>(first))
      throw InputError(first, 0, "is a mesh, which is not georeferenced",
                       "give --origin LAT,LON,HEIGHT of its zero");
    out_.yaml = fmt::format(
        "city:\n  {}: {}{}\n", files_.are_maps() ? "osm" : "file", list(files_.cities),
        files_.are_maps() ? "  # also bbox: [west, south, east, north], terrain: heights.tif" : "");
    if (origin)
      out_.yaml +=
          fmt::format("  origin: {{latitude_deg: {:.9f}, longitude_deg: {:.9f}, height_m: {:.3f}}}\n",
                      degrees(origin->latitude_rad), degrees(origin->longitude_rad), origin->height_m);
  }

  void write_sky() {
    if (!files_.navigation.empty()) {
      const gnss::NavigationData data = rinex::read_rinex_navigation(files_.navigation);
      start_ = middle_time(data);
      std::set<int> gps;
      for (const auto& e : data.kepler)
        if (e.id.system == gnss::System::GPS) gps.insert(e.id.number);
      if (!gps.empty() && gps.size() < 24)
        log("sky", fmt::format("{} of about 31 GPS satellites, as received by one station; a day's merged "
                               "file (BRDC) has all",
                               gps.size()));
      out_.yaml += "sky:\n  navigation: " + list(files_.navigation);
    } else if (!files_.precise.empty()) {
      const auto [first, last] = orbit::PreciseSky(files_.precise.front()).span();
      start_ = first + (last - first) / 2;
      out_.yaml += "sky:\n  sp3: " + list(files_.precise);
    } else {
      constexpr std::int64_t kDay_s = 86400;
      start_ = geodesy::gps_from_unix((std::time(nullptr) / kDay_s * kDay_s + kDay_s / 2) * 1'000'000'000);
      out_.yaml += "sky:\n  nominal: true";
      log("sky", "nominal satellites, since no navigation file is given");
    }
    start_ = GpsTime::from_week(start_.week(), std::floor(start_.seconds_of_week() / 60) * 60);
    out_.yaml += "  # also systems: [GPS, Galileo]\n";
  }

  [[nodiscard]] std::string path_text(bool on_terrain) const {
    return fmt::format(
        "trajectory:\n  file: {}\n{}", list(files_.tracks),
        on_terrain ? "  height_above_terrain_m: 1.5  # without it: the file's own heights\n" : "");
  }

  void write_track(const simulation::Scenario& draft, const simulation::CityScene& scene, bool on_terrain) {
    const fs::path& file = files_.tracks.front();
    simulation::RecordedPath path =
        simulation::read_recorded_path(file, draft.trajectory.format, start_, {!on_terrain, 0});
    if (path.timed) simulation::drop_unordered(path);
    // The longest part on the city's ground.
    const auto& points = path.points;
    std::size_t first = 0, count = 0, run = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d at = scene.city.frame.local_from_geodetic(points[i].position);
      run = !on_terrain || scene.scene.terrain_height(at.x(), at.y()) ? run + 1 : 0;
      if (run > count) count = run, first = i + 1 - run;
    }
    const bool dated = path.timed && path.is_dated;
    if (points.size() < 2) throw InputError(file, 0, "has one position", "give a path");
    if (count < 2 || (!dated && count < points.size()))
      throw InputError(
          file, 0,
          count < 2 ? fmt::format("is next to the city: it begins {:.1f} km from it",
                                  scene.city.frame.local_from_geodetic(points.front().position).norm() / 1e3)
                    : "leads out of the city, and has no dates",
          "give a map of all of it, and angles in degrees in the order of the format");
    if (!dated) {
      if (path.timed && (start_ < points.front().time || start_ > points.back().time))
        start_ = points.front().time;  // times of day
      out_.yaml += fmt::format("start: {}\n", text(start_));
      log("start", text(start_) + ", since the path has no dates");
    } else if (count < points.size()) {
      const GpsTime begin = points[first].time, end = points[first + count - 1].time;
      out_.yaml += fmt::format("start: {}\nduration_s: {:.3f}\n", text(begin), end - begin);
      log("start", fmt::format("{} for {:.0f} s, where the path is on the map", text(begin), end - begin));
    }
    out_.yaml += "rate_hz: 1\n" + path_text(on_terrain) + (path.timed ? "" : "  speed_mps: 8\n");
    log("trajectory", fmt::format("{} of {} positions of {}{}{}", count, points.size(), file.string(),
                                  on_terrain ? ", 1.5 m above the ground" : ", at the file's heights",
                                  path.timed ? "" : ", at 8 m/s, since it has no times"));
  }

  void write_drive(const simulation::CityScene& scene, bool on_terrain) {
    const DriveFinder finder(scene, on_terrain);
    DriveFinder::Route route;
    std::vector<fs::path> maps;
    std::copy_if(files_.cities.begin(), files_.cities.end(), std::back_inserter(maps),
                 [](const fs::path& city) {
                   return simulation::is_file_of<simulation::MapCity>(city) &&
                          !buildings::has_ending(city, {".gml", ".citygml"}) &&
                          buildings::model_kind(city) == buildings::ModelKind::None;
                 });
    if (!maps.empty()) route = finder.along(buildings::read_streets(maps));
    const bool streets = DriveFinder::length_m(route) > kDrive_m / 5;
    if (!streets) route = finder.straight();
    if (route.empty())
      throw InputError(files_.cities.front(), 0, "has no space for a drive near its middle",
                       "give a recorded path");
    out_.yaml +=
        fmt::format("start: {}\nrate_hz: 1\ntrajectory:  # or file: track.gpx\n  waypoints:\n", text(start_));
    for (const Eigen::Vector2d& corner : route) {
      const geodesy::Geodetic position =
          scene.city.frame.geodetic_from_local({corner.x(), corner.y(), finder.antenna_m(corner)});
      out_.yaml += fmt::format("    - {{latitude_deg: {:.7f}, longitude_deg: {:.7f}{}}}\n",
                               degrees(position.latitude_rad), degrees(position.longitude_rad),
                               on_terrain ? "" : fmt::format(", height_m: {:.2f}", position.height_m));
    }
    out_.yaml += "  speed_mps: 8  # also acceleration_mps2: 2, which rounds corners\n";
    if (on_terrain) out_.yaml += "  height_above_terrain_m: 1.5\n";
    log("start", text(start_));
    log("trajectory", fmt::format("{:.0f} m {} near the city's middle, at 8 m/s, 1.5 m above the ground",
                                  DriveFinder::length_m(route),
                                  streets ? "along streets" : "straight on, outside buildings"));
  }

  SortedFiles files_;
  fs::path name_;
  GpsTime start_;  ///< if no track has it
  NewScenario out_;
};

struct NewArguments {
  std::vector<std::string> files;
  std::string out = "drive.yaml", origin;
  bool quiet = false;
};

int run_new(const NewArguments& arguments) {
  const fs::path out = arguments.out;
  if (!is_scenario(out))
    throw InputError(out, 0, "is not a name of a scenario", "give a name that ends in .yaml");
  std::error_code ignored;
  if (fs::symlink_status(out, ignored).type() != fs::file_type::not_found)
    throw InputError(out, 0, "already exists", "give another name by -o, or remove it");
  { const OutputFile probe(out); }  // a read-only folder is found before the city is loaded
  const NewScenario made = new_scenario(arguments.files, arguments.out, arguments.origin);
  print_report(made.report, "canyon check " + arguments.out);
  write_file(out, made.yaml);
  if (arguments.quiet) return kOk;
  fmt::print("{}\n  {}\n\nRun it:\n  {}\n", arguments.out, fmt::join(made.facts, "\n  "), run_command(out));
  return kOk;
}

}  // namespace

ScenarioPart scenario_part(const fs::path& file) {
  const bool city = simulation::source_of_file(file).has_value();
  if (!tiles::is_web_address(file.string()) && !(city && is_folder(file))) check_input_file(file);
  if (city) return ScenarioPart::City;
  const FileKind kind = is_scenario(file) ? FileKind::Other : file_kind(file);
  if (kind == FileKind::RinexNavigation) return ScenarioPart::Navigation;
  if (kind == FileKind::Sp3) return ScenarioPart::Precise;
  if (kind == FileKind::Columns || !trajectory_format(kind).empty()) return ScenarioPart::Track;
  throw explained(InputError(file, 0, "cannot be used in a new scenario",
                             "give a city, navigation files or SP3, and a recorded path"),
                  file, "a part of a new scenario");
}

NewScenario new_scenario(const std::vector<std::string>& files, const std::string& name,
                         const std::string& origin) {
  std::optional<geodesy::Geodetic> position;
  if (!origin.empty()) position = parse_position(origin, "--origin");
  return ScenarioWriter(files, name).write(position);
}

void add_new(Command& app) {
  Command& command = app.add_command("new", "write a scenario for a map, and for recordings made there");
  NewArguments& arguments = command.run_with(run_new);
  command
      .add_option("files", arguments.files, "FILE...",
                  "a city or maps, navigation files or SP3, and one recorded path, in any order")
      .required();
  command.add_option("-o,--out", arguments.out, "FILE", "the scenario (drive.yaml)").writes();
  command.add_option("--origin", arguments.origin, "LAT,LON,HEIGHT", "position of a mesh's zero");
  command.add_flag("--quiet", arguments.quiet, "print warnings and errors only");
  command.footer =
      "Without a path it drives 500 m along the map's streets; without a navigation file the sky is nominal.";
}

}  // namespace canyon::cli
