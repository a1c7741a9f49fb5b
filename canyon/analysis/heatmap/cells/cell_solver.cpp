#include "canyon/analysis/heatmap/cells/cell_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/analysis/heatmap/cells/cell_values.hpp"
#include "canyon/analysis/heatmap/cells/moving_fixes.hpp"
#include "canyon/analysis/heatmap/cells/receiver_realizations.hpp"
#include "canyon/analysis/heatmap/cells/shared_cells.hpp"
#include "canyon/analysis/heatmap/cells/steady_cell.hpp"
#include "canyon/analysis/heatmap/kernels/bins.hpp"
#include "canyon/analysis/heatmap/kernels/tile_tasks.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;
using propagation::KnownEdge;
using propagation::Visibility;

/// CellMethod::Shared.
class SharedCells final : public CellSolver {
 public:
  SharedCells(const simulation::Environment& environment, const TileTracer& tracer,
              const CellReceiver& receiver)
      : tracer_(tracer),
        receiver_{receiver.config.options, receiver.samples, environment.klobuchar(), receiver.limits,
                  environment.errors()} {}

  [[nodiscard]] bool solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                           std::span<const std::span<float>> layers,
                           const std::function<bool()>& /*stop*/) const override {
    static thread_local TileSignals signals;  // static to reuse its memory
    tracer_.trace(cells, time, std::any_of(wanted.begin(), wanted.end(), needs_signals), signals);
    solve_shared(receiver_, cells, time, signals, wanted, layers);
    return true;
  }

 private:
  const TileTracer& tracer_;
  SharedReceiver receiver_;
};

