#include "canyon/heatmap/cells/cell_solver.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/heatmap/cells/cell_solution.hpp"
#include "canyon/options/values.hpp"

namespace canyon::heatmap {
namespace {

using positioning::Weighting;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
/// Shared solutions are iterated until they converge. positioning::solve_fix() does so within these bounds:
/// the last change, times what a metre changes in the atmosphere (6e-3 at 3 deg) and PDOP 100, is below 1 mm.
constexpr int kIterations = 20;
constexpr double kConvergence_m = 1e-3;
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

using Values = std::array<float, kLayerCount>;
float& at(Values& values, Layer layer) {
  return values[static_cast<std::size_t>(layer)];
}

/// Mean, RMS, p50 and p95, which follow one another in Layer.
void describe(std::vector<double>& errors, Layer mean, bool quantiles, Values& values) {
  double sum = 0, squares = 0;
  for (const double error : errors) {
    sum += error;
    squares += error * error;
  }
  const auto n = static_cast<double>(errors.size());
  const auto first = static_cast<std::size_t>(mean);
  values[first] = static_cast<float>(sum / n);
  values[first + 1] = static_cast<float>(std::sqrt(squares / n));
  if (!quantiles) return;
  std::size_t ranked = 0;
  values[first + 2] = static_cast<float>(select_quantile(errors, 0.5, ranked));
  values[first + 3] = static_cast<float>(select_quantile(errors, 0.95, ranked));
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

}  // namespace

void DrawOptions::validate() const {
  options::check(*this, "map's noise");
}

void visit(options::Visitor& v, DrawOptions& o) {
  v.integer({"draws", "", "of noise, for layers over draws"}, o.draws, 1, 10'000);
  v.integer({"seed", "", "of the draws, the same at every cell"}, o.seed);
}

void CellReceiverOptions::validate() const {
  options::check(*this, "map's receivers");
}

void visit(options::Visitor& v, CellReceiverOptions& o) {
  // Before it was steady_state, users wrote "settled": it is read still, and keys of stores keep it.
  static constexpr std::string_view kRead[]{"steady_state", "run", "settled"}, kInKeys[]{"settled", "run"};
  const std::span<const std::string_view> read(kRead), in_keys(kInKeys);
  v.choice(
      {"model", "",
       "receivers whose signals have strength: steady_state (of loops and fixes, computed) or run (each by "
       "itself, slow)"},
      o.model, v.purpose() == options::Purpose::Values ? in_keys : read.first(v.reads() ? 3 : 2));
  if (o.model == static_cast<ReceiverModel>(2)) o.model = ReceiverModel::SteadyState;
  v.number({"path_nodes_m", "m",
            "steady_state: paths are searched so far apart and constructed anew between; 0: at every cell"},
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
  if (!fits(receiver)) {
    throw InputError(fmt::format("receiver '{}' has signals of its own choice, signals of some strength, "
                                 "biases, C/N0 weights, RAIM, a position filter, fewer "
                                 "than {} iterations or a convergence above {} m",
                                 receiver.name, kIterations, kConvergence_m),
                     "change these for a map, or let a receiver of its own observe each cell");
  }
  if ((receiver.ionosphere || receiver.fix.correct_ionosphere) && klobuchar.empty()) {
    static_cast<void>(positioning::klobuchar_of(klobuchar, gnss::System::GPS));
  }
}
CellSolver::~CellSolver() = default;
CellSolver::CellSolver(CellSolver&&) noexcept = default;
CellSolver& CellSolver::operator=(CellSolver&&) noexcept = default;

bool CellSolver::fits(const receiver::ReceiverOptions& receiver) {
  const auto same = [](const auto& a, const auto& b) {
    return options::exact_text(a) == options::exact_text(b);
  };
  return receiver.tracks.empty() && receiver.leaves_out.empty() &&
         same(receiver.ranging, receiver::RangingOptions()) &&
         same(receiver.biases, receiver::BiasOptions()) && !receiver.signal.enabled &&
         !receiver.filter.enabled && !receiver.fix.raim.enabled &&
         receiver.fix.weights.weighting != Weighting::Cn0 && receiver.fix.max_iterations >= kIterations &&
         receiver.fix.convergence_m <= kConvergence_m;
}

void CellSolver::solve(const TileCells& cells, const TileSignals& signals, std::span<const Layer> wanted,
                       std::span<const std::span<float>> layers) const {
  assert(wanted.size() == layers.size());
  const auto any = [&](bool (*kind)(Layer)) { return std::any_of(wanted.begin(), wanted.end(), kind); };
  const bool fixes = any(of_fix), draws = any(over_draws);
  const auto is_wanted = [&](Layer layer) {
    return std::find(wanted.begin(), wanted.end(), layer) != wanted.end();
  };
  const bool horizontal_quantiles =
      is_wanted(Layer::HorizontalErrorP50) || is_wanted(Layer::HorizontalErrorP95);
  const bool vertical_quantiles = is_wanted(Layer::VerticalErrorP50) || is_wanted(Layer::VerticalErrorP95);
  [[maybe_unused]] const bool excess = signals.excess_m.size() == signals.satellites.size();
  assert(excess || !any(of_error));
  const bool excesses = !signals.excess_m.empty();

  TileSolutions solutions(impl_->receiver, impl_->klobuchar, signals, draws ? impl_->draws.draws : 0,
                          impl_->draws.seed);
  const Eigen::Matrix3d& enu_from_city = solutions.enu_from_city();
  const int satellites = static_cast<int>(signals.satellites.size());
  const CellPlane& plane = cells.plane;

  // Before quantiles put the errors in another order.
  const auto compare = [this](const std::vector<double>& errors_m, double spread_m, Values& values) {
    const LimitOptions& limits = impl_->limits;
    const double protection_m = limits.protection_factor * spread_m;
    const auto share_above = [&](double limit_m) {
      const auto above = std::count_if(errors_m.begin(), errors_m.end(),
                                       [limit_m](double error_m) { return error_m > limit_m; });
      return static_cast<float>(above) / static_cast<float>(errors_m.size());
    };
    at(values, Layer::HorizontalErrorExceedance) = share_above(limits.error_m);
    at(values, Layer::MisleadingShare) = share_above(protection_m);
    if (protection_m <= limits.alert_m) {
      at(values, Layer::ProtectedAvailability) =
          static_cast<float>(errors_m.size()) / static_cast<float>(impl_->draws.draws);
    }
  };
  Block block;
  CellErrors cell;
  std::vector<double> horizontal, vertical;
  Values values;
  const std::size_t count = cells.state.size();
  for (std::size_t first = 0; first < count; first += kBlock) {
    const std::size_t in_block = std::min(kBlock, count - first);
    block.gather(signals, first, in_block);
    for (std::size_t b = 0; b < in_block; ++b) {
      const std::size_t index = first + b;
      values.fill(kNone);
      if (cells.state[index] == CellState::Computed) {
        SatelliteSet los;
        cell.received.bits = {block.received[0][b], block.received[1][b]};
        los.bits = {block.los[0][b], block.los[1][b]};
        const int visible = cell.received.size(), direct = los.size();
        cell.excesses = 0;
        // In line of sight there is none.
        double largest = direct > 0 ? 0 : -std::numeric_limits<double>::infinity();
        if (excesses) {
          SatelliteSet nlos;
          for (std::size_t w = 0; w < 2; ++w) nlos.bits[w] = cell.received.bits[w] & ~los.bits[w];
          nlos.for_each([&](std::size_t i) {
            const double excess_m = signals.excess_m[i][index];
            largest = std::max(largest, excess_m);
            if (excess_m == 0) return;
            const auto k = static_cast<std::size_t>(cell.excesses++);
            cell.satellite[k] = static_cast<std::uint8_t>(i);
            cell.excess_m[k] = excess_m;
          });
        }
        at(values, Layer::SatellitesLos) = static_cast<float>(direct);
        at(values, Layer::SatellitesVisible) = static_cast<float>(visible);
        at(values, Layer::SatellitesBlocked) = static_cast<float>(satellites - visible);
        if (visible > 0) {
          at(values, Layer::NlosShare) = static_cast<float>(visible - direct) / static_cast<float>(visible);
          if (excesses) at(values, Layer::LargestExcess) = static_cast<float>(largest);
        }
        if (fixes) {
          solutions.trim();
          constexpr double kSpeed_mps = 0;
          cell.received.drifting = impl_->receiver.noise.drifts(kSpeed_mps, direct);
          // From the tile's centre, where directions are from.
          const double column = static_cast<double>(index % plane.columns) - 0.5 * (plane.columns - 1);
          const std::size_t northward = index / plane.columns;
          const double row = static_cast<double>(northward) - 0.5 * (plane.rows - 1);
          const double up = cells.flat() ? 0 : double{cells.z[index]} - plane.z;
          cell.place = enu_from_city * Eigen::Vector3d(column * plane.spacing_m, row * plane.spacing_m, up);
          const std::optional<CellFix> fix = solutions.locate(cell);
          at(values, Layer::Availability) = fix ? 1 : 0;
          at(values, Layer::SatellitesUsed) = fix ? static_cast<float>(fix->used) : 0;
          if (fix) {
            const Eigen::Vector3d error = solutions.at_vertical(cell.place, fix->error);
            at(values, Layer::HorizontalError) = static_cast<float>(error.head<2>().norm());
            at(values, Layer::VerticalError) = static_cast<float>(error.z());
            at(values, Layer::Hdop) = static_cast<float>(fix->dop.hdop);
            at(values, Layer::Pdop) = static_cast<float>(fix->dop.pdop);
            at(values, Layer::Vdop) = static_cast<float>(fix->dop.vdop);
            at(values, Layer::ProtectionLevel) =
                static_cast<float>(impl_->limits.protection_factor * fix->spread_m);
          }
          if (draws) at(values, Layer::ProtectedAvailability) = 0;
          if (fix && draws) {
            solutions.locate_draws(cell, *fix, horizontal, vertical);
            if (!horizontal.empty()) {
              compare(horizontal, fix->spread_m, values);
              describe(horizontal, Layer::HorizontalErrorMean, horizontal_quantiles, values);
              describe(vertical, Layer::VerticalErrorMean, vertical_quantiles, values);
            }
          }
        }
      }
      for (std::size_t k = 0; k < wanted.size(); ++k) {
        if (of_solver(wanted[k])) layers[k][index] = values[static_cast<std::size_t>(wanted[k])];
      }
    }
  }
}

}  // namespace canyon::heatmap
