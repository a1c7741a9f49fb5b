#include "canyon/heatmap/cells/cell_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/heatmap/cells/cell_method.hpp"
#include "canyon/heatmap/cells/cell_solution.hpp"
#include "canyon/heatmap/cells/cell_values.hpp"
#include "canyon/options/values.hpp"

namespace canyon::heatmap {
namespace {

/// Cells whose satellites are gathered at once: their bits stay in the first cache.
constexpr std::size_t kBlock = 512;

bool over_draws(Layer layer) {
  return info(layer).draws && of_solver(layer);
}
[[maybe_unused]] bool of_error(Layer layer) {
  return layer <= Layer::VerticalErrorP95 || over_draws(layer);
}
bool of_fix(Layer layer) {
  return info(layer).error && of_solver(layer);
}

/// Satellites received and in line of sight, of a block of cells: two words each.
struct Block {
  std::array<std::array<std::uint64_t, kBlock>, 2> received, los;

  void gather(const TileSignals& signals, std::size_t first, std::size_t count) {
    for (auto* words : {&received, &los}) {
      for (auto& word : *words) word.fill(0);
    }
    for (std::size_t i = 0; i < signals.visibility.size(); ++i) {
      const CellVisibility* visibility = signals.visibility[i].data() + first;
      std::uint64_t* any = received[i / 64].data();
      std::uint64_t* direct = los[i / 64].data();
      for (std::size_t cell = 0; cell < count; ++cell) {
        any[cell] |= std::uint64_t{visibility[cell] != CellVisibility::Blocked} << (i % 64);
        direct[cell] |= std::uint64_t{visibility[cell] == CellVisibility::LOS} << (i % 64);
      }
    }
  }
};

/// A tile: its shared solutions, and the values of one cell after another.
class TileCellSolver {
 public:
  TileCellSolver(const receiver::ReceiverOptions& receiver, const DrawOptions& draws,
                 const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const LimitOptions& limits,
                 const TileCells& cells, const TileSignals& signals, std::span<const Layer> wanted)
      : receiver_(receiver),
        limits_(limits),
        cells_(cells),
        signals_(signals),
        draws_(std::any_of(wanted.begin(), wanted.end(), over_draws) ? draws.draws : 0),
        fixes_(std::any_of(wanted.begin(), wanted.end(), of_fix)),
        solutions_(receiver, klobuchar, signals, draws_, draws.seed) {
    const auto is_wanted = [&](Layer layer) {
      return std::find(wanted.begin(), wanted.end(), layer) != wanted.end();
    };
    horizontal_quantiles_ = is_wanted(Layer::HorizontalErrorP50) || is_wanted(Layer::HorizontalErrorP95);
    vertical_quantiles_ = is_wanted(Layer::VerticalErrorP50) || is_wanted(Layer::VerticalErrorP95);
  }

  /// All layers of a cell; NaN where it is not Computed.
  const CellValues& solve(std::size_t index, const SatelliteSet& received, const SatelliteSet& los) {
    values_ = CellValues();
    if (cells_.state[index] != CellState::Computed) return values_;
    cell_.received = received;
    const int direct = los.size();
    count(index, los);
    if (fixes_) locate(index, direct);
    return values_;
  }

 private:
  /// Counts satellites by the paths that arrive from them, and gathers their excesses.
  void count(std::size_t index, const SatelliteSet& los) {
    const int visible = cell_.received.size(), direct = los.size();
    const auto satellites = static_cast<int>(signals_.satellites.size());
    cell_.excesses = 0;
    // A satellite in line of sight has no excess.
    double largest = direct > 0 ? 0 : -std::numeric_limits<double>::infinity();
    const bool excesses = !signals_.excess_m.empty();
    if (excesses) {
      SatelliteSet nlos;
      for (std::size_t w = 0; w < 2; ++w) nlos.bits[w] = cell_.received.bits[w] & ~los.bits[w];
      nlos.for_each([&](std::size_t i) {
        const double excess_m = signals_.excess_m[i][index];
        largest = std::max(largest, excess_m);
        if (excess_m == 0) return;
        const auto k = static_cast<std::size_t>(cell_.excesses++);
        cell_.satellite[k] = static_cast<std::uint8_t>(i);
        cell_.excess_m[k] = excess_m;
      });
    }
    values_.set_satellites(direct, visible, satellites - visible, visible - direct,
                           excesses ? std::optional(largest) : std::nullopt);
  }
  /// The fix without noise and those of the draws.
  void locate(std::size_t index, int direct) {
    solutions_.trim();
    constexpr double kSpeed_mps = 0;
    cell_.received.drifting = receiver_.noise.drifts(kSpeed_mps, direct);
    // The place from the tile's centre, at which the directions are taken.
    const CellPlane& plane = cells_.plane;
    const double column = static_cast<double>(index % plane.columns) - 0.5 * (plane.columns - 1);
    const std::size_t northward = index / plane.columns;
    const double row = static_cast<double>(northward) - 0.5 * (plane.rows - 1);
    const double up = cells_.flat() ? 0 : double{cells_.z[index]} - plane.z;
    cell_.place =
        solutions_.enu_from_city() * Eigen::Vector3d(column * plane.spacing_m, row * plane.spacing_m, up);
    const std::optional<CellFix> fix = solutions_.locate(cell_);
    values_.set(Layer::Availability, fix ? 1 : 0);
    values_.set(Layer::SatellitesUsed, fix ? fix->used : 0);
    if (draws_ > 0) values_.set(Layer::ProtectedAvailability, 0);
    if (!fix) return;
    const double protection_m = limits_.protection_factor * fix->spread_m;
    values_.set_fix(solutions_.at_vertical(cell_.place, fix->error), fix->dop, protection_m);
    if (draws_ == 0) return;
    solutions_.locate_draws(cell_, *fix, drawn_.horizontal_m, drawn_.vertical_m);
    drawn_.protection_m.assign(drawn_.horizontal_m.size(), protection_m);
    drawn_.describe(limits_, draws_, values_, horizontal_quantiles_, vertical_quantiles_);
  }