/// Blocks of cells of a tile, each with a node at the computed cell nearest to its middle.
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

  /// Calls f(cell) for the cells [row_0, row_1) x [column_0, column_1) of a block.
  template <typename F>
  void for_each(std::size_t block, int quadrant, const F& f) const {
    const std::size_t x = block % across * size, y = block / across * size;
    const std::size_t half = size / 2;
    const bool east = (quadrant & 1) != 0, north = (quadrant & 2) != 0;
    for (std::size_t r = y + (north ? half : 0); r < std::min(rows, y + (north ? size : half)); ++r)
      for (std::size_t c = x + (east ? half : 0); c < std::min(columns, x + (east ? size : half)); ++c)
        f(r * columns + c);
  }
  /// The computed cell nearest to the middle of a block; columns * rows: none.
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
  /// Edges of the block's node, and of the three nodes next to a quadrant of it. @param known replaced
  void gather(std::size_t block, int quadrant, std::vector<KnownEdge>& known) const {
    known = nodes[block].edges;
    const auto x = static_cast<std::ptrdiff_t>(block % across),
               y = static_cast<std::ptrdiff_t>(block / across);
    const std::ptrdiff_t east = (quadrant & 1) != 0 ? 1 : -1, north = (quadrant & 2) != 0 ? 1 : -1;
    for (const auto& [dx, dy] :
         {std::pair(east, std::ptrdiff_t{0}), {std::ptrdiff_t{0}, north}, {east, north}}) {
      const std::ptrdiff_t u = x + dx, v = y + dy;
      if (u < 0 || v < 0 || u >= static_cast<std::ptrdiff_t>(across) ||
          v >= static_cast<std::ptrdiff_t>(down))
        continue;
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

/// Rows of blocks whose nodes are in memory at a time, not all of a tile's.
constexpr std::size_t kBandRows = 32;

/// CellMethod::Steady.
class SteadyCells final : public CellSolver {
 public:
  SteadyCells(const simulation::Environment& environment, const propagation::Propagator& propagator,
              const CellReceiver& receiver)
      : environment_(environment), propagator_(propagator), receiver_(receiver) {}

  [[nodiscard]] bool solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                           std::span<const std::span<float>> layers,
                           const std::function<bool()>& stop) const override;

 private:
  const simulation::Environment& environment_;
  const propagation::Propagator& propagator_;
  CellReceiver receiver_;
};

bool SteadyCells::solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                        std::span<const std::span<float>> layers,
                        const std::function<bool()>& /*stop*/) const {
  assert(wanted.size() == layers.size());
  const auto has = [&](const auto& is) { return std::any_of(wanted.begin(), wanted.end(), is); };
  const bool statistics = has(is_sample_layer);
  const bool needs_samples = statistics || has([](Layer layer) { return layer == Layer::Availability; });
  const double half = cells.plane.spacing_m / 2;
  const Vector3d centre(cells.plane.first.x() + half * (cells.tile.columns - 1),
                        cells.plane.first.y() + half * (cells.tile.rows - 1), cells.plane.z);
  const propagation::PropagationOptions& propagation = propagator_.options();
  const SteadySky sky(environment_, receiver_.config.options,
                      propagation.diffuse ? propagation.scattering.max_paths : 0, receiver_.samples,
                      needs_samples ? receiver_.samples.samples + 1 : 1, centre, time);
  const Eigen::Matrix3d ecef_from_enu = environment_.city().frame.ecef_from_local_rotation();
  const auto task = [&] {
    return SteadyCell(sky, propagator_, receiver_.config.options, receiver_.limits, ecef_from_enu,
                      receiver_.movement.has_value());
  };
  std::optional<MovingFixes> moving;
  if (receiver_.movement) moving.emplace(cells, static_cast<std::size_t>(sky.lanes()), *receiver_.movement);

  const auto move_solver = [&](SteadyCell& solver, const Vector3d& point) {
    if (sky.skylines().empty()) return;
    solver.move_to(point, environment_.scene());
  };

  Blocks blocks(cells, receiver_.how.path_nodes_m);
  const std::size_t none = cells.tile.cells();
  const bool only_nodes = blocks.size == 1;
  const auto trace_row = [&](std::size_t row) {
    SteadyCell tracer = task();
    for (std::size_t block = row * blocks.across; block < (row + 1) * blocks.across; ++block) {
      const std::size_t at = blocks.middle(cells, block);
      if (at != none) blocks.nodes[block] = tracer.trace(cells.centre(at));
    }
  };
  const auto solve_row = [&](std::size_t row) {
    SteadyCell solver = task();
    std::vector<KnownEdge> known;
    for (std::size_t block = row * blocks.across; block < (row + 1) * blocks.across; ++block) {
      if (const std::size_t at = blocks.middle(cells, block); at != none)
        move_solver(solver, cells.centre(at));
      for (int quadrant = 0; quadrant < 4; ++quadrant) {
        bool gathered = false;
        blocks.for_each(block, quadrant, [&](std::size_t i) {
          CellValues values;
          if (cells.state[i] == CellState::Computed) {
            if (only_nodes) {
              solver.solve(cells.centre(i), statistics, values);
            } else {
              if (!gathered) blocks.gather(block, quadrant, known);
              gathered = true;
              solver.solve(cells.centre(i), known, blocks.nodes[block], statistics, values);
            }
            if (moving) moving->set(i, solver.fixes());
          }
          values.store(wanted, layers, i);
        });
      }
    }
  };
  // Cells need the nodes of the rows before and after their own.
  std::size_t traced = 0;
  for (std::size_t first = 0; first < blocks.down; first += kBandRows) {
    const std::size_t last = std::min(first + kBandRows, blocks.down);
    if (!only_nodes) {
      const std::size_t after = std::min(last + 1, blocks.down);
      spread(after - traced, [&](std::size_t row) { trace_row(traced + row); });
      traced = after;
    }
    spread(last - first, [&](std::size_t row) { solve_row(first + row); });
    blocks.forget(first > 0 ? first - 1 : 0, last - 1);
  }
  if (!moving) return true;
  moving->filter();
  for (std::size_t i = 0; i < none; ++i) {
    if (cells.state[i] != CellState::Computed) continue;
    CellValues values;
    moving->describe(i, receiver_.limits, statistics, values);
    values.store<is_motion_layer>(wanted, layers, i);
  }
  return true;
}

