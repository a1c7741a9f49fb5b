#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "canyon/analysis/heatmap/cells/shared_cells.hpp"
#include "canyon/analysis/heatmap/kernels/tile_tracer.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/range_errors.hpp"
#include "tests/support/circular_sky.hpp"

namespace canyon::test {

/// Cells of a tile and their random arrivals; and the fix of a receiver at a cell, from independently
/// computed measurements.
struct TileScene {
  CircularSky sky;
  geodesy::LocalFrame frame;
  geodesy::GpsTime time = CircularSky::kEpoch + std::chrono::hours(5);
  std::map<gnss::System, gnss::Klobuchar> klobuchar;
  heatmap::TileCells cells;
  heatmap::TileSignals signals;

  TileScene(const std::vector<gnss::System>& systems, const geodesy::Geodetic& origin, double heading_rad = 0)
      : sky(systems), frame(origin, heading_rad) {}

  /// @param z of all cells; uneven: up to that much above it
  void lay(const Eigen::Vector2d& first, double spacing_m, std::uint32_t columns, std::uint32_t rows,
           double z, double uneven_m = 0) {
    cells.tile = {0, 0, columns, rows};
    cells.plane = {first, spacing_m, columns, rows, z};
    cells.state.assign(cells.tile.cells(), heatmap::CellState::Computed);
    cells.z.clear();
    for (std::size_t i = 0; uneven_m > 0 && i < cells.tile.cells(); ++i) {
      cells.z.push_back(
          static_cast<float>(z + uneven_m * (0.5 + 0.5 * std::sin(1.7 * static_cast<double>(i)))));
    }
  }
  [[nodiscard]] Eigen::Vector3d centre(std::size_t cell) const {
    const heatmap::CellPlane& p = cells.plane;
    return {p.first.x() + static_cast<double>(cell % p.columns) * p.spacing_m,
            p.first.y() + static_cast<double>(cell / p.columns) * p.spacing_m,
            cells.z.empty() ? p.z : static_cast<double>(cells.z[cell])};
  }
  /// Satellites above the mask at the tile's centre, nothing received.
  void compute_sky(double mask_rad) {
    const heatmap::CellPlane& p = cells.plane;
    const Eigen::Vector3d centre(p.first.x() + 0.5 * (p.columns - 1) * p.spacing_m,
                                 p.first.y() + 0.5 * (p.rows - 1) * p.spacing_m, p.z);
    signals = {};
    for (const gnss::SatelliteId id : sky.satellites()) {
      const auto line = orbit::line_of_sight(sky, id, time, frame.ecef_from_local(centre));
      if (!line || line->elevation_rad < mask_rad) continue;
      signals.satellites.push_back(*line);
      signals.directions.push_back(frame.ecef_from_local_rotation().transpose() * line->direction_ecef);
    }
    signals.visibility.assign(
        signals.satellites.size(),
        std::vector<heatmap::CellVisibility>(cells.tile.cells(), heatmap::CellVisibility::Blocked));
    signals.excess_m.assign(signals.satellites.size(), std::vector<float>(cells.tile.cells(), 0));
  }
  /// Fractions in line of sight, and with only a reflection (excess up to max_m).
  void receive(double los, double nlos, double max_m, std::uint64_t seed) {
    RandomStream random(seed, "signals");
    for (std::size_t k = 0; k < signals.satellites.size(); ++k) {
      for (std::size_t i = 0; i < cells.tile.cells(); ++i) {
        const double x = random.uniform();
        signals.visibility[k][i] = x < los          ? heatmap::CellVisibility::LOS
                                   : x < los + nlos ? heatmap::CellVisibility::NLOS
                                                    : heatmap::CellVisibility::Blocked;
        const bool only_reflected = signals.visibility[k][i] == heatmap::CellVisibility::NLOS;
        signals.excess_m[k][i] = only_reflected ? static_cast<float>(max_m * random.uniform()) : 0;
      }
    }
  }

  struct Result {
    positioning::Fix fix;
    double horizontal_m = NAN, vertical_m = NAN;
    double solving_s = 0;  ///< of the processor, in solve_fix()
  };
  /// The result of positioning::solve_fix() at a cell. @param noise_m per satellite of the tile, or empty
  [[nodiscard]] Result reference_fix(std::size_t cell, const receiver::ReceiverOptions& options,
                                     const std::vector<double>& noise_m = {}) const {
    using geodesy::kSpeedOfLight;
    const Eigen::Vector3d antenna = frame.ecef_from_local(centre(cell));
    const geodesy::Geodetic at = geodesy::geodetic_from_ecef(antenna);
    const double bias_s = 1.234567e-4;
    std::vector<positioning::Measurement> measurements;
    for (std::size_t k = 0; k < signals.satellites.size(); ++k) {
      if (signals.visibility[k][cell] == heatmap::CellVisibility::Blocked) continue;
      const auto line = orbit::line_of_sight(sky, signals.satellites[k].id, time, antenna);
      positioning::Measurement m;
      m.id = line->id;
      m.carrier_frequency_hz = line->state.carrier_frequency_hz;
      m.sigma_m = 1;
      m.pseudorange_m = line->range_m + static_cast<double>(signals.excess_m[k][cell]) +
                        kSpeedOfLight * (bias_s - line->state.clock_bias_s + line->state.group_delay_s) +
                        (noise_m.empty() ? 0 : noise_m[k]);
      if (options.noise.enabled) m.pseudorange_m += options.noise.ou.mu_m;
      if (options.ionosphere) {
        m.pseudorange_m +=
            sky::klobuchar_delay_m(sky::klobuchar_of(klobuchar, m.id.system), time, at, line->azimuth_rad,
                                   line->elevation_rad, m.carrier_frequency_hz);
      }
      if (options.troposphere) m.pseudorange_m += sky::saastamoinen_delay_m(at, line->elevation_rad);
      measurements.push_back(m);
    }
    Result result;
    const std::clock_t start = std::clock();
    result.fix = positioning::solve_fix(time + bias_s, measurements, sky, options.fix, klobuchar);
    result.solving_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    if (result.fix.solved()) {
      const Eigen::Vector3d error =
          geodesy::enu_from_ecef_rotation(at) * (result.fix.position_ecef - antenna);
      result.horizontal_m = error.head<2>().norm();
      result.vertical_m = error.z();
    }
    return result;
  }
};

using Maps = std::vector<std::vector<float>>;
/// -77: not written.
inline Maps solve(const heatmap::SharedReceiver& receiver, const TileScene& scene,
                  const std::vector<heatmap::Layer>& wanted) {
  Maps maps(wanted.size(), std::vector<float>(scene.cells.state.size(), -77));
  const std::vector<std::span<float>> spans(maps.begin(), maps.end());
  heatmap::solve_shared(receiver, scene.cells, scene.time, scene.signals, wanted, spans);
  return maps;
}

}  // namespace canyon::test
