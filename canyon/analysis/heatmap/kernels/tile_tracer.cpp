#include "canyon/analysis/heatmap/kernels/tile_tracer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "canyon/analysis/heatmap/kernels/tile_interior.hpp"
#include "canyon/analysis/heatmap/kernels/tile_tasks.hpp"
#include "canyon/analysis/heatmap/kernels/tile_terrain.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;
using propagation::Visibility;
using raytrace::Containment;
using raytrace::Ray;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Height differences within a tile below this are ignored [m].
constexpr double kFlat_m = 1e-3;
/// ShadowCaster needs directions with a larger vertical component.
constexpr double kMinCastRise = 0.01;

CellState state_of(Containment containment) {
  switch (containment) {
    case Containment::Free:
      return CellState::Computed;
    case Containment::InsideBuilding:
      return CellState::InsideBuilding;
    case Containment::UnderTerrain:
      return CellState::UnderTerrain;
    case Containment::Unknown:
      break;
  }
  assert(false);
  return CellState::Computed;
}

/// Kinds of surfaces in a mesh that affect the method.
struct Surfaces {
  bool foliage = false, vehicles = false;

  explicit Surfaces(const city::Mesh& mesh) {
    for (const city::Object& object : mesh.objects) {
      foliage |= object.surface == city::Surface::Foliage;
      vehicles |= object.surface == city::Surface::Vehicle;
    }
  }
};

/// Batches of rays, one for each thread.
struct RayBatch {
  std::vector<Ray> rays;
  std::vector<std::uint32_t> cells;
  std::unique_ptr<bool[]> blocked;
  std::size_t size = 0;

  void clear() {
    rays.clear();
    cells.clear();
  }
  void add(std::uint32_t cell, const Vector3d& from, const Vector3d& direction) {
    rays.push_back({from, direction});
    cells.push_back(cell);
  }
  /// Sets out[cell] = 1 for blocked cells, else 0.
  void cast(const raytrace::RayScene& scene, double min_range_m, std::span<std::uint8_t> out) {
    if (rays.empty()) return;
    if (size < rays.size()) {
      size = rays.size();
      blocked = std::make_unique<bool[]>(size);
    }
    const std::span<bool> result(blocked.get(), rays.size());
    scene.occluded(rays, result, min_range_m);
    for (std::size_t i = 0; i < rays.size(); ++i) out[cells[i]] = result[i] ? 1 : 0;
  }
};

}  // namespace

Vector3d TileCells::centre(std::size_t cell) const {
  assert(cell < tile.cells());
  return {plane.first.x() + static_cast<double>(cell % tile.columns) * plane.spacing_m,
          plane.first.y() + static_cast<double>(cell / tile.columns) * plane.spacing_m,
          flat() ? plane.z : static_cast<double>(z[cell])};
}

struct TileTracer::Impl {
  const simulation::Environment* environment;
  const raytrace::RayScene* scene;
  propagation::PropagationOptions options;
  double mask_rad;
  propagation::Propagator propagator;
  ShadowCaster shadows;
  TerrainHeights terrain;
  Interiors interiors;
  Surfaces surfaces;
  std::vector<gnss::SatelliteId> ids;

  FirstSignal first_signal;

  Impl(const simulation::Environment& e, const propagation::PropagationOptions& o, double mask,
       FirstSignal first)
      : environment(&e),
        scene(&e.scene()),
        options(o),
        mask_rad(mask),
        propagator(e.make_propagator(o)),
        shadows(e.city().mesh),
        terrain(e.city().mesh),
        interiors(e.city().mesh),
        surfaces(e.city().mesh),
        ids(e.sky().satellites()),
        first_signal(std::move(first)) {}

  [[nodiscard]] bool specular() const { return options.model == propagation::Model::Specular; }