/// The receiver with only the first signal if no fix uses others: its measurement does not depend on them.
simulation::ReceiverConfig with_used_signals(simulation::ReceiverConfig receiver) {
  receiver::ReceiverOptions& options = receiver.options;
  if (options.fix_input.combination != receiver::Combination::First || !options.fix_input.uses.empty())
    return receiver;
  const std::vector<std::string> tracks = options.tracks;
  std::erase_if(options.tracks, [&](const std::string& name) {
    return std::all_of(gnss::kAllSystems.begin(), gnss::kAllSystems.end(), [&](gnss::System system) {
      const auto tracked = receiver::tracked_signals(tracks, system);
      // All satellites send the signal near L1; another signal may be the first only for some satellites.
      const bool near_l1 = !tracked.empty() && tracked.front() == &gnss::signals_of(system).front();
      return std::none_of(tracked.begin(), tracked.end(), [&](const gnss::Signal* signal) {
        return signal->name == name && (signal == tracked.front() || !near_l1);
      });
    });
  });
  return receiver;
}

/// East, north, up [m].
Vector3d error_of(const positioning::Fix& fix, const Vector3d& truth_ecef) {
  return geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(truth_ecef)) *
         (fix.position_ecef - truth_ecef);
}

/// Receivers that are run in each cell.
class RunCells final : public CellSolver {
 public:
  /// @param rtk computes the layers is_rtk_layer() instead of those is_solver_layer()
  RunCells(const simulation::Environment& environment, const propagation::Propagator& propagator,
           const CellReceiver& receiver, bool rtk);

  [[nodiscard]] bool solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                           std::span<const std::span<float>> layers,
                           const std::function<bool()>& stop) const override;

 private:
  using Corrections = std::shared_ptr<const rtk::Corrections>;
  /// Source of corrections.
  struct Base {
    Base(const simulation::Environment& environment, const simulation::ReceiverConfig& config,
         const MonteCarloOptions& map_options)
        : propagator(environment.make_propagator(config.propagation)),
          samples(environment, propagator, config, map_options),
          position(config.fixed->position) {}
    Base(const Base&) = delete;
    Base& operator=(const Base&) = delete;

    propagation::Propagator propagator;
    ReceiverRealizations samples;
    geodesy::Geodetic position;
  };
  bool scene_at(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                std::span<const std::span<float>> layers) const;
  void solve_without_noise(const ReceiverRealizations::Scene& scene, CellValues& values) const;
  /// @param space by realization, or empty
  void draw(const ReceiverRealizations::Scene& scene, std::span<const sky::RangeErrorModel> space,
            bool statistics, CellValues& values) const;
  /// [second][realization]; null if the base measured nothing.
  [[nodiscard]] std::vector<std::vector<Corrections>> corrections(
      geodesy::GpsTime time, std::span<const sky::RangeErrorModel> space) const;
  void fix_by_rtk(geodesy::GpsTime time, const Vector3d& point, std::span<const sky::RangeErrorModel> space,
                  std::span<const std::vector<Corrections>> sent, CellValues& values) const;

  CellReceiver receiver_;
  ReceiverRealizations receivers_;
  std::optional<Base> base_;  ///< for layers of RTK
};

RunCells::RunCells(const simulation::Environment& environment, const propagation::Propagator& propagator,
                   const CellReceiver& receiver, bool rtk)
    : receiver_(receiver),
      receivers_(environment, propagator, rtk ? receiver.config : with_used_signals(receiver.config),
                 receiver.samples) {
  if (!rtk) return;
  receiver.base->options.validate();
  base_.emplace(environment, *receiver.base, receiver.samples);
  // An epoch needs some kilobytes, and all are in memory for the cells of a tile.
  constexpr std::int64_t kMaxEpochs = 100'000;
  const int sample_count = receiver.samples.samples, seconds = receiver.limits.rtk_s;
  const std::int64_t epochs = std::int64_t{sample_count} * (seconds + 1);
  if (epochs > kMaxEpochs) {
    throw InputError(
        fmt::format("{} samples of {} s need {} epochs of the base", sample_count, seconds, epochs),
        fmt::format("layers of RTK allow {}: use fewer draws, or a shorter time", kMaxEpochs));
  }
}

