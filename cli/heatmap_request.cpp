#include "cli/heatmap_request.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/trajectory.hpp"
#include "canyon/validation/models.hpp"
#include "cli/city_commands.hpp"
#include "cli/progress.hpp"

namespace canyon::cli {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geodesy::GpsTime;

constexpr std::size_t kMostTimes = 100'000;
/// Rays are exact within this distance of a city (RayScene).
constexpr double kFarFromCity_m = 10'000;
/// Bare terrain about a city that is of its map.
constexpr double kRim_m = 150;

template <class T>
void sort_once(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

/// Seconds, or with a unit behind: "90", "90s", "15min", "2h".
double parse_step(std::string_view text) {
  std::string_view number = trim(text);
  double unit_s = 1;
  const auto ends_in = [&](std::string_view unit, double seconds) {
    if (number.size() <= unit.size() || number.substr(number.size() - unit.size()) != unit) return false;
    number.remove_suffix(unit.size());
    unit_s = seconds;
    return true;
  };
  if (!ends_in("min", 60) && !ends_in("h", 3600)) (void)ends_in("s", 1);
  const std::optional<double> value = parse_double(number);
  const double seconds = value.value_or(0) * unit_s;
  if (!value || !(seconds >= 0.001 && seconds <= 1e7)) {
    throw InputError(fmt::format("--times: '{}' is no step", text),
                     "give seconds, or a number with s, min or h behind it, e.g. 15min; from 1 ms up");
  }
  return seconds;
}

GpsTime parse_moment(std::string_view text, std::optional<GpsTime> start) {
  const std::optional<double> seconds = parse_double(text);
  if (!seconds) return geodesy::parse_time(trim(text));
  if (!start) {
    throw InputError(fmt::format("--times {}: the scenario has no start to count from", text),
                     "add start to the scenario, or give instants, e.g. 2026-03-01T10:00:00Z");
  }
  if (!(std::abs(*seconds) <= 1e8)) {
    throw InputError(fmt::format("--times: '{}' is no time", text),
                     "give an instant, or seconds from the start");
  }
  return *start + *seconds;
}

/// from, from + step and so on, as long as they lie before `end` (and at it, where it is `included`).
std::vector<GpsTime> time_range(GpsTime from, GpsTime end, double step_s, bool included) {
  if (end < from) {
    throw InputError(fmt::format("--times ends at {}, before it begins at {}", geodesy::format_utc(end, 0),
                                 geodesy::format_utc(from, 0)),
                     "give START/END/STEP with START first");
  }
  // The last one too where the step falls on it but for rounding.
  const double steps = (end - from) / step_s;
  const double count = included ? std::floor(steps + 1e-6) + 1 : std::max(1.0, std::ceil(steps - 1e-6));
  if (count > static_cast<double>(kMostTimes)) {
    throw InputError(fmt::format("--times: a step of {} s makes {:.0f} times", step_s, count),
                     fmt::format("at most {} are computed in one map: take a longer step", kMostTimes));
  }
  std::vector<GpsTime> times;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    times.push_back(from + step_s * static_cast<double>(i));
  }
  return times;
}

struct EnuBox {
  Vector2d min, max;
};

/// Around the corners and the middles of the sides: meridians converge, and parallels are curved.
EnuBox parse_geodetic_box(const std::string& text, const geodesy::LocalFrame& frame) {
  const std::array<double, 4> box = parse_bbox(text, "--bbox");
  const auto [west, south, east, north] = box;
  if (!(west < east && south < north)) {
    throw InputError(fmt::format("--bbox {} is reversed or empty", text),
                     "give WEST,SOUTH,EAST,NORTH in degrees with west below east and south below north");
  }
  EnuBox result{Vector2d::Constant(1e300), Vector2d::Constant(-1e300)};
  for (const double latitude : {south, 0.5 * (south + north), north}) {
    for (const double longitude : {west, 0.5 * (west + east), east}) {
      const auto place = geodesy::Geodetic::from_degrees(latitude, longitude, frame.origin().height_m);
      geodesy::check_geodetic(place, "--bbox");
      const Vector2d enu = frame.local_from_geodetic(place).head<2>();
      result.min = result.min.cwiseMin(enu);
      result.max = result.max.cwiseMax(enu);
    }
  }
  return result;
}

EnuBox parse_enu_box(const std::string& text) {
  std::vector<double> values;
  for (const std::string_view piece : split(text, ',')) {
    const std::optional<double> value = parse_double(piece);
    if (value) values.push_back(*value);
  }
  if (values.size() != 4 || split(text, ',').size() != 4) {
    throw InputError(fmt::format("--enu-box '{}' is not a box", text),
                     "give WEST,SOUTH,EAST,NORTH in metres of the city's frame, e.g. -200,-100,200,100");
  }
  if (!(values[0] < values[2] && values[1] < values[3])) {
    throw InputError(fmt::format("--enu-box {} is reversed or empty", text),
                     "give WEST,SOUTH,EAST,NORTH in metres with west below east and south below north");
  }
  return {{values[0], values[1]}, {values[2], values[3]}};
}

/// Around everything, but no farther than kRim_m beyond all that is not terrain, which may reach far.
EnuBox whole_city(const city::City& city) {
  const city::Box bounds = city.bounds();
  const EnuBox all{bounds.min.head<2>(), bounds.max.head<2>()};
  EnuBox built{Vector2d::Constant(1e300), Vector2d::Constant(-1e300)};
  for (const city::Object& object : city.mesh.objects) {
    if (object.surface == city::Surface::Terrain) continue;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      for (const std::uint32_t corner : city.mesh.triangles[t]) {
        built.min = built.min.cwiseMin(city.mesh.vertices[corner].head<2>());
        built.max = built.max.cwiseMax(city.mesh.vertices[corner].head<2>());
      }
    }
  }
  if (!(built.min.x() <= built.max.x())) return all;
  return {all.min.cwiseMax(built.min - Vector2d::Constant(kRim_m)),
          all.max.cwiseMin(built.max + Vector2d::Constant(kRim_m))};
}