  /// Heights of the cells' points, and of the terrain below them (NaN: none); the latter is empty if no point
  /// can be under the terrain.
  void set_heights(const Grid& grid, double altitude_m, AltitudeKind kind, TileCells& cells,
                   std::vector<double>& ground) const {
    const std::size_t count = cells.tile.cells();
    if (!terrain.empty()) {
      ground.resize(count);
      terrain.heights(grid, cells.tile, ground);
    }
    std::vector<double> z(count, altitude_m);
    if (kind == AltitudeKind::Ellipsoid) {
      const geodesy::LocalFrame& frame = environment->city().frame;
      for (std::size_t i = 0; i < count; ++i) {
        // The ray follows the city's vertical: less than 1e-2 rad from the point's own within 60 km.
        Vector3d point = cells.centre(i);
        point.z() = 0;
        for (int step = 0; step < 3; ++step)
          point.z() += altitude_m - frame.geodetic_from_local(point).height_m;
        z[i] = point.z();
      }
    } else if (!terrain.empty()) {
      for (std::size_t i = 0; i < count; ++i) {
        z[i] = ground[i] + altitude_m;
        if (std::isnan(z[i]) && cells.state[i] == CellState::Computed) cells.state[i] = CellState::NoTerrain;
      }
      if (altitude_m > raytrace::kSkin_m) ground.clear();
    }

    double low = kInfinite, high = -kInfinite;
    for (std::size_t i = 0; i < count; ++i) {
      if (cells.state[i] != CellState::Computed) continue;
      low = std::min(low, z[i]);
      high = std::max(high, z[i]);
    }
    if (low > high) return;
    cells.plane.z = low == high ? low : (low + high) / 2;
    if (high - low > kFlat_m) cells.z.assign(z.begin(), z.end());
  }

  /// Marks points inside buildings or under terrain. Only points with something above them are candidates.
  void mark_hidden_points(const std::vector<double>& ground, TileCells& cells) const {
    const std::size_t count = cells.tile.cells();
    std::vector<std::uint8_t> covered(count), inside(count);
    block(cells, Vector3d::UnitZ(), covered);
    std::vector<std::uint8_t> request(count);
    for (std::size_t i = 0; i < count; ++i) {
      covered[i] &= cells.state[i] == CellState::Computed ? 1 : 0;
      // A sheet above the point may or may not cover it.
      request[i] = covered[i] && !ground.empty() && !(ground[i] < cells.centre(i).z());
    }
    if (cells.flat() && interiors.find(cells.plane, covered, inside)) {
      // Foliage or a vehicle above is not a roof; closed walls have a roof, others may lack it.
      const bool roof_above = !(surfaces.foliage || surfaces.vehicles) && ground.empty();
      const bool certain = roof_above || interiors.open_ends(cells.plane.z) == 0;
      for (std::size_t i = 0; i < count; ++i) {
        if (request[i]) continue;
        if (inside[i] && !certain)
          request[i] = 1;
        else if (inside[i])
          cells.state[i] = CellState::InsideBuilding;
      }
    } else {
      request = covered;
    }
    spread(cells.tile.rows, [&](std::size_t row) {
      for (std::size_t i = row * cells.tile.columns; i < (row + 1) * cells.tile.columns; ++i)
        if (request[i]) cells.state[i] = state_of(scene->containment(cells.centre(i)));
    });
  }

  /// blocked[i] = 1 if there is an obstacle from Computed cell i towards `direction`, else 0.
  void block(const TileCells& cells, const Vector3d& direction, std::span<std::uint8_t> blocked) const {
    if (cells.flat() && direction.z() > kMinCastRise) {
      shadows.shadows(cells.plane, direction, blocked);
      for (const std::uint32_t i : cells.on_walls) {
        const Vector3d from = cells.centre(i);
        blocked[i] = scene->occluded({from, direction}, scene->surface_offset_m(from)) ? 1 : 0;
      }
      return;
    }
    std::fill(blocked.begin(), blocked.end(), std::uint8_t{0});
    spread(cells.tile.rows, [&](std::size_t row) {
      static thread_local RayBatch batch;
      batch.clear();
      for (std::size_t i = row * cells.tile.columns; i < (row + 1) * cells.tile.columns; ++i) {
        if (cells.state[i] != CellState::Computed) continue;
        batch.add(static_cast<std::uint32_t>(i), cells.centre(i), direction);
      }
      if (batch.rays.empty()) return;
      batch.cast(*scene, scene->surface_offset_m(batch.rays.front().origin), blocked);
    });
  }