void RunCells::solve_without_noise(const ReceiverRealizations::Scene& scene, CellValues& values) const {
  const receiver::ReceiverOptions& options = receivers_.options();
  const simulation::Environment& environment = receivers_.environment();
  receiver::ReceiverOptions quiet = options;
  quiet.signal.cn0_sigma_db = 0;
  quiet.signal.satellite_sigma_db = quiet.signal.installation_sigma_db = 0;
  quiet.signal.shadowing.enabled = false;
  receiver::Receiver receiver(quiet, receivers_.seed(scene.antenna.time, 0), receivers_.disturbances());
  receiver::ReceiverEpoch epoch = receivers_.observe(receiver, scene, {}, 0);
  std::vector<positioning::Measurement> measurements;
  receiver::FixInput fix_input(quiet);
  int los = 0, nlos = 0;
  double largest_excess_m = 0;
  for (receiver::SatelliteObservation& satellite : epoch.satellites) {
    if (!satellite.above_mask) continue;
    los += satellite.visibility == Visibility::LOS || satellite.visibility == Visibility::LOSMultipath;
    const auto without_noise = [&](receiver::SignalObservation& signal) {
      if (!signal.measurement) return;
      signal.measurement->pseudorange_m -=
          signal.noise_m - (options.noise.enabled ? options.noise.ou.mu_m : 0);
    };
    without_noise(satellite);
    for (receiver::SignalObservation& signal : satellite.more) without_noise(signal);
    if (satellite.measurement) {
      nlos += satellite.visibility == Visibility::NLOS;
      largest_excess_m = std::max(largest_excess_m, satellite.excess_m);
    }
    const auto view =
        std::find_if(scene.arrival.views.begin(), scene.arrival.views.end(),
                     [&](const propagation::SatelliteView& each) { return each.line.id == satellite.id; });
    assert(view != scene.arrival.views.end());
    if (const auto ranged = fix_input.next(satellite, view->line.state, scene.antenna.time, 0))
      measurements.push_back(ranged->measurement);
  }
  values.set_satellites(los, epoch.visible, epoch.blocked, nlos, largest_excess_m);
  const positioning::Fix fix = positioning::solve_fix(epoch.receiver_time, measurements, environment.sky(),
                                                      options.fix, environment.klobuchar());
  values.set(Layer::Availability, fix.solved() ? 1 : 0);
  values.set(Layer::SatellitesUsed, static_cast<double>(fix.used.size()));
  if (!fix.solved()) return;
  values.set_fix(
      error_of(fix, scene.antenna.position_ecef), fix.dop,
      positioning::horizontal_protection_level_m(fix.covariance_enu, receiver_.limits.protection_factor));
}

void RunCells::draw(const ReceiverRealizations::Scene& scene, std::span<const sky::RangeErrorModel> space,
                    bool statistics, CellValues& values) const {
  SampledFixes fixes;
  const std::vector<disturbance::DisturbanceSource> disturbances =
      receivers_.disturbances_at(scene.arrival.antenna_enu);
  for (int d = 0; d < receivers_.count(); ++d) {
    receiver::Receiver receiver(receivers_.options(), receivers_.seed(scene.antenna.time, d), disturbances);
    const receiver::ReceiverEpoch epoch =
        receivers_.observe(receiver, scene, space, static_cast<std::size_t>(d));
    if (!epoch.fix.solved()) continue;
    fixes.add(error_of(epoch.fix, scene.antenna.position_ecef), epoch.fix.covariance_enu, receiver_.limits);
  }
  if (receivers_.options().signal.enabled)
    values.set(Layer::Availability, static_cast<double>(fixes.horizontal_m.size()) / receivers_.count());
  if (statistics) fixes.describe(receiver_.limits, receivers_.count(), values);
}

bool RunCells::scene_at(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                        std::span<const std::span<float>> layers) const {
  const bool statistics = std::any_of(wanted.begin(), wanted.end(), is_sample_layer);
  const bool needs_samples =
      statistics || (receivers_.options().signal.enabled &&
                     std::find(wanted.begin(), wanted.end(), Layer::Availability) != wanted.end());
  const auto space = receivers_.space(time, needs_samples ? receivers_.count() : 0);
  return solve_rows<is_solver_layer>(
      cells, wanted, layers, {}, [&](const Vector3d& point, CellValues& values) {
        const ReceiverRealizations::Scene scene =
            receivers_.scene_at(time, point, receivers_.environment().city().frame.ecef_from_local(point));
        solve_without_noise(scene, values);
        if (needs_samples) draw(scene, space, statistics, values);
      });
}

