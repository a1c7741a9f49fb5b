#include "canyon/validation/signal_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "canyon/gnss/signals.hpp"
#include "canyon/positioning/least_squares.hpp"
#include "canyon/positioning/positioning_options.hpp"
#include "canyon/validation/ranked_sample.hpp"
#include "canyon/validation/statistics.hpp"

namespace canyon::validation {
namespace {

/// One receiver's phases of one signal.
struct PhaseSample {
  std::array<std::size_t, 2> observations{}, with_phase{};
  std::size_t slips = 0;
  ByView noise;  ///< magnitudes [m]

  [[nodiscard]] PhaseFigures figures(double interval_s) const {
    const auto view = [this](std::size_t v) {
      PhaseView result{observations[v], with_phase[v], {}, noise.of[v].size()};
      if (const auto middle = median(noise.of[v])) result.noise_m = kMadToSigma * *middle;
      return result;
    };
    return {view(0), view(1), slips, static_cast<double>(with_phase[0] + with_phase[1]) * interval_s};
  }
};
using PhaseSamples = std::map<const gnss::Signal*, PhaseSample>;

/// Follows the phases of one receiver from epoch to epoch.
class PhaseWalk {
 public:
  PhaseWalk(double interval_s, PhaseSamples& samples) : interval_s_(interval_s), samples_(samples) {}

  void begin(geodesy::GpsTime time) {
    ++epoch_;
    step_s_ = time - time_;
    time_ = time;
    thirds_.clear();
  }

  /// One signal that has a pseudorange.
  void observe(const ComparedSatellite& satellite, const gnss::Signal* signal, bool nlos,
               const ComparedPhase& phase, const std::optional<double>& cn0_dbhz) {
    PhaseSample& sample = samples_[signal];
    ++sample.observations[nlos ? 1 : 0];
    if (!phase.residual_m) return;
    ++sample.with_phase[nlos ? 1 : 0];
    const auto [at, fresh] = arcs_.try_emplace({satellite.id, signal});
    Arc& arc = at->second;
    const bool continues = !fresh && arc.epoch + 1 == epoch_ && !phase.slip;
    if (!fresh && !continues) ++sample.slips;
    // Receivers' clocks drift, and their tags with them, by less than that in any interval.
    constexpr double kEven = 0.01;
    const bool even = std::abs(step_s_ - interval_s_) < kEven * interval_s_;
    arc.length = continues && even ? arc.length + 1 : 1;
    arc.epoch = epoch_;
    std::rotate(arc.last.begin(), arc.last.begin() + 3, arc.last.end());
    arc.last[0] = *phase.residual_m;
    if (arc.length < arc.last.size()) return;
    const double third = arc.last[0] - 3 * arc.last[1] + 3 * arc.last[2] - arc.last[3];
    const double azimuth = satellite.azimuth_rad, elevation = satellite.elevation_rad;
    const Eigen::Vector3d direction(std::sin(azimuth) * std::cos(elevation),
                                    std::cos(azimuth) * std::cos(elevation), std::sin(elevation));
    thirds_.push_back({third, std::pow(10, cn0_dbhz.value_or(positioning::kUnknownCn0_dbhz) / 10), direction,
                       nlos, &sample});
  }

  /// Takes off what this epoch's third differences share (PhaseView::noise_m).
  void end() {
    constexpr std::size_t kFewest = 7;
    constexpr int kIterations = 10;
    constexpr double kHuber = 1.345;  // as ClockOptions::huber
    if (thirds_.size() < kFewest) return;
    const auto n = static_cast<Eigen::Index>(thirds_.size());
    Eigen::MatrixXd design(n, 4);
    Eigen::VectorXd weight(n), weighted(n), factor(n), room = Eigen::VectorXd::Ones(n);
    std::vector<double> values;
    for (const Third& d : thirds_) values.push_back(d.value_m);
    const double middle = *median(values);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Third& d = thirds_[static_cast<std::size_t>(i)];
      weight[i] = std::sqrt(d.cn0_hz);
      weighted[i] = weight[i] * (d.value_m - middle);
      design.row(i) << weight[i], weight[i] * d.direction.transpose();
    }
    // The projection takes rank as it comes: few satellites, many signals.
    Eigen::VectorXd rest = weighted;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      for (Eigen::Index i = 0; i < n; ++i) {
        values[static_cast<std::size_t>(i)] = std::abs(rest[i]) / std::max(room[i], kLeastRoom);
      }
      const double limit = kHuber * kMadToSigma * *median(values);
      for (Eigen::Index i = 0; i < n; ++i) {
        const double value = values[static_cast<std::size_t>(i)];
        factor[i] = value <= limit ? 1 : std::sqrt(limit / value);
      }
      const positioning::LeastSquares least_squares(factor.asDiagonal() * design);
      rest = weighted - design * least_squares.solve(factor.cwiseProduct(weighted));
      room = (1 - least_squares.leverages().array()).max(0).sqrt();
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      const Third& d = thirds_[static_cast<std::size_t>(i)];
      if (room[i] < kLeastRoom) continue;
      d.sample->noise.add(d.nlos, std::abs(rest[i]) / (weight[i] * room[i] * std::sqrt(20.0)));
    }
  }

 private:
  struct Arc {
    std::size_t epoch = 0;         ///< the last one with a phase
    std::size_t length = 0;        ///< epochs of one interval without a slip up to there
    std::array<double, 4> last{};  ///< the newest first [m]
  };
  struct Third {
    double value_m, cn0_hz;
    Eigen::Vector3d direction;  ///< ENU, unit, to the satellite
    bool nlos;
    PhaseSample* sample;
  };
  /// A value that the estimate follows closer than this tells nothing about noise.
  static constexpr double kLeastRoom = 0.3;