void check_near_city(const EnuBox& box, const city::City& city, const std::string& option) {
  if (city.mesh.triangles.empty()) return;
  const city::Box bounds = city.bounds();
  const Vector2d low = bounds.min.head<2>(), high = bounds.max.head<2>();
  const std::string cure = fmt::format(
      "the city reaches from east {:.0f} to {:.0f} m and from north {:.0f} to "
      "{:.0f} m about latitude {:.5f}, longitude {:.5f}",
      low.x(), high.x(), low.y(), high.y(), geodesy::degrees(city.frame.origin().latitude_rad),
      geodesy::degrees(city.frame.origin().longitude_rad));
  const double apart = (low - box.max).cwiseMax(box.min - high).maxCoeff();
  if (apart >= 0) {
    throw InputError(
        fmt::format("{} lies outside the city '{}', {:.1f} km away", option, city.name, apart / 1e3), cure);
  }
  const double beyond = (low - box.min).cwiseMax(box.max - high).maxCoeff();
  if (beyond > kFarFromCity_m) {
    throw InputError(
        fmt::format("{} reaches {:.1f} km beyond the city '{}'", option, beyond / 1e3, city.name), cure);
  }
}

std::string bytes_text(double bytes) {
  return short_count(bytes) + (bytes >= 999.5 ? "B" : " B");
}

/// FNV-1a over whole arrays, a chunk at a time.
class Hash {
 public:
  template <class T>
  void add(const T* values, std::size_t count) {
    const char* bytes = reinterpret_cast<const char*>(values);
    std::size_t left = count * sizeof(T);
    constexpr std::size_t kChunk = 1 << 20;
    while (left > 0) {
      const std::size_t size = std::min(left, kChunk);
      std::string chunk(reinterpret_cast<const char*>(&state_), sizeof(state_));
      chunk.append(bytes, size);
      state_ = fnv1a(chunk);
      bytes += size;
      left -= size;
    }
  }
  void add(double value) { add(&value, 1); }
  [[nodiscard]] std::string text() const { return fmt::format("{:016x}", state_); }