  void see_satellites(const TileCells& cells, geodesy::GpsTime time, TileSignals& result) const {
    const geodesy::LocalFrame& frame = environment->city().frame;
    const double half = cells.plane.spacing_m / 2;
    const Vector3d middle(cells.plane.first.x() + half * (cells.tile.columns - 1),
                          cells.plane.first.y() + half * (cells.tile.rows - 1), cells.plane.z);
    const orbit::Observer observer(frame.ecef_from_local(middle));
    result.satellites.clear();
    result.directions.clear();
    for (const gnss::SatelliteId id : ids) {
      auto line = orbit::line_of_sight(environment->sky(), id, time, observer);
      if (!line || !(line->elevation_rad > 0) || line->elevation_rad < mask_rad) continue;
      if (first_signal) {
        const gnss::Signal* signal = first_signal(id, time);
        if (signal == nullptr) continue;
        // The state already has the carrier of the signal near L1, with GLONASS's channels.
        if (signal != &gnss::signals_of(id.system).front())
          line->state.carrier_frequency_hz = signal->carrier_hz;
      }
      result.satellites.push_back(*line);
      result.directions.emplace_back(frame.ecef_from_local_rotation().transpose() * line->direction_ecef);
    }
  }

  /// Algorithm 2 of the paper for the blocked cells of one satellite, as Propagator::trace().
  void add_mirrored(const TileCells& cells, std::size_t satellite, TileSignals& result) const {
    const Vector3d& direction = result.directions[satellite];
    const Vector3d mirrored = propagation::mirror_direction(direction);
    const double elevation_rad = std::asin(std::clamp(direction.z(), -1.0, 1.0));
    std::vector<CellVisibility>& visibility = result.visibility[satellite];
    std::vector<float>& excess_m = result.excess_m[satellite];
    const auto receive = [&](std::size_t cell, double range_m) {
      visibility[cell] = CellVisibility::NLOS;
      // Negative only by rounding, at the zenith.
      excess_m[cell] =
          static_cast<float>(std::max(0.0, propagation::mirror_excess_m(range_m, elevation_rad)));
    };
    const auto is_wanted = [&](std::size_t cell) {
      return cells.state[cell] == CellState::Computed && visibility[cell] == CellVisibility::Blocked;
    };
    const auto range_by_ray = [&](std::size_t cell) -> std::optional<double> {
      const Vector3d from = cells.centre(cell);
      const auto hit = scene->cast({from, mirrored, options.max_range_m}, scene->surface_offset_m(from));
      if (!hit) return std::nullopt;
      return hit->range_m;
    };
    if (cells.flat() && mirrored.z() > kMinCastRise) {
      static thread_local std::vector<float> ranges;
      ranges.resize(cells.tile.cells());
      shadows.ranges(cells.plane, mirrored, options.max_range_m, ranges);
      for (const std::uint32_t i : cells.on_walls)
        ranges[i] = static_cast<float>(range_by_ray(i).value_or(kInfinite));
      for (std::size_t i = 0; i < ranges.size(); ++i)
        if (is_wanted(i) && std::isfinite(ranges[i])) receive(i, static_cast<double>(ranges[i]));
      return;
    }
    spread(cells.tile.rows, [&](std::size_t row) {
      for (std::size_t i = row * cells.tile.columns; i < (row + 1) * cells.tile.columns; ++i) {
        if (!is_wanted(i)) continue;
        if (const auto range_m = range_by_ray(i)) receive(i, *range_m);
      }
    });
  }