  double interval_s_;
  PhaseSamples& samples_;
  std::size_t epoch_ = 0;
  geodesy::GpsTime time_;
  double step_s_ = 0;
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Arc> arcs_;
  std::vector<Third> thirds_;
};

template <typename Visit>
void each_signal(const ComparedSatellite& satellite, Visit visit) {
  visit(static_cast<const ComparedSignal&>(satellite));
  for (const ComparedSignal& s : satellite.more) visit(s);
}

}  // namespace

std::optional<double> PhaseView::share() const {
  if (observations == 0) return std::nullopt;
  return static_cast<double>(with_phase) / static_cast<double>(observations);
}

std::optional<double> PhaseFigures::time_between_slips_s() const {
  if (slips == 0) return std::nullopt;
  return time_s / static_cast<double>(slips);
}

std::string SignalFigures::name() const {
  return fmt::format("{} {}", gnss::name(signal->system), signal->name);
}

bool SignalFigures::first() const {
  return gnss::index_of(*signal) == 0;
}

void ObservationSample::add_measured(bool nlos, const ComparedSignal& s) {
  TrackedShare& share = tracked[nlos ? 1 : 0];
  ++share.satellites;
  if (s.measured) ++share.measured;
  if (!s.measured_error_m) return;
  error.add(nlos, *s.measured_error_m);
  if (s.measured_cn0_dbhz) cn0.add(nlos, *s.measured_cn0_dbhz);
}

void ObservationSample::add_simulated(bool nlos, const ComparedSignal& s) {
  if (!s.simulated) return;
  ++tracked[nlos ? 1 : 0].simulated;
  if (s.simulated_error_m) simulated_error.add(nlos, *s.simulated_error_m);
  if (s.simulated_cn0_dbhz) simulated_cn0.add(nlos, *s.simulated_cn0_dbhz);
}

void ObservationSample::write(ObservationFigures& to, std::size_t runs) const {
  to.tracked_los = tracked[0];
  to.tracked_nlos = tracked[1];
  for (TrackedShare* share : {&to.tracked_los, &to.tracked_nlos}) {
    share->simulated = static_cast<std::size_t>(
        std::lround(static_cast<double>(share->simulated) / static_cast<double>(runs)));
  }
  to.error_los_m = pair_of(error.los(), simulated_error.los());
  to.error_nlos_m = pair_of(error.nlos(), simulated_error.nlos());
  to.cn0_los_dbhz = pair_of(cn0.los(), simulated_cn0.los());
  to.cn0_nlos_dbhz = pair_of(cn0.nlos(), simulated_cn0.nlos());
}

std::vector<SignalFigures> signal_figures(const Comparison& comparison, std::size_t first, std::size_t count,
                                          std::span<const Comparison> runs) {
  std::vector<SignalFigures> result;
  const auto has = [](const std::vector<const gnss::Signal*>& list, const gnss::Signal* signal) {
    return std::find(list.begin(), list.end(), signal) != list.end();
  };
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      SignalFigures f;
      f.signal = &signal;
      f.recorded = has(comparison.recorded, &signal);
      f.tracked = has(comparison.tracked, &signal);
      if (f.recorded || f.tracked) result.push_back(f);
    }
  }
  if (result.empty()) return result;

  const double interval_s = interval_of(std::span(comparison.epochs).subspan(first, count));
  std::map<const gnss::Signal*, ObservationSample> samples;
  PhaseSamples measured_phases, simulated_phases;

  PhaseWalk measured(interval_s, measured_phases);
  for (std::size_t e = first; e < first + count; ++e) {
    const ComparedEpoch& epoch = comparison.epochs[e];
    measured.begin(epoch.time);
    for (std::size_t i = epoch.first; i < epoch.first + epoch.count; ++i) {
      const ComparedSatellite& satellite = comparison.satellites[i];
      const bool nlos = !satellite.clear;
      each_signal(satellite, [&](const ComparedSignal& s) {
        samples[s.signal].add_measured(nlos, s);
        if (s.measured) measured.observe(satellite, s.signal, nlos, s.measured_phase, s.measured_cn0_dbhz);
      });
    }
    measured.end();
  }
  for (const Comparison& run : runs) {
    PhaseWalk simulated(interval_s, simulated_phases);
    for (std::size_t e = first; e < first + count; ++e) {
      const ComparedEpoch& epoch = comparison.epochs[e];
      simulated.begin(epoch.time);
      for (std::size_t i = epoch.first; i < epoch.first + epoch.count; ++i) {
        const bool nlos = !comparison.satellites[i].clear;
        each_signal(run.satellites[i], [&](const ComparedSignal& s) {
          if (!s.simulated) return;
          samples[s.signal].add_simulated(nlos, s);
          simulated.observe(run.satellites[i], s.signal, nlos, s.simulated_phase, s.simulated_cn0_dbhz);
        });
      }
      simulated.end();
    }
  }

  for (SignalFigures& f : result) {
    if (!f.judged()) continue;
    samples[f.signal].write(f, runs.size());
    f.measured_phase = measured_phases[f.signal].figures(interval_s);
    f.simulated_phase = simulated_phases[f.signal].figures(interval_s);
  }
  return result;
}

}  // namespace canyon::validation