 private:
  std::uint64_t state_ = 0;
};

}  // namespace

HeatmapFormats parse_formats(const std::string& text) {
  const std::vector<std::string> known{"netcdf", "geotiff", "png", "all"};
  HeatmapFormats formats;
  for (const std::string_view piece : split(text, ',')) {
    const std::string name = lower_case(trim(piece));
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      const auto meant = closest(name, known);
      throw InputError(fmt::format("--format: '{}' is not known", name),
                       meant ? fmt::format("did you mean '{}'?", *meant)
                             : std::string("give netcdf, geotiff, png or all"));
    }
    formats.netcdf = formats.netcdf || name == "netcdf" || name == "all";
    formats.geotiff = formats.geotiff || name == "geotiff" || name == "all";
    formats.png = formats.png || name == "png" || name == "all";
  }
  return formats;
}

std::vector<heatmap::Layer> parse_layers(const std::string& text) {
  if (text.empty()) return heatmap::default_layers();
  std::vector<heatmap::Layer> layers;
  for (const std::string_view piece : split(text, ',')) {
    if (lower_case(trim(piece)) == "all") {
      for (const heatmap::LayerInfo& each : heatmap::all_layers()) layers.push_back(each.layer);
      continue;
    }
    try {
      layers.push_back(heatmap::layer_by_name(piece));
    } catch (const InputError& error) {
      throw InputError("--layers: " + error.problem(), error.cure());
    }
  }
  // In the order asked for, each once.
  std::vector<heatmap::Layer> once;
  for (const heatmap::Layer layer : layers) {
    if (std::find(once.begin(), once.end(), layer) == once.end()) once.push_back(layer);
  }
  return once;
}

std::vector<double> parse_altitudes(const std::string& text) {
  std::vector<double> altitudes;
  for (const std::string_view piece : split(text, ',')) {
    const std::optional<double> value = parse_double(piece);
    if (!value || std::abs(*value) > 1e5) {
      throw InputError(fmt::format("--altitude '{}' is no list of altitudes", text),
                       "give metres, e.g. 15 or 2,15,30");
    }
    altitudes.push_back(*value);
  }
  sort_once(altitudes);
  return altitudes;
}

heatmap::AltitudeKind parse_altitude_kind(const std::string& text) {
  if (text == "terrain") return heatmap::AltitudeKind::AboveTerrain;
  if (text == "ellipsoid") return heatmap::AltitudeKind::Ellipsoid;
  throw InputError(fmt::format("--altitude-kind '{}' is not known", text), "give terrain or ellipsoid");
}

std::vector<GpsTime> parse_times(const std::string& text, std::optional<GpsTime> start) {
  if (text.empty()) return {parse_moment("0", start)};
  const std::vector<std::string_view> parts = split(text, '/');
  if (parts.size() == 1) {
    std::vector<GpsTime> times;
    for (const std::string_view piece : split(text, ',')) times.push_back(parse_moment(piece, start));
    sort_once(times);
    if (times.size() > kMostTimes) {
      throw InputError(fmt::format("--times: {} times are too many", times.size()),
                       fmt::format("at most {} are computed in one map", kMostTimes));
    }
    return times;
  }
  if (parts.size() == 2 && lower_case(trim(parts[0])) == "day") {
    const GpsTime from = parse_moment("0", start);
    return time_range(from, from + kSiderealDay_s, parse_step(parts[1]), false);
  }
  if (parts.size() != 3) {
    throw InputError(fmt::format("--times '{}' is not understood", text),
                     "give T,T,..., START/END/STEP or day/STEP, e.g. day/15min");
  }
  return time_range(parse_moment(parts[0], start), parse_moment(parts[1], start), parse_step(parts[2]), true);
}

std::optional<GpsTime> scenario_start(const simulation::Scenario& scenario) {
  if (scenario.start) return scenario.start;
  if (!scenario.trajectory.file) return std::nullopt;
  return simulation::read_trajectory(*scenario.trajectory.file, scenario.trajectory.format, GpsTime{})
      .begin();
}

