#include "canyon/analysis/heatmap/cells/shared_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "canyon/analysis/heatmap/cells/cell_fix.hpp"
#include "canyon/analysis/heatmap/cells/cell_values.hpp"
#include "canyon/analysis/heatmap/cells/receiver_realizations.hpp"
#include "canyon/base/arithmetic.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/random.hpp"
#include "canyon/receiver/random_streams.hpp"
#include "canyon/receiver/receiver_options.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMaxSatellites = 128;
/// Maximum number of solutions that a tile caches, to limit memory.
constexpr std::size_t kMaxSets = 4096;
/// Cells whose satellites are gathered at once: their bits fit the first-level cache.
constexpr std::size_t kBlock = 512;

bool needs_fix(Layer layer) {
  return info(layer).error && is_solver_layer(layer);
}

/// Satellites of a tile by their index, below kMaxSatellites.
struct SatelliteSet {
  std::array<std::uint64_t, 2> bits{};
  bool drifting = false;  ///< the noise's mean drifts if these are received

  [[nodiscard]] int size() const { return std::popcount(bits[0]) + std::popcount(bits[1]); }
  [[nodiscard]] bool operator==(const SatelliteSet&) const = default;
  /// Calls f(index), ascending.
  template <class F>
  void for_each(F&& f) const {
    for (std::size_t word = 0; word < 2; ++word)
      for (std::uint64_t left = bits[word]; left != 0; left &= left - 1)
        f(word * 64 + static_cast<std::size_t>(std::countr_zero(left)));
  }
};
struct HashOfSet {
  std::size_t operator()(const SatelliteSet& set) const {
    const std::uint64_t drifting = set.drifting ? 1 : 0;
    return static_cast<std::size_t>(mix64(set.bits[0] + kGolden64 * (set.bits[1] + drifting + 1)));
  }
};

/// Received satellites and those in line of sight, of a block of cells: two words each.
struct Block {
  std::array<std::array<std::uint64_t, kBlock>, 2> received, los;

