#include "adapters/common/sdf/drive_settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "adapters/common/sdf/plugin_elements.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/receiver_runner.hpp"

namespace canyon::adapters {
namespace {

using Eigen::Vector3d;
using geodesy::GpsTime;
using options::Visitor;

struct DriveElements {
  std::optional<std::filesystem::path> file;
  std::string format;  ///< empty: detected from the file
  std::optional<GpsTime> start;
  std::vector<Vector3d> waypoints;
  simulation::VehicleDrive::WaypointOptions legs;
  bool heading = true;
  Vector3d offset_m = Vector3d::Zero();
};

Vector3d to_vector(const Visitor& v, std::string_view key, const std::string& text) {
  const auto words = split_blanks(text);
  Vector3d result;
  for (int i = 0; i < 3; ++i) {
    const auto number =
        words.size() == 3 ? parse_double(words[static_cast<std::size_t>(i)]) : std::optional<double>();
    if (!number) {
      throw v.fault(key, fmt::format("'{}' is not three numbers", text),
                    "write x, y and z in metres with blanks between, such as 10 -3.5 0");
    }
    result[i] = *number;
  }
  return result;
}

// A path is from a file or from waypoints.
void check_kind(const Visitor& v) {
  const bool file = v.has("trajectory");
  if (!file && !v.has("waypoint")) {
    throw v.fault({}, "there is neither a path nor a position",
                  "give a <trajectory> file, or at least one <waypoint>x y z</waypoint>");
  }
  const auto belongs = [&](std::initializer_list<const char*> keys, const char* problem, const char* hint) {
    for (const char* key : keys)
      if (v.has(key)) throw v.fault(key, problem, hint);
  };
  if (file)
    belongs({"speed_mps", "hold_s"}, "applies only to waypoints", "remove it: the times are in the file");
  else
    belongs({"format", "start"}, "applies only to a <trajectory>", "remove it: waypoints begin at time 0");
}

void visit(Visitor& v, DriveElements& o) {
  const std::vector<std::string_view> formats(simulation::trajectory_formats().begin(),
                                              simulation::trajectory_formats().end());
  std::vector<std::string> waypoints;
  std::optional<std::string> offset;
  v.one_of({"trajectory", "waypoint"});
  if (v.reads()) check_kind(v);
  v.file({"trajectory", "",
          "file of geodetic positions, as in a scenario; georeferenced by the world's "
          "`spherical_coordinates`, heading "
          "included"},
         o.file);
  v.word({"format", "", "[formats](../scenario.md)", "detected from the file's content"}, o.format, formats);
  simulation::visit_start(v, o.start);
  v.texts(
      {"waypoint", "m", "x y z in the world's frame, instead of a file; repeatable, joined by straight legs"},
      waypoints);
  for (const std::string& text : waypoints) o.waypoints.push_back(to_vector(v, "waypoint", text));
  v.number({"speed_mps", "m/s", "along the legs"}, o.legs.speed_mps, {1e-6, 1e5});
  v.number({"hold_s", "s", "time at rest at each waypoint"}, o.legs.hold_s, {0, 1e8});
  v.boolean({"loop", "", "from the last waypoint straight back to the first; a file restarts at its end"},
            o.legs.loop);
  v.boolean({"heading", "",
             "the model is level and heads in the direction of travel; false: it keeps its attitude"},
            o.heading);
  v.text({"offset_m", "m", "the model's origin from the path: forward, left, up", "0 0 0"}, offset);
  if (offset) o.offset_m = to_vector(v, "offset_m", *offset);
}

simulation::VehicleDrive along_file(const PluginElements& elements, const DriveElements& given,
                                    const geodesy::LocalFrame& world, std::vector<std::string>& warnings) {
  // A file with relative times in seconds begins at the world's time 0, for any date.
  const GpsTime zero = given.start.value_or(GpsTime::from_week(2000, 0));
  const auto read = simulation::read_trajectory_file(*given.file, given.format, zero);
  for (std::string& line : read.report.warnings()) warnings.push_back(std::move(line));
  const GpsTime begin = given.start || !read.is_dated ? zero : read.trajectory.begin();
  try {
    return simulation::VehicleDrive::along_trajectory(read.trajectory, begin, world, given.legs.loop);
  } catch (const InputError& error) {
    throw elements.error("<trajectory>", error.problem(), error.hint());
  }
}

}  // namespace

const options::Description& drive_description() {
  static const options::Description description = [] {
    options::Description made = options::describe<DriveElements>();
    const auto start = std::find_if(made.keys.begin(), made.keys.end(),
                                    [](const options::Key& key) { return key.path == "start"; });
    start->default_value = "the file's first time";
    start->meaning = "time at simulated time 0; the receiver's `start` should be the same";
    return made;
  }();
  return description;
}

DriveSettings read_drive_settings(const sdf::ElementPtr& element, const std::string& name,
                                  const std::filesystem::path& folder, const ResourcePaths& resources,
                                  const geodesy::LocalFrame& world) {
  const PluginElements elements(element, name, drive_description());
  std::vector<std::string> warnings = elements.warnings();
  DriveElements given;
  std::vector<std::filesystem::path> folders;
  if (!folder.empty()) folders.push_back(folder);
  elements.read(given, folders, resources);
  simulation::VehicleDrive drive =
      given.file ? along_file(elements, given, world, warnings)
                 : simulation::VehicleDrive::along_waypoints(given.waypoints, given.legs);
  return {std::move(drive), given.heading, given.offset_m, std::move(warnings)};
}

}  // namespace canyon::adapters