std::vector<std::vector<RunCells::Corrections>> RunCells::corrections(
    geodesy::GpsTime time, std::span<const sky::RangeErrorModel> space) const {
  const Vector3d antenna_position_ecef = geodesy::ecef_from_geodetic(base_->position);
  const Vector3d point = base_->samples.environment().city().frame.local_from_geodetic(base_->position);
  const auto stations = base_->samples.receivers_at(time, point);
  std::vector<std::vector<Corrections>> sent(static_cast<std::size_t>(receiver_.limits.rtk_s) + 1);
  for (std::size_t second = 0; second < sent.size(); ++second) {
    const ReceiverRealizations::Scene scene =
        base_->samples.scene_at(time + static_cast<double>(second), point, antenna_position_ecef);
    for (std::size_t d = 0; d < stations.size(); ++d) {
      sent[second].push_back(receiver::corrections_of(base_->samples.observe(*stations[d], scene, space, d),
                                                      antenna_position_ecef));
    }
  }
  return sent;
}

void RunCells::fix_by_rtk(geodesy::GpsTime time, const Vector3d& point,
                          std::span<const sky::RangeErrorModel> space,
                          std::span<const std::vector<Corrections>> sent, CellValues& values) const {
  const Vector3d antenna_position_ecef = receivers_.environment().city().frame.ecef_from_local(point);
  const Eigen::Matrix3d enu =
      geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(antenna_position_ecef));
  const auto rovers = receivers_.receivers_at(time, point);
  std::vector<rtk::CorrectionLink> links;
  for (std::size_t d = 0; d < rovers.size(); ++d) {
    links.emplace_back(receivers_.options().corrections, receivers_.seed(time, static_cast<int>(d)),
                       receivers_.options().name);
  }
  std::vector<double> first_s(rovers.size(), std::numeric_limits<double>::infinity()), fixed_m;
  for (std::size_t second = 0; second < sent.size(); ++second) {
    const geodesy::GpsTime now = time + static_cast<double>(second);
    const ReceiverRealizations::Scene scene = receivers_.scene_at(now, point, antenna_position_ecef);
    for (std::size_t d = 0; d < rovers.size(); ++d) {
      if (sent[second][d]) links[d].send(now, sent[second][d], antenna_position_ecef);
      const Corrections came = links[d].take(now);
      const positioning::Fix fix = receivers_.observe(*rovers[d], scene, space, d, came.get()).fix;
      if (fix.kind() != positioning::FixKind::Fixed) continue;
      first_s[d] = std::min(first_s[d], static_cast<double>(second));
      fixed_m.push_back((enu * (fix.position_ecef - antenna_position_ecef)).head<2>().norm());
    }
  }
  values.set(Layer::RtkFixedFraction,
             static_cast<double>(fixed_m.size()) / static_cast<double>(sent.size() * rovers.size()));
  std::sort(first_s.begin(), first_s.end());
  if (first_s[first_s.size() / 2] < std::numeric_limits<double>::infinity())
    values.set(Layer::RtkTimeToFix, *median(first_s));
  if (const auto p95 = quantile(fixed_m, 0.95)) values.set(Layer::RtkFixedErrorP95, *p95);
}

bool RunCells::solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                     std::span<const std::span<float>> layers, const std::function<bool()>& stop) const {
  assert(wanted.size() == layers.size());
  if (!base_) return scene_at(cells, time, wanted, layers);
  const auto space = receivers_.space(time, receivers_.count());
  const std::vector<std::vector<Corrections>> sent = corrections(time, space);
  return solve_rows<is_rtk_layer>(
      cells, wanted, layers, stop,
      [&](const Vector3d& point, CellValues& values) { fix_by_rtk(time, point, space, sent, values); });
}

/// Enough iterations to reach the fix that CellFix computes.
constexpr int kIterations = 20;