  void gather(const TileSignals& signals, std::size_t first, std::size_t count) {
    for (auto* words : {&received, &los})
      for (auto& word : *words) word.fill(0);
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

/// Fix of one set of received satellites without excess.
struct SetSolution {
  CellFix::CellSolution fix;
  std::vector<Vector3d> gains;  ///< [satellite] position error per metre of pseudorange error; 0: not used
  std::vector<double> noise;    ///< [axis][realization] position error by noise
};

/// Lengths of a fix's total error (error plus noise), for all realizations. @param noise [axis][realization]
CANYON_CLONES void measure(const double* error, const double* noise, std::size_t sample_count,
                           double* horizontal_m, double* vertical_m) {
  for (std::size_t draw = 0; draw < sample_count; ++draw) {
    const double east = error[0] + noise[draw], north = error[1] + noise[sample_count + draw];
    horizontal_m[draw] = std::sqrt(east * east + north * north);
    vertical_m[draw] = std::abs(error[2] + noise[2 * sample_count + draw]);
  }
}

/// A tile at one time: its solutions, and the values of the current cell.
class SharedTile {
 public:
  SharedTile(const SharedReceiver& receiver, const TileCells& cells, geodesy::GpsTime time,
             const TileSignals& signals, std::span<const Layer> wanted)
      : receiver_(receiver),
        cells_(cells),
        signals_(signals),
        samples_(std::any_of(wanted.begin(), wanted.end(), is_sample_layer)
                     ? static_cast<std::size_t>(receiver.samples.samples)
                     : 0),
        signals_wanted_(std::any_of(wanted.begin(), wanted.end(), needs_signals)),
        fixes_(std::any_of(wanted.begin(), wanted.end(), needs_fix)),
        errors_{receiver.options, receiver.klobuchar, time,
                signals.satellites.empty() ? geodesy::Geodetic() : seen_from(signals.satellites.front())},
        fix_(fix_satellites(signals.satellites, errors_.centre), receiver.options.fix) {
    if (signals.satellites.size() > kMaxSatellites) {
      throw InputError(fmt::format("{} satellites are above the mask at once, more than a map's {}",
                                   signals.satellites.size(), kMaxSatellites),
                       "leave satellite systems out, or increase the elevation mask");
    }
    const auto is_wanted = [&](Layer layer) {
      return std::find(wanted.begin(), wanted.end(), layer) != wanted.end();
    };
    horizontal_quantiles_ = is_wanted(Layer::HorizontalErrorP50) || is_wanted(Layer::HorizontalErrorP95);
    vertical_quantiles_ = is_wanted(Layer::VerticalErrorP50) || is_wanted(Layer::VerticalErrorP95);
    if (!fixes_) return;
    noise_m_.assign(2 * signals.satellites.size() * samples_, 0);
    std::vector<gnss::SatelliteId> ids;
    for (const orbit::LineOfSight& line : signals.satellites) ids.push_back(line.id);
    const auto space =
        range_errors_by_sample(receiver.space.get(), receiver.samples, time, static_cast<int>(samples_), ids);
    std::vector<sky::RangeErrorModel::Reception> receptions;
    for (const sky::RangeErrorModel& each : space)
      receptions.push_back(each.reception(time, geodesy::ecef_from_geodetic(errors_.centre)));
    for (const orbit::LineOfSight& line : signals.satellites) {
      const gnss::Signal* signal = errors_.signal_of(line.id);
      if (signal == nullptr) signal = &gnss::signals_of(line.id.system).front();
      ranges_.push_back(range_of(line, *signal));
      if (samples_ == 0) continue;
      draw_noise(ranges_.size() - 1, *signal);
      double* const own = noise_m_.data() + (ranges_.size() - 1) * samples_;
      const double carrier_hz = gnss::carrier_hz(*signal, line.state.carrier_frequency_hz);
      const double without_m = errors_.error_m({line, {}}, *signal, carrier_hz);
      for (std::size_t d = 0; d < space.size(); ++d) {
        propagation::SatelliteView view{line, {}};
        view.space = space[d].at(line, receptions[d]);
        own[d] += errors_.error_m(view, *signal, carrier_hz) - without_m;
      }
    }
  }

  /// All layers of a cell; NaN if it is not Computed.
  const CellValues& solve(std::size_t index, SatelliteSet received, const SatelliteSet& los) {
    values_ = CellValues();
    if (cells_.state[index] != CellState::Computed) return values_;
    if (!signals_wanted_) {
      values_.set(Layer::SatellitesLos, los.size());
      return values_;
    }
    const int visible = received.size(), direct = los.size();
    const bool excesses = !signals_.excess_m.empty();
    received.drifting = receiver_.options.noise.drifts(0, direct);
    const SetSolution* set = fixes_ ? &solution(received) : nullptr;
    const bool solved = set != nullptr && set->fix.solved;
    Vector3d error = solved ? set->fix.error : Vector3d::Zero();
    // A satellite in line of sight has no excess.
    double largest_m = direct > 0 ? 0 : -std::numeric_limits<double>::infinity();
    if (excesses) {
      const SatelliteSet nlos{{received.bits[0] & ~los.bits[0], received.bits[1] & ~los.bits[1]}};
      nlos.for_each([&](std::size_t i) {
        const double excess_m = signals_.excess_m[i][index];
        largest_m = std::max(largest_m, excess_m);
        if (solved) error += excess_m * set->gains[i];
      });
    }
    values_.set_satellites(direct, visible, static_cast<int>(signals_.satellites.size()) - visible,
                           visible - direct, excesses ? std::optional(largest_m) : std::nullopt);
    if (set != nullptr) locate(*set, error);
    return values_;
  }

 private:
  /// The fix without noise and those of the realizations.
  void locate(const SetSolution& set, const Vector3d& error) {
    values_.set(Layer::Availability, set.fix.solved ? 1 : 0);
    values_.set(Layer::SatellitesUsed, set.fix.used);
    if (samples_ > 0) values_.set(Layer::ProtectedAvailability, 0);
    if (!set.fix.solved) return;
    const double protection_m =
        positioning::horizontal_protection_level_m(set.fix.covariance, receiver_.limits.protection_factor);
    values_.set_fix(error, set.fix.dop, protection_m);
    if (samples_ == 0) return;
    sampled_.horizontal_m.resize(samples_);
    sampled_.vertical_m.resize(samples_);
    measure(error.data(), set.noise.data(), samples_, sampled_.horizontal_m.data(),
            sampled_.vertical_m.data());
    sampled_.protection_m.assign(samples_, protection_m);
    sampled_.describe(receiver_.limits, receiver_.samples.samples, values_, horizontal_quantiles_,
                      vertical_quantiles_);
  }

  const SetSolution& solution(const SatelliteSet& set) {
    // Neighbouring cells mostly receive the same satellites.
    if (last_ != nullptr && last_set_ == set) return *last_;
    if (sets_.size() >= kMaxSets) sets_.clear();
    const auto [found, made] = sets_.try_emplace(set);
    if (made) solve(set, found->second);
    last_set_ = set;
    last_ = &found->second;
    return *last_;
  }

  void solve(const SatelliteSet& set, SetSolution& solution) {
    std::vector<CellRange> ranges;
    set.for_each([&](std::size_t i) { ranges.push_back(ranges_[i]); });
    solution.fix = fix_.solve(ranges, true);
    if (!solution.fix.solved) return;
    solution.gains.assign(ranges_.size(), Vector3d::Zero());
    solution.noise.assign(3 * samples_, 0);
    for (const CellRange& range : ranges) {
      const Vector3d& gain = solution.gains[range.satellite] = fix_.gain(range);
      const double* code = noise_m_.data() + range.satellite * samples_;
      const double* drift = code + ranges_.size() * samples_;
      for (std::size_t draw = 0; draw < samples_; ++draw) {
        const double error_m = code[draw] + (set.drifting ? drift[draw] : 0);
        for (std::size_t axis = 0; axis < 3; ++axis)
          solution.noise[axis * samples_ + draw] += error_m * gain[static_cast<Eigen::Index>(axis)];
      }
    }
  }

  /// A satellite's pseudorange without excess and noise, with the noise's mean.
  [[nodiscard]] CellRange range_of(const orbit::LineOfSight& line, const gnss::Signal& signal) const {
    const receiver::ReceiverOptions& options = receiver_.options;
    double error_m =
        errors_.error_m({line, {}}, signal, gnss::carrier_hz(signal, line.state.carrier_frequency_hz)) +
        drift_m(0, signal);
    if (options.noise.enabled) error_m += options.noise.ou.mu_m;
    positioning::Measurement reported;
    reported.sigma_factor = errors_.sigma_factor(line.id, signal);
    const double noise_m = options.reported_noise_m();
    reported.sigma_m = (noise_m > 0 ? noise_m : 1) * reported.sigma_factor;
    return cell_range(ranges_.size(), error_m, reported, line.elevation_rad, options.fix.weights);
  }

  /// Drift of the receiver's delay in one realization.
  [[nodiscard]] double drift_m(std::size_t draw, const gnss::Signal& signal) const {
    if (receiver_.options.biases.drift_sigma_m == 0) return 0;
    const std::uint64_t seed = seed_of(receiver_.samples, errors_.time, static_cast<int>(draw));
    return receiver::bias_drift(receiver_.options, seed, signal).advance(0);
  }

  /// The receiver's noise of each realization, in addition to range_of().
  void draw_noise(std::size_t satellite, const gnss::Signal& signal) {
    const receiver::ReceiverOptions& options = receiver_.options;
    const receiver::NoiseOptions& noise = options.noise;
    const double sigma_m = noise.enabled ? noise.ou.standard_deviation_m() : 0;
    const std::string key = fmt::format("heatmap/{}/{}", gnss::to_string(signals_.satellites[satellite].id),
                                        errors_.time.nanoseconds());
    RandomStream code(receiver_.samples.seed, key + "/code"), mean(receiver_.samples.seed, key + "/mean");
    double* const own = noise_m_.data() + satellite * samples_;
    double* const drift = own + signals_.satellites.size() * samples_;
    for (std::size_t draw = 0; draw < samples_; ++draw) {
      own[draw] = sigma_m * code.normal() + drift_m(draw, signal) - drift_m(0, signal);
      if (noise.enabled && noise.drift_enabled)
        drift[draw] = receiver::NoiseOptions::kDriftMuSigma_m * mean.normal();
    }
  }

  const SharedReceiver& receiver_;
  const TileCells& cells_;
  const TileSignals& signals_;
  std::size_t samples_;
  bool signals_wanted_, fixes_, horizontal_quantiles_ = false, vertical_quantiles_ = false;
  TileErrors errors_;
  CellFix fix_;
  std::vector<CellRange> ranges_;  // [satellite] without excess and noise
  std::vector<double> noise_m_;    // [satellite][realization], and then the drift
  std::unordered_map<SatelliteSet, SetSolution, HashOfSet> sets_;
  SatelliteSet last_set_;
  const SetSolution* last_ = nullptr;
  SampledFixes sampled_;
  CellValues values_;
};

}  // namespace

void solve_shared(const SharedReceiver& receiver, const TileCells& cells, geodesy::GpsTime time,
                  const TileSignals& signals, std::span<const Layer> wanted,
                  std::span<const std::span<float>> layers) {
  assert(wanted.size() == layers.size());
  SharedTile tile(receiver, cells, time, signals, wanted);
  Block block;
  const std::size_t count = cells.state.size();
  for (std::size_t first = 0; first < count; first += kBlock) {
    const std::size_t in_block = std::min(kBlock, count - first);
    block.gather(signals, first, in_block);
    for (std::size_t b = 0; b < in_block; ++b) {
      const SatelliteSet received{{block.received[0][b], block.received[1][b]}};
      const SatelliteSet los{{block.los[0][b], block.los[1][b]}};
      tile.solve(first + b, received, los).store(wanted, layers, first + b);
    }
  }
}

}  // namespace canyon::heatmap