simulation::ReceiverConfig choose_receiver(const simulation::Scenario& scenario, const std::string& name,
                                           const std::string& model) {
  const auto& all = scenario.receivers;
  auto chosen = all.begin();
  if (!name.empty()) {
    std::vector<std::string> names;
    for (const simulation::ReceiverConfig& each : all) names.push_back(each.options.name);
    chosen =
        std::find_if(all.begin(), all.end(), [&](const auto& each) { return each.options.name == name; });
    if (chosen == all.end()) {
      throw InputError(fmt::format("--receiver: the scenario has no receiver '{}'", name),
                       fmt::format("it has {}", fmt::join(names, ", ")));
    }
  }
  if (model.empty()) return *chosen;
  try {
    return validation::models_of(*chosen, {model}).front().receiver;
  } catch (const InputError& error) {
    throw InputError("--model: " + error.problem(), error.cure());
  }
}

void choose_area(const HeatmapArguments& arguments, const city::City& city, heatmap::Request& request) {
  EnuBox box;
  std::string option;
  if (!arguments.area.empty()) {
    request.area = heatmap::read_area(arguments.area, city.frame);
    request.area->validate();
    const auto [min, max] = request.area->bounds();
    box = {min, max};
    option = "--area " + arguments.area;
  } else if (!arguments.bbox.empty()) {
    box = parse_geodetic_box(arguments.bbox, city.frame);
    option = "--bbox";
  } else if (!arguments.enu_box.empty()) {
    box = parse_enu_box(arguments.enu_box);
    option = "--enu-box";
  } else if (!city.mesh.triangles.empty()) {
    box = whole_city(city);
  } else {
    throw InputError(fmt::format("the city '{}' is an open field without bounds", city.name),
                     "give --bbox, --enu-box or --area");
  }
  if (!option.empty()) check_near_city(box, city, option);
  request.grid =
      heatmap::Grid::covering(box.min.x(), box.min.y(), box.max.x(), box.max.y(), arguments.spacing_m);
  if (arguments.tile) {
    const int size = *arguments.tile;
    if (size < 1 || size > 4096 || (size > 16 && size * arguments.spacing_m > heatmap::kWidestTile_m)) {
      throw InputError(
          fmt::format("--tile {}: tiles of {} cells of {} m are out of range", size, size,
                      arguments.spacing_m),
          fmt::format(
              "give 1 to 4096 cells; above 16, at most {:.0f} m: a tile's cells share the satellites' "
              "directions",
              heatmap::kWidestTile_m));
    }
    request.grid.tile_size = static_cast<std::uint32_t>(size);
  }
}

void check_size(const HeatmapArguments& arguments, const heatmap::Request& request) {
  const double values =
      static_cast<double>(request.grid.cells()) *
      static_cast<double>(request.altitudes_m.size() * request.times.size() * request.layers.size());
  const std::string what =
      fmt::format("{} x {} cells, {} altitude(s), {} time(s) and {} layer(s) are {} values",
                  request.grid.columns, request.grid.rows, request.altitudes_m.size(), request.times.size(),
                  request.layers.size(), short_count(values));
  const char* cure =
      "take a larger --spacing, a smaller box or fewer times; --large computes it all the same";
  if (arguments.large) return;
  if (values > kMostValues) throw InputError(what, cure);
  // Finished tiles of an earlier run are part of what is needed.
  namespace fs = std::filesystem;
  std::error_code ignored;
  double there = 0;
  for (fs::directory_iterator file(fs::path(arguments.out) / "tiles", ignored), end; file != end;
       file.increment(ignored)) {
    const auto size = file->file_size(ignored);
    if (!ignored) there += static_cast<double>(size);
  }
  const fs::space_info space = fs::space(arguments.out, ignored);
  const double needed = values * sizeof(float);
  if (!ignored && static_cast<double>(space.available) + there < needed) {
    throw InputError(fmt::format("{}: their tiles take {}, and {} has {} left", what, bytes_text(needed),
                                 arguments.out, bytes_text(static_cast<double>(space.available))),
                     cure);
  }
}

