#include "canyon/analysis/heatmap/engine/map_source.hpp"

#include <fmt/format.h>
#include <cassert>
#include <cmath>
#include <memory>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/georeference.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::heatmap {

MapSource::Slices store_slices(const Heatmap& heatmap, const TileStore& store) {
  struct StoredTile {
    std::size_t unit = 0;
    std::optional<TileValues> values;
  };
  const auto last = std::make_shared<StoredTile>();
  return [&heatmap, &store, last](std::size_t tile, std::size_t time) -> std::optional<MapSource::Slice> {
    const std::size_t i = heatmap.unit_of(tile, time);
    if (!last->values || last->unit != i) *last = {i, store.load(i)};
    if (!last->values) return std::nullopt;
    // [layer][time][altitude][cell] -> [layer][altitude][cell] of one time.
    const Heatmap::Unit unit = heatmap.unit(i);
    const Request& request = heatmap.request();
    const std::size_t plane = request.altitudes_m.size() * unit.tile.cells();
    assert(last->values->values.size() == request.layers.size() * unit.times * plane);
    MapSource::Slice slice;
    slice.state = last->values->state;
    slice.values.reserve(request.layers.size() * plane);
    for (std::size_t layer = 0; layer < request.layers.size(); ++layer) {
      const float* first =
          last->values->values.data() + (layer * unit.times + time - unit.first_time) * plane;
      slice.values.insert(slice.values.end(), first, first + plane);
    }
    return slice;
  };
}

MapSource::Slices slices_over_runs(std::vector<MapSource::Slices> runs, std::vector<Layer> layers,
                                   OverRuns what) {
  assert(!runs.empty());
  return [runs = std::move(runs), layers = std::move(layers), what](
             std::size_t tile, std::size_t time) -> std::optional<MapSource::Slice> {
    std::vector<MapSource::Slice> slices;
    for (const auto& run : runs) {
      std::optional<MapSource::Slice> slice = run(tile, time);
      if (!slice) return std::nullopt;
      slices.push_back(std::move(*slice));
    }
    MapSource::Slice result = slices.front();
    for (std::size_t i = 0; i < result.state.size(); ++i) {
      for (const MapSource::Slice& slice : slices)
        if (slice.state[i] == CellState::Computed) result.state[i] = CellState::Computed;
    }
    std::vector<double> values;
    const std::size_t plane = result.values.size() / layers.size();
    for (std::size_t i = 0; i < result.values.size(); ++i) {
      values.clear();
      for (const MapSource::Slice& slice : slices)
        if (!std::isnan(slice.values[i])) values.push_back(static_cast<double>(slice.values[i]));
      if (values.empty()) continue;
      double value = 0;
      if (what)
        value = predictive_quantile(values, more_is_better(layers[i / plane]) ? 1 - *what : *what);
      else
        for (const double each : values) value += each / static_cast<double>(values.size());
      result.values[i] = static_cast<float>(value);
    }
    return result;
  };
}

MapSource map_source(const Heatmap& heatmap, const TileStore& store,
                     const simulation::Environment& environment, const simulation::ReceiverConfig& receiver,
                     const simulation::Scenario& scenario) {
  MapSource source;
  source.request = &heatmap.request();
  source.frame = environment.city().frame;
  const std::string motion = simulation::describe(heatmap.request().motion);
  source.title = fmt::format("GNSS heat map of {}, receiver {}", environment.city().name, motion);
  source.attributes["motion"] = motion;
  const propagation::PropagationOptions& paths = receiver.propagation;
  source.attributes["receiver"] = receiver.options.name;
  source.attributes["propagation_model"] =
      paths.model == propagation::Model::Mirror
          ? "mirror"
          : fmt::format("specular, order {}{}{}", paths.reflection_order,
                        paths.diffraction ? ", diffraction" : "", paths.diffuse ? ", diffuse" : "");
  std::string systems;
  for (const gnss::SatelliteId id : environment.sky().satellites()) {
    const std::string name(gnss::name(id.system));
    if (systems.ends_with(name)) continue;  // satellites are in the order of their systems
    systems += (systems.empty() ? "" : ", ") + name;
  }
  source.attributes["systems"] = systems;
  if (receiver.options.signal.enabled) {
    source.attributes["propagation_model"] +=
        receiver.options.signal.shadowing.enabled ? ", strength, shadowing" : ", strength";
  }
  if (environment.errors() == nullptr) source.attributes["space_errors"] = "none";
  if (receiver.streets.enabled) source.attributes["propagation_model"] += ", streets";
  if (const auto shift = simulation::draw_city_shift(scenario.city.georeference, scenario.seed))
    source.attributes["georeference"] = simulation::describe(*shift);
  source.attributes["seed"] = std::to_string(heatmap.request().samples.seed);
  source.slice = store_slices(heatmap, store);
  return source;
}

double projection_scale(const geodesy::LocalFrame& frame) {
  constexpr double kEccentricitySquared = geodesy::kFlattening * (2 - geodesy::kFlattening);
  const double sine = std::sin(frame.origin().latitude_rad);
  const double radius = geodesy::kSemiMajorAxis * std::sqrt(1 - kEccentricitySquared) /
                        (1 - kEccentricitySquared * sine * sine);
  return 1 + frame.origin().height_m / radius;
}

std::string projection(const geodesy::LocalFrame& frame) {
  const std::string origin = fmt::format("{:.12f}", geodesy::degrees(frame.origin().latitude_rad));
  const std::string meridian = fmt::format("{:.12f}", geodesy::degrees(frame.origin().longitude_rad));
  const std::string tail =
      fmt::format("+k={:.12f} +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs", projection_scale(frame));
  const double heading_deg = std::remainder(geodesy::degrees(frame.heading_rad()), 360.0);
  if (heading_deg == 0) return fmt::format("+proj=tmerc +lat_0={} +lon_0={} {}", origin, meridian, tail);
  // The rectified grid's y axis points to azimuth alpha - gamma (EPSG Guidance Note 7-2, 3.2.4), the city's
  // to minus its heading. PROJ cannot compute alpha = 0; any other line through the origin is equivalent.
  constexpr double kAlphaDeg = 45;
  return fmt::format("+proj=omerc +lat_0={} +lonc={} +alpha={} +gamma={:.12f} {}", origin, meridian,
                     kAlphaDeg, std::remainder(kAlphaDeg + heading_deg, 360.0), tail);
}

}  // namespace canyon::heatmap
