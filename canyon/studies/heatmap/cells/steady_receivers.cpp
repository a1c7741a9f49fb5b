#include "canyon/studies/heatmap/cells/steady_receivers.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/studies/heatmap/cells/steady_cell.hpp"
#include "canyon/studies/heatmap/kernels/bins.hpp"
#include "canyon/studies/heatmap/kernels/tile_tasks.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;
using propagation::KnownEdge;

/// A tile's blocks of cells, each with a node at the computed cell next to its middle.
struct Blocks {
  std::size_t size, across, down;  ///< cells across a block; blocks
  std::size_t columns, rows;       ///< of the tile
  std::vector<PathNode> nodes;

  Blocks(const TileCells& cells, double nodes_m)
      : size(static_cast<std::size_t>(std::max(1.0, std::round(nodes_m / cells.plane.spacing_m)))),
        across((cells.tile.columns + size - 1) / size),
        down((cells.tile.rows + size - 1) / size),
        columns(cells.tile.columns),
        rows(cells.tile.rows),
        nodes(across * down) {}

  /// Calls f(cell) for the cells [row_0, row_1) x [column_0, column_1) of a block's own.
  template <typename F>
  void for_each(std::size_t block, int quadrant, const F& f) const {
    const std::size_t x = block % across * size, y = block / across * size;
    const std::size_t half = size / 2;
    const bool east = (quadrant & 1) != 0, north = (quadrant & 2) != 0;
    for (std::size_t r = y + (north ? half : 0); r < std::min(rows, y + (north ? size : half)); ++r) {
      for (std::size_t c = x + (east ? half : 0); c < std::min(columns, x + (east ? size : half)); ++c) {
        f(r * columns + c);
      }
    }
  }
  /// The computed cell next to the middle of a block; none: columns * rows.
  [[nodiscard]] std::size_t middle(const TileCells& cells, std::size_t block) const {
    const std::size_t first_column = block % across * size, first_row = block / across * size;
    const double x = static_cast<double>(first_column) + 0.5 * static_cast<double>(size - 1);
    const double y = static_cast<double>(first_row) + 0.5 * static_cast<double>(size - 1);
    std::size_t best = columns * rows;
    double nearest = 1e300;
    for (int quadrant = 0; quadrant < 4; ++quadrant) {
      for_each(block, quadrant, [&](std::size_t i) {
        if (cells.state[i] != CellState::Computed) return;
        const std::size_t column = i % columns, row = i / columns;
        const double dx = static_cast<double>(column) - x, dy = static_cast<double>(row) - y;
        const double apart = dx * dx + dy * dy;
        if (apart < nearest || (apart == nearest && i < best)) {
          nearest = apart;
          best = i;
        }
      });
    }
    return best;
  }
  /// Edges of the block's node, and of the three next to a quadrant of it. @param known replaced
  void gather(std::size_t block, int quadrant, std::vector<KnownEdge>& known) const {
    known = nodes[block].edges;
    const auto x = static_cast<std::ptrdiff_t>(block % across),
               y = static_cast<std::ptrdiff_t>(block / across);
    const std::ptrdiff_t east = (quadrant & 1) != 0 ? 1 : -1, north = (quadrant & 2) != 0 ? 1 : -1;
    for (const auto& [dx, dy] :
         {std::pair(east, std::ptrdiff_t{0}), {std::ptrdiff_t{0}, north}, {east, north}}) {
      const std::ptrdiff_t u = x + dx, v = y + dy;
      if (u < 0 || v < 0 || u >= static_cast<std::ptrdiff_t>(across) ||
          v >= static_cast<std::ptrdiff_t>(down)) {
        continue;
      }
      const PathNode& other = nodes[static_cast<std::size_t>(v) * across + static_cast<std::size_t>(u)];
      known.insert(known.end(), other.edges.begin(), other.edges.end());
    }
    sort_unique(known);
  }
  /// Frees the nodes of rows of blocks [first, last).
  void forget(std::size_t first, std::size_t last) {
    for (std::size_t block = first * across; block < last * across; ++block) nodes[block] = PathNode();
  }
};

/// Rows of blocks whose nodes are kept at a time, so that a tile's memory is a part of its nodes'.
constexpr std::size_t kBandRows = 32;

}  // namespace