void check_altitudes(const heatmap::Request& request, const city::City& city) {
  for (const double altitude : request.altitudes_m) {
    if (request.altitude_kind == heatmap::AltitudeKind::AboveTerrain) {
      if (altitude < 0) {
        throw InputError(fmt::format("--altitude {} lies below the terrain", altitude),
                         "give metres above it, or --altitude-kind ellipsoid");
      }
      continue;
    }
    if (city.mesh.triangles.empty()) continue;
    const double lowest = city.frame.origin().height_m + city.bounds().min.z();
    if (altitude < lowest) {
      throw InputError(fmt::format("--altitude {} lies below the whole city", altitude),
                       fmt::format("its lowest point is {:.1f} m above the ellipsoid", lowest));
    }
  }
}

std::string command_of(const HeatmapArguments& arguments, const heatmap::Request& request) {
  std::string text = "canyon heatmap " + std::filesystem::path(arguments.scenario).filename().string();
  const auto add = [&text](const char* option, const std::string& value) {
    if (!value.empty()) text += fmt::format(" {} {}", option, value);
  };
  add("--bbox", arguments.bbox);
  add("--enu-box", arguments.enu_box);
  if (!arguments.area.empty()) add("--area", std::filesystem::path(arguments.area).filename().string());
  add("--spacing", fmt::format("{:g}", arguments.spacing_m));
  add("--altitude", arguments.altitudes);
  add("--altitude-kind", arguments.altitude_kind);
  add("--times", arguments.times);
  std::string layers;
  for (const heatmap::Layer layer : request.layers) {
    layers += fmt::format("{}{}", layers.empty() ? "" : ",", heatmap::info(layer).name);
  }
  add("--layers", layers);
  add("--model", arguments.model);
  add("--receiver", arguments.receiver);
  if (std::any_of(request.layers.begin(), request.layers.end(),
                  [](heatmap::Layer layer) { return heatmap::info(layer).draws; })) {
    add("--draws", std::to_string(request.draws.draws));
  }
  add("--seed", std::to_string(request.draws.seed));
  if (arguments.tile) add("--tile", std::to_string(*arguments.tile));
  return text;
}

std::string input_key(const simulation::Environment& environment, const std::vector<GpsTime>& times) {
  Hash city;
  const city::City& c = environment.city();
  const Vector3d origin = c.frame.ecef_from_local(Vector3d::Zero());
  city.add(origin.data(), 3);
  city.add(c.frame.heading_rad());
  for (const Vector3d& vertex : c.mesh.vertices) city.add(vertex.data(), 3);
  city.add(c.mesh.triangles.data(), c.mesh.triangles.size());
  city.add(c.mesh.materials.data(), c.mesh.materials.size());
  for (const city::Object& object : c.mesh.objects) {
    const std::array<std::uint32_t, 3> numbers{static_cast<std::uint32_t>(object.surface),
                                               object.first_triangle, object.triangle_count};
    city.add(numbers.data(), numbers.size());
  }
  Hash sky;
  for (const auto& [system, klobuchar] : environment.klobuchar()) {
    sky.add(static_cast<double>(system));
    sky.add(klobuchar.alpha.data(), klobuchar.alpha.size());
    sky.add(klobuchar.beta.data(), klobuchar.beta.size());
  }
  for (const GpsTime time : times) {
    for (const gnss::SatelliteId id : environment.sky().satellites()) {
      const auto state = environment.sky().state(id, time);
      if (!state) continue;
      const std::string name = gnss::to_string(id);
      sky.add(name.data(), name.size());
      sky.add(state->position_m.data(), 3);
      sky.add(state->velocity_mps.data(), 3);
      sky.add(state->clock_bias_s);
      sky.add(state->clock_drift);
      sky.add(state->group_delay_s);
      sky.add(state->carrier_frequency_hz);
    }
  }
  return fmt::format("city {} sky {}", city.text(), sky.text());
}

}  // namespace canyon::cli