  /// Propagator::trace() for cells blocked so far, or for `all`.
  void add_traced(const TileCells& cells, bool all, bool excess, TileSignals& result) const {
    struct Lists {
      std::vector<std::uint32_t> satellites;
      std::vector<Vector3d> directions;
      std::vector<propagation::SatellitePaths> paths;  // never shrinks, to reuse the memory of the lists
    };
    spread(cells.tile.rows, [&](std::size_t row) {
      static thread_local Lists lists;
      for (std::size_t i = row * cells.tile.columns; i < (row + 1) * cells.tile.columns; ++i) {
        if (cells.state[i] != CellState::Computed) continue;
        lists.satellites.clear();
        lists.directions.clear();
        for (std::size_t k = 0; k < result.satellites.size(); ++k) {
          if (!all && result.visibility[k][i] != CellVisibility::Blocked) continue;
          lists.satellites.push_back(static_cast<std::uint32_t>(k));
          lists.directions.push_back(result.directions[k]);
        }
        const std::size_t count = lists.satellites.size();
        if (count == 0) continue;
        if (lists.paths.size() < count) lists.paths.resize(count);
        propagator.trace(cells.centre(i), lists.directions, std::span(lists.paths).first(count));
        for (std::size_t j = 0; j < count; ++j) {
          const propagation::SatellitePaths& paths = lists.paths[j];
          const std::uint32_t k = lists.satellites[j];
          const bool los =
              paths.visibility == Visibility::LOS || paths.visibility == Visibility::LOSMultipath;
          if (!los && !excess) continue;
          result.visibility[k][i] = los                ? CellVisibility::LOS
                                    : paths.received() ? CellVisibility::NLOS
                                                       : CellVisibility::Blocked;
          if (excess) result.excess_m[k][i] = static_cast<float>(paths.tracked_excess_m());
        }
      }
    });
  }
};

TileTracer::TileTracer(const simulation::Environment& environment,
                       const propagation::PropagationOptions& options, double elevation_mask_rad,
                       FirstSignal first_signal) {
  if (!(elevation_mask_rad >= 0 && elevation_mask_rad < geodesy::kPi / 2)) {
    throw InputError(fmt::format("an elevation mask of {} rad is out of range", elevation_mask_rad),
                     "give 0 to less than pi/2");
  }
  impl_ = std::make_unique<Impl>(environment, options, elevation_mask_rad, std::move(first_signal));
  assert(environment.scene().posed_instances().empty());
}
TileTracer::~TileTracer() = default;
TileTracer::TileTracer(TileTracer&&) noexcept = default;

const propagation::Propagator& TileTracer::propagator() const {
  return impl_->propagator;
}

TileCells TileTracer::cells(const Grid& grid, const Tile& tile, const Area* area, double altitude_m,
                            AltitudeKind kind) const {
  if (!std::isfinite(altitude_m))
    throw InputError(fmt::format("an altitude of {} m is not finite", altitude_m), "give metres");
  TileCells cells;
  cells.tile = tile;
  cells.plane.first = grid.centre(tile.first_column, tile.first_row);
  cells.plane.spacing_m = grid.spacing_m;
  cells.plane.columns = tile.columns;
  cells.plane.rows = tile.rows;
  cells.state.assign(tile.cells(), CellState::Computed);
  if (area != nullptr) {
    const std::vector<std::uint8_t> mask = area->mask(grid, tile);
    for (std::size_t i = 0; i < mask.size(); ++i)
      if (!mask[i]) cells.state[i] = CellState::OutsideArea;
    if (std::find(mask.begin(), mask.end(), 1) == mask.end()) return cells;
  }
  std::vector<double> ground;
  impl_->set_heights(grid, altitude_m, kind, cells, ground);
  impl_->mark_hidden_points(ground, cells);
  if (cells.flat()) {
    // The offset grows with the distance from the city's centre: the maximum is at a corner.
    double offset_m = 0;
    for (const std::size_t corner :
         {std::size_t{0}, std::size_t{tile.columns} - 1, tile.cells() - tile.columns, tile.cells() - 1})
      offset_m = std::max(offset_m, impl_->scene->surface_offset_m(cells.centre(corner)));
    for (const std::uint32_t cell : impl_->interiors.on_surfaces(cells.plane, offset_m))
      if (cells.state[cell] == CellState::Computed) cells.on_walls.push_back(cell);
  }
  return cells;
}