  const receiver::ReceiverOptions& receiver_;
  const LimitOptions& limits_;
  const TileCells& cells_;
  const TileSignals& signals_;
  int draws_;
  bool fixes_, horizontal_quantiles_ = false, vertical_quantiles_ = false;
  TileSolutions solutions_;
  CellErrors cell_;
  DrawnFixes drawn_;
  CellValues values_;
};

}  // namespace

void DrawOptions::validate() const {
  options::check(*this, "map's noise");
}

void visit(options::Visitor& v, DrawOptions& o) {
  v.integer({"draws", "", "noise realizations, for layers over draws"}, o.draws, 1, 10'000);
  v.integer({"seed", "", "of the draws, the same at every cell"}, o.seed);
}

void CellReceiverOptions::validate() const {
  options::check(*this, "map's receivers");
}

void visit(options::Visitor& v, CellReceiverOptions& o) {
  // The name of steady_state was "settled": it is still read, and keys of stores keep it.
  static constexpr std::string_view kRead[]{"steady_state", "run", "settled"}, kInKeys[]{"settled", "run"};
  const std::span<const std::string_view> read(kRead), in_keys(kInKeys);
  v.choice({"model", "",
            "receivers with signal strength: steady_state (steady state of loops and fixes) or run (each "
            "cell's receiver runs, slow)"},
           o.model, v.purpose() == options::Purpose::Values ? in_keys : read.first(v.reads() ? 3 : 2));
  if (o.model == static_cast<ReceiverModel>(2)) o.model = ReceiverModel::SteadyState;
  v.number({"path_nodes_m", "m",
            "steady_state: distance between the points where paths are searched; between them paths are "
            "constructed; 0: search at every cell"},
           o.path_nodes_m, {0, 100});
}

struct CellSolver::Impl {
  receiver::ReceiverOptions receiver;
  DrawOptions draws;
  std::map<gnss::System, gnss::Klobuchar> klobuchar;
  LimitOptions limits;
};

CellSolver::CellSolver(const receiver::ReceiverOptions& receiver, const DrawOptions& draws,
                       const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const LimitOptions& limits)
    : impl_(std::make_unique<Impl>(Impl{receiver, draws, klobuchar, limits})) {
  receiver.validate();
  draws.validate();
  limits.validate();
  simulation::ReceiverConfig config;
  config.options = receiver;
  if (!fits(CellMethod::Shared, config)) {
    throw InputError(fmt::format("receiver '{}' chooses its signals, has signals with a strength, "
                                 "biases, C/N0 weights, RAIM, a position filter, fewer "
                                 "than {} iterations or a convergence above {} m",
                                 receiver.name, kIterations, kConvergence_m),
                     "change these for a map, or run a receiver in each cell");
  }
  if ((receiver.ionosphere || receiver.fix.correct_ionosphere) && klobuchar.empty()) {
    static_cast<void>(positioning::klobuchar_of(klobuchar, gnss::System::GPS));
  }
}
CellSolver::~CellSolver() = default;
CellSolver::CellSolver(CellSolver&&) noexcept = default;
CellSolver& CellSolver::operator=(CellSolver&&) noexcept = default;

void CellSolver::solve(const TileCells& cells, const TileSignals& signals, std::span<const Layer> wanted,
                       std::span<const std::span<float>> layers) const {
  assert(wanted.size() == layers.size());
  assert(signals.excess_m.size() == signals.satellites.size() ||
         !std::any_of(wanted.begin(), wanted.end(), of_error));
  TileCellSolver solver(impl_->receiver, impl_->draws, impl_->klobuchar, impl_->limits, cells, signals,
                        wanted);
  Block block;
  const std::size_t count = cells.state.size();
  for (std::size_t first = 0; first < count; first += kBlock) {
    const std::size_t in_block = std::min(kBlock, count - first);
    block.gather(signals, first, in_block);
    for (std::size_t b = 0; b < in_block; ++b) {
      const SatelliteSet received{{block.received[0][b], block.received[1][b]}};
      const SatelliteSet los{{block.los[0][b], block.los[1][b]}};
      solver.solve(first + b, received, los).store(wanted, layers, first + b);
    }
  }
}

}  // namespace canyon::heatmap
