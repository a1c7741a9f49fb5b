#include "adapters/common/sdf/drive_settings.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <utility>

#include "adapters/common/sdf/plugin_elements.hpp"
#include "adapters/common/sdf/resource_files.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"

namespace canyon::adapters {

using geodesy::GpsTime;

namespace {

const std::vector<std::string>& known_elements() {
  static const std::vector<std::string> known = {"trajectory", "format",  "waypoint", "speed_mps",
                                                 "hold_s",     "loop",    "start",    "start.week",
                                                 "start.tow",  "heading", "offset_m"};
  return known;
}

Eigen::Vector3d read_vector(const std::string& text, const std::string& name, const std::string& tag) {
  const auto words = split_blanks(text);
  Eigen::Vector3d result;
  for (int i = 0; i < 3; ++i) {
    const auto number =
        words.size() == 3 ? parse_double(words[static_cast<std::size_t>(i)]) : std::optional<double>();
    if (!number || !std::isfinite(*number)) {
      throw InputError(fmt::format("{}: {}: '{}' is not three numbers", name, tag, text),
                       "write x, y and z in metres with blanks between, such as 10 -3.5 0");
    }
    result[i] = *number;
  }
  return result;
}

// The waypoints, taken out of a copy of the element: they may stand as often as one likes.
std::vector<Eigen::Vector3d> take_waypoints(sdf::Element& element, const std::string& name) {
  std::vector<Eigen::Vector3d> waypoints;
  for (auto child = element.GetFirstElement(); child;) {
    const auto next = child->GetNextElement();
    if (child->GetName() == "waypoint") {
      const auto value = child->GetValue();
      waypoints.push_back(read_vector(value ? std::string(trim(value->GetAsString())) : "", name,
                                      fmt::format("<waypoint> {}", waypoints.size() + 1)));
      element.RemoveChild(child);
    }
    child = next;
  }
  return waypoints;
}

std::optional<GpsTime> take_start(PluginElements& elements) {
  if (const auto text = elements.take("start")) {
    try {
      return geodesy::parse_time(text->values.front());
    } catch (const InputError& error) {
      throw elements.error(*text, error.problem(), error.cure());
    }
  }
  const bool has_week = elements.has("start.week");
  if (has_week != elements.has("start.tow")) {
    const PluginElements::Element element{"start", "<start>", {}};
    throw elements.error(element, "week and tow belong together", "give both");
  }
  if (!has_week) return std::nullopt;
  const int week = *elements.integer("start.week", 0, 100'000);
  return GpsTime::from_week(week, *elements.number("start.tow", 0, 604'800));
}

VehicleDrive read_file_drive(PluginElements& elements, PluginElements::Element file,
                             const std::filesystem::path& folder, const ResourcePaths& resources,
                             const geodesy::LocalFrame& world, bool loop,
                             std::vector<std::string>& warnings) {
  const std::string format = elements.choice("format", simulation::trajectory_formats()).value_or("csv");
  const std::optional<GpsTime> start = take_start(elements);
  std::vector<std::filesystem::path> looked;
  std::vector<std::filesystem::path> folders;
  if (!folder.empty()) folders.push_back(folder);
  const auto path = find_resource(file.values.front(), folders, resources, looked);
  if (!path) {
    throw elements.error(file, fmt::format("there is no file '{}'", file.values.front()),
                         "give a path from the world's folder, an absolute one, or add its folder to "
                         "GAZEBO_RESOURCE_PATH");
  }
  // A file that only counts seconds begins at the world's time 0, whatever the date is.
  const GpsTime zero = start.value_or(GpsTime::from_week(2000, 0));
  auto read = simulation::read_trajectory_file(*path, format, zero);
  warnings.insert(warnings.end(), read.warnings.begin(), read.warnings.end());
  const GpsTime begin = start || !read.has_own_dates ? zero : read.trajectory.begin();
  try {
    return VehicleDrive::along_trajectory(read.trajectory, begin, world, loop);
  } catch (const InputError& error) {
    throw elements.error(file, error.problem(), error.cure());
  }
}

VehicleDrive read_waypoint_drive(PluginElements& elements, const std::vector<Eigen::Vector3d>& waypoints,
                                 bool loop) {
  for (const char* other : {"format", "start", "start.week", "start.tow"}) {
    if (const auto element = elements.take(other))
      throw elements.error(*element, "it belongs to a <trajectory>", "remove it: waypoints begin at time 0");
  }
  VehicleDrive::WaypointOptions options;
  options.speed_mps = elements.number("speed_mps", 1e-6, 1e5).value_or(options.speed_mps);
  options.hold_s = elements.number("hold_s", 0, 1e8).value_or(options.hold_s);
  options.loop = loop;
  return VehicleDrive::along_waypoints(waypoints, options);
}

}  // namespace

DriveSettings read_drive_settings(const sdf::ElementPtr& element, const std::string& name,
                                  const std::filesystem::path& folder, const ResourcePaths& resources,
                                  const geodesy::LocalFrame& world) {
  const sdf::ElementPtr rest = element->Clone();
  const auto waypoints = take_waypoints(*rest, name);
  PluginElements elements(rest, name, known_elements());

  std::vector<std::string> warnings = elements.warnings();
  const bool heading = elements.boolean("heading").value_or(true);
  const bool loop = elements.boolean("loop").value_or(false);
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  if (const auto text = elements.text("offset_m")) offset = read_vector(*text, name, "<offset_m>");

  auto file = elements.take("trajectory");
  if (file.has_value() == !waypoints.empty()) {
    throw InputError(fmt::format("{}: there {}", name,
                                 file ? "are a <trajectory> and waypoints" : "is neither a path nor a place"),
                     "give a <trajectory> file, or one <waypoint>x y z</waypoint> or more");
  }
  if (!file) return {read_waypoint_drive(elements, waypoints, loop), heading, offset, std::move(warnings)};
  for (const char* other : {"speed_mps", "hold_s"}) {
    if (const auto wrong = elements.take(other))
      throw elements.error(*wrong, "it belongs to waypoints", "remove it: the file has the times");
  }
  VehicleDrive drive = read_file_drive(elements, *std::move(file), folder, resources, world, loop, warnings);
  return {std::move(drive), heading, offset, std::move(warnings)};
}

}  // namespace canyon::adapters