void TileTracer::trace(const TileCells& cells, geodesy::GpsTime time, bool excess,
                       TileSignals& result) const {
  const Impl& impl = *impl_;
  const std::size_t count = cells.tile.cells();
  assert(cells.state.size() == count);
  impl.see_satellites(cells, time, result);
  const std::size_t satellites = result.satellites.size();
  result.visibility.resize(satellites);
  result.excess_m.resize(excess ? satellites : 0);
  for (std::vector<CellVisibility>& visibility : result.visibility)
    visibility.assign(count, CellVisibility::Blocked);
  for (std::vector<float>& excess_m : result.excess_m) excess_m.assign(count, 0);
  if (std::find(cells.state.begin(), cells.state.end(), CellState::Computed) == cells.state.end()) return;

  // Only Propagator handles partly transparent foliage.
  if (impl.specular() && impl.options.through_foliage && impl.surfaces.foliage) {
    impl.add_traced(cells, true, excess, result);
    return;
  }
  spread(satellites, [&](std::size_t k) {
    std::vector<std::uint8_t> blocked(count);
    impl.block(cells, result.directions[k], blocked);
    for (std::size_t i = 0; i < count; ++i)
      if (!blocked[i] && cells.state[i] == CellState::Computed) result.visibility[k][i] = CellVisibility::LOS;
    if (excess && !impl.specular()) impl.add_mirrored(cells, k, result);
  });
  if (excess && impl.specular() &&
      (impl.options.reflection_order != 0 || impl.options.diffraction || impl.options.diffuse))
    impl.add_traced(cells, false, excess, result);
}

void TileTracer::sky_view(const TileCells& cells, std::span<float> result, int rings, int sectors) const {
  assert(result.size() == cells.tile.cells());
  if (rings < 1 || rings > 1000 || sectors < 1 || sectors > 1000) {
    throw InputError(fmt::format("{} rings of {} sectors of the sky are out of range", rings, sectors),
                     "give 1 to 1000 of each");
  }
  std::vector<std::vector<std::uint16_t>> blocked(static_cast<std::size_t>(rings));
  spread(blocked.size(), [&](std::size_t ring) {
    std::vector<std::uint8_t> one(cells.tile.cells());
    blocked[ring].assign(cells.tile.cells(), 0);
    // Rings of equal height have equal solid angles (Archimedes).
    const double up = (static_cast<double>(ring) + 0.5) / rings;
    for (int sector = 0; sector < sectors; ++sector) {
      const double azimuth = 2 * geodesy::kPi * (sector + (ring % 2 == 0 ? 0.25 : 0.75)) / sectors;
      const double level = std::sqrt(1 - up * up);
      impl_->block(cells, {level * std::sin(azimuth), level * std::cos(azimuth), up}, one);
      for (std::size_t i = 0; i < one.size(); ++i) blocked[ring][i] += one[i];
    }
  });
  const auto directions = static_cast<double>(rings) * sectors;
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (cells.state[i] != CellState::Computed) {
      result[i] = kNan;
      continue;
    }
    int sum = 0;
    for (const auto& ring : blocked) sum += ring[i];
    result[i] = static_cast<float>(1 - sum / directions);
  }
}

}  // namespace canyon::heatmap