/// Whether an option of the receiver has effects that need running it.
bool must_run(const simulation::ReceiverConfig& receiver) {
  const receiver::ReceiverOptions& options = receiver.options;
  return !receiver.disturbances.empty() || receiver.streets.enabled ||
         options.fix_input.combination != receiver::Combination::First || !options.fix_input.uses.empty() ||
         options.fix.raim.enabled || options.fix.max_iterations < kIterations || options.filter.enabled ||
         options.dead_reckoning.enabled || options.rtk.enabled || options.fix_noise.any() ||
         !options.corrections.from.empty();
}

bool needs_protection(Layer layer) {
  return layer == Layer::ProtectionLevel || layer == Layer::ProtectedAvailability ||
         layer == Layer::MisleadingFraction;
}

}  // namespace

CellMethod cell_method(const simulation::ReceiverConfig& receiver) {
  if (must_run(receiver)) return CellMethod::Run;
  const receiver::ReceiverOptions& options = receiver.options;
  if (options.signal.enabled) {
    const bool steady =
        !options.noise.drift_enabled && receiver.propagation.model == propagation::Model::Specular;
    return steady ? CellMethod::Steady : CellMethod::Run;
  }
  const bool by_cn0 = options.fix.weights.weighting == positioning::Weighting::Cn0;
  return by_cn0 ? CellMethod::Run : CellMethod::Shared;
}

std::unique_ptr<const CellSolver> cell_solver(CellMethod method, const simulation::Environment& environment,
                                              const TileTracer& tracer, const CellReceiver& receiver) {
  receiver.config.options.validate();
  receiver.samples.validate();
  receiver.limits.validate();
  switch (method) {
    case CellMethod::Shared:
      return std::make_unique<SharedCells>(environment, tracer, receiver);
    case CellMethod::Steady:
      return std::make_unique<SteadyCells>(environment, tracer.propagator(), receiver);
    case CellMethod::Run:
      break;
  }
  return std::make_unique<RunCells>(environment, tracer.propagator(), receiver, false);
}

std::vector<std::unique_ptr<const CellSolver>> cell_solvers(const simulation::Environment& environment,
                                                            const TileTracer& tracer,
                                                            const CellReceiver& receiver,
                                                            std::span<const Layer> layers) {
  std::vector<std::unique_ptr<const CellSolver>> solvers;
  const auto wants = [&](const auto& is) { return std::any_of(layers.begin(), layers.end(), is); };
  const simulation::ReceiverConfig& config = receiver.config;
  CellMethod method = cell_method(config);
  if (method == CellMethod::Steady && receiver.how.model == ReceiverModel::Run) method = CellMethod::Run;
  // Residuals differ between cells that receive the same satellites.
  if (method == CellMethod::Shared && config.options.fix.covariance_by_residuals && wants(needs_protection))
    method = CellMethod::Run;
  if (!wants(needs_signals)) method = CellMethod::Shared;  // SatellitesLos needs no receiver
  if (wants(is_solver_layer)) solvers.push_back(cell_solver(method, environment, tracer, receiver));
  if (wants(is_rtk_layer))
    solvers.push_back(std::make_unique<RunCells>(environment, tracer.propagator(), receiver, true));
  return solvers;
}

void MonteCarloOptions::validate() const {
  options::check(*this, "map's noise");
}

void visit(options::Visitor& v, MonteCarloOptions& o) {
  v.integer({"draws", "", "noise realizations, for layers over draws"}, o.samples, 1, 10'000);
  v.integer({"seed", "", "seed of the noise realizations, the same at every cell"}, o.seed);
}

void visit(options::Visitor& v, CellReceiverOptions& o) {
  static constexpr std::string_view kModels[]{"steady_state", "run"};
  v.choice({"model", "",
            "receivers with signal strength: steady_state (steady state of loops and fixes) or run (each "
            "cell's receiver runs, slow)"},
           o.model, kModels);
  v.number({"path_nodes_m", "m",
            "steady_state: distance between the points where paths are searched; between them paths are "
            "constructed; 0: search at every cell"},
           o.path_nodes_m, {0, 100});
}

}  // namespace canyon::heatmap