SteadyReceivers::SteadyReceivers(const simulation::Environment& environment,
                                 const propagation::Propagator& propagator,
                                 const simulation::ReceiverConfig& receiver, const DrawOptions& draws,
                                 const LimitOptions& limits, double path_nodes_m,
                                 const std::optional<Movement>& movement)
    : environment_(&environment),
      propagator_(&propagator),
      options_(receiver.options),
      draws_(draws),
      limits_(limits),
      path_nodes_m_(path_nodes_m),
      movement_(movement) {
  options_.validate();
  draws_.validate();
}

bool SteadyReceivers::solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                            std::span<const std::span<float>> layers,
                            const std::function<bool()>& /*stop*/) const {
  assert(wanted.size() == layers.size());
  const auto has = [&](const auto& is) { return std::any_of(wanted.begin(), wanted.end(), is); };
  const bool statistics = has(over_draws);
  const bool draws = statistics || has([](Layer layer) { return layer == Layer::Availability; });
  const double half = cells.plane.spacing_m / 2;
  const Vector3d centre(cells.plane.first.x() + half * (cells.tile.columns - 1),
                        cells.plane.first.y() + half * (cells.tile.rows - 1), cells.plane.z);
  const propagation::PropagationOptions& propagation = propagator_->options();
  const SteadySky sky(*environment_, options_, propagation.diffuse ? propagation.scattering.max_paths : 0,
                      draws_, draws ? draws_.draws + 1 : 1, centre, time);
  const Eigen::Matrix3d ecef_from_enu = environment_->city().frame.ecef_from_local_rotation();
  const auto task = [&] {
    return SteadyCell(sky, *propagator_, options_, limits_, ecef_from_enu, movement_.has_value());
  };
  std::optional<MovingFixes> moving;
  if (movement_) moving.emplace(cells, static_cast<std::size_t>(sky.lanes()), *movement_);

  const auto stand = [&](SteadyCell& solver, const Vector3d& place) {
    if (sky.skylines().empty()) return;
    solver.stand_at(place, environment_->scene());
  };

  Blocks blocks(cells, path_nodes_m_);
  const std::size_t none = cells.tile.cells();
  const bool only_nodes = blocks.size == 1;
  const auto trace_row = [&](std::size_t row) {
    SteadyCell tracer = task();
    for (std::size_t block = row * blocks.across; block < (row + 1) * blocks.across; ++block) {
      const std::size_t at = blocks.middle(cells, block);
      if (at != none) blocks.nodes[block] = tracer.trace(cells.place(at));
    }
  };
  const auto solve_row = [&](std::size_t row) {
    SteadyCell solver = task();
    std::vector<KnownEdge> known;
    for (std::size_t block = row * blocks.across; block < (row + 1) * blocks.across; ++block) {
      if (const std::size_t at = blocks.middle(cells, block); at != none) stand(solver, cells.place(at));
      for (int quadrant = 0; quadrant < 4; ++quadrant) {
        bool gathered = false;
        blocks.for_each(block, quadrant, [&](std::size_t i) {
          CellValues values;
          if (cells.state[i] == CellState::Computed) {
            if (only_nodes) {
              solver.solve(cells.place(i), statistics, values);
            } else {
              if (!gathered) blocks.gather(block, quadrant, known);
              gathered = true;
              solver.solve(cells.place(i), known, blocks.nodes[block], statistics, values);
            }
            if (moving) moving->set(i, solver.fixes());
          }
          values.store(wanted, layers, i);
        });
      }
    }
  };
  // Cells need the nodes of the rows before and behind their own.
  std::size_t traced = 0;
  for (std::size_t first = 0; first < blocks.down; first += kBandRows) {
    const std::size_t last = std::min(first + kBandRows, blocks.down);
    if (!only_nodes) {
      const std::size_t behind = std::min(last + 1, blocks.down);
      spread(behind - traced, [&](std::size_t row) { trace_row(traced + row); });
      traced = behind;
    }
    spread(last - first, [&](std::size_t row) { solve_row(first + row); });
    blocks.forget(first > 0 ? first - 1 : 0, last - 1);
  }
  if (!moving) return true;
  moving->filter();
  for (std::size_t i = 0; i < none; ++i) {
    if (cells.state[i] != CellState::Computed) continue;
    CellValues values;
    moving->describe(i, limits_, statistics, values);
    values.store<of_motion>(wanted, layers, i);
  }
  return true;
}

}  // namespace canyon::heatmap
