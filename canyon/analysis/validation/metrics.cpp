#include "canyon/analysis/validation/metrics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>

#include "canyon/analysis/validation/key_metrics.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::validation {
namespace {

/// At kQuantiles.
std::array<double, 5> five_quantiles(std::span<const double> values) {
  std::array<double, 5> result = kNoQuantiles;
  if (values.empty()) return result;
  const std::vector<double> at = quantiles(values, kQuantiles);
  std::copy(at.begin(), at.end(), result.begin());
  return result;
}

DistributionPair pair_of(const std::vector<double>& measured, const std::vector<double>& simulated) {
  return {{{measured.size(), five_quantiles(measured)}, {simulated.size(), five_quantiles(simulated)}},
          kolmogorov_smirnov(measured, simulated)};
}

/// Sorted into LOS [0] and NLOS [1].
struct ByView {
  std::array<std::vector<double>, 2> of;
  void add(bool nlos, double value) { of[nlos ? 1 : 0].push_back(value); }
  [[nodiscard]] const std::vector<double>& los() const { return of[0]; }
  [[nodiscard]] const std::vector<double>& nlos() const { return of[1]; }
};

/// Observations of one signal by both receivers.
struct ObservationSample {
  std::array<TrackedFraction, 2> tracked;  ///< LOS, NLOS
  MeasuredAndSimulated<ByView> error, cn0;

  void add(Side side, bool nlos, const ComparedSignal& s) {
    TrackedFraction& weights = tracked[nlos ? 1 : 0];
    if (side == Side::Measured) ++weights.satellites;
    const ComparedObservation& o = s.of(side);
    if (!o.tracked) return;
    ++weights.of(side);
    if (o.error_m) error.of(side).add(nlos, *o.error_m);
    // Measured C/N0 count in epochs with a clock.
    if (o.cn0_dbhz && (o.error_m || side == Side::Simulated)) cn0.of(side).add(nlos, *o.cn0_dbhz);
  }
  /// @param runs number of runs of the simulated values
  void write(ObservationMetrics& to, std::size_t runs) const {
    to.tracked_los = tracked[0];
    to.tracked_nlos = tracked[1];
    for (TrackedFraction* weights : {&to.tracked_los, &to.tracked_nlos}) {
      weights->simulated = static_cast<std::size_t>(
          std::lround(static_cast<double>(weights->simulated) / static_cast<double>(runs)));
    }
    to.error_los_m = pair_of(error.measured.los(), error.simulated.los());
    to.error_nlos_m = pair_of(error.measured.nlos(), error.simulated.nlos());
    to.cn0_los_dbhz = pair_of(cn0.measured.los(), cn0.simulated.los());
    to.cn0_nlos_dbhz = pair_of(cn0.measured.nlos(), cn0.simulated.nlos());
  }
};

/// NLOS observations with a prediction of one kind.
struct ExplainedSample {
  std::vector<double> predicted, measured, difference;
  void add(double prediction_m, double error_m) {
    predicted.push_back(prediction_m);
    measured.push_back(error_m);
    difference.push_back(std::abs(error_m - prediction_m));
  }
  [[nodiscard]] Explained metrics(std::string kind, std::size_t nlos) const {
    Explained e;
    e.kind = std::move(kind);
    e.n = predicted.size();
    e.fraction = nlos > 0 ? static_cast<double>(e.n) / static_cast<double>(nlos) : 0;
    e.median_difference_m = median(difference);
    e.correlation = spearman(predicted, measured);
    return e;
  }
};

PositionMetrics position_metrics(std::span<const ComparedFix> fixes) {
  PositionMetrics p;
  p.epochs = fixes.size();
  std::vector<double> horizontal, vertical;
  double used = 0;
  for (const ComparedFix& f : fixes) {
    if (!f.solved) continue;
    ++p.fixes;
    used += f.used;
    horizontal.push_back(f.error_enu_m.head<2>().norm());
    vertical.push_back(std::abs(f.error_enu_m.z()));
    if (!(f.horizontal_sigma_m > 0 && f.vertical_sigma_m > 0)) continue;
    ++p.reported;
    for (std::size_t i = 0; i < 2; ++i) {
      const auto deviations = static_cast<double>(i + 1);
      p.horizontal_within.at(i) += horizontal.back() <= deviations * f.horizontal_sigma_m ? 1 : 0;
      p.vertical_within.at(i) += vertical.back() <= deviations * f.vertical_sigma_m ? 1 : 0;
    }
  }
  for (auto* fractions : {&p.horizontal_within, &p.vertical_within})
    for (double& fraction : *fractions) fraction /= static_cast<double>(std::max<std::size_t>(p.reported, 1));
  if (p.fixes > 0) p.mean_used = used / static_cast<double>(p.fixes);
  p.horizontal_m = five_quantiles(horizontal);
  p.vertical_m = five_quantiles(vertical);
  return p;
}

std::vector<std::vector<std::uint16_t>> stream_name(std::span<const ComparedEpoch> epochs,
                                                    const MetricOptions& options) {
  return time_block_bootstrap(epochs, options.block_s, options.resamples, options.seed);
}

/// 95 %; empty if half of the resamples or more have no value.
std::optional<Interval> bootstrap_interval_of(const std::vector<double>& values, std::size_t sample_count) {
  if (2 * values.size() <= sample_count) return {};
  const std::vector<double> ends = quantiles(values, std::array{0.025, 0.975});
  return Interval{ends[0], ends[1]};
}

/// One receiver's phases of one signal.
struct PhaseSample {
  std::array<std::size_t, 2> observations{}, with_phase{};
  std::size_t slips = 0;
  ByView noise;  ///< magnitudes [m]

  [[nodiscard]] PhaseMetrics metrics(double interval_s) const {
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
               const ComparedObservation& observation) {
    const ComparedPhase& phase = observation.phase;
    PhaseSample& sample = samples_[signal];
    ++sample.observations[nlos ? 1 : 0];
    if (!phase.residual_m) return;
    ++sample.with_phase[nlos ? 1 : 0];
    const auto [at, fresh] = arcs_.try_emplace({satellite.id, signal});
    Arc& arc = at->second;
    const bool continues = !fresh && arc.epoch + 1 == epoch_ && !phase.slip;
    if (!fresh && !continues) ++sample.slips;
    // Receivers' clocks, and so their tags, drift by less than this fraction of any interval.
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
    const double cn0_dbhz = observation.cn0_dbhz.value_or(positioning::kUnknownCn0_dbhz);
    thirds_.push_back({third, std::pow(10, cn0_dbhz / 10), direction, nlos, &sample});
  }

  /// Removes the common part of this epoch's third differences (PhaseView::noise_m).
  void end() {
    constexpr std::size_t kMin = 7;
    constexpr int kIterations = 10;
    constexpr double kHuber = 1.345;  // as ReceiverClockOptions::huber
    if (thirds_.size() < kMin) return;
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
    // The projection handles any rank: few satellites, many signals.
    Eigen::VectorXd rest = weighted;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      for (Eigen::Index i = 0; i < n; ++i)
        values[static_cast<std::size_t>(i)] = std::abs(rest[i]) / std::max(room[i], kMinRoom);
      const double limit = kHuber * kMadToSigma * *median(values);
      for (Eigen::Index i = 0; i < n; ++i) {
        const double value = values[static_cast<std::size_t>(i)];
        factor[i] = value <= limit ? 1 : std::sqrt(limit / value);
      }
      const positioning::LeastSquaresOfAnySize least_squares(factor.asDiagonal() * design);
      rest = weighted - design * least_squares.solve(factor.cwiseProduct(weighted));
      room = (1 - least_squares.leverages().array()).max(0).sqrt();
    }
    for (Eigen::Index i = 0; i < n; ++i) {
      const Third& d = thirds_[static_cast<std::size_t>(i)];
      if (room[i] < kMinRoom) continue;
      d.sample->noise.add(d.nlos, std::abs(rest[i]) / (weight[i] * room[i] * std::sqrt(20.0)));
    }
  }

 private:
  struct Arc {
    std::size_t epoch = 0;         ///< the last one with a phase
    std::size_t length = 0;        ///< epochs of one interval without a slip up to this one
    std::array<double, 4> last{};  ///< the newest first [m]
  };
  struct Third {
    double value_m, cn0_hz;
    Eigen::Vector3d direction;  ///< ENU, unit, to the satellite
    bool nlos;
    PhaseSample* sample;
  };
  /// A value with less redundancy than this contains no information on noise.
  static constexpr double kMinRoom = 0.3;

  double interval_s_;
  PhaseSamples& samples_;
  std::size_t epoch_ = 0;
  geodesy::GpsTime time_;
  double step_s_ = 0;
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Arc> arcs_;
  std::vector<Third> thirds_;
};

/// Metrics of every signal of a comparison's epochs [first, first + count), with the simulated values of
/// `runs` (not empty).
std::vector<SignalMetrics> signal_metrics(const Comparison& comparison, std::size_t first, std::size_t count,
                                          std::span<const Comparison> runs) {
  std::vector<SignalMetrics> result;
  const auto has = [](const std::vector<const gnss::Signal*>& list, const gnss::Signal* signal) {
    return std::find(list.begin(), list.end(), signal) != list.end();
  };
  for (const gnss::System system : gnss::kAllSystems) {
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      SignalMetrics f;
      f.signal = &signal;
      f.recorded = has(comparison.recorded, &signal);
      f.tracked = has(comparison.tracked, &signal);
      if (f.recorded || f.tracked) result.push_back(f);
    }
  }
  if (result.empty()) return result;

  const double interval_s = interval_of(std::span(comparison.epochs).subspan(first, count));
  std::map<const gnss::Signal*, ObservationSample> samples;
  MeasuredAndSimulated<PhaseSamples> phases;
  const auto walk = [&](Side side, const Comparison& run) {
    PhaseWalk along(interval_s, phases.of(side));
    for (std::size_t e = first; e < first + count; ++e) {
      const ComparedEpoch& epoch = comparison.epochs[e];
      along.begin(epoch.time);
      for (std::size_t i = epoch.first; i < epoch.first + epoch.count; ++i) {
        const ComparedSatellite& satellite = run.satellites[i];
        const bool nlos = !comparison.satellites[i].clear;
        const auto observe = [&](const ComparedSignal& s) {
          samples[s.signal].add(side, nlos, s);
          if (s.of(side).tracked) along.observe(satellite, s.signal, nlos, s.of(side));
        };
        observe(satellite);
        for (const ComparedSignal& s : satellite.more) observe(s);
      }
      along.end();
    }
  };
  walk(Side::Measured, comparison);
  for (const Comparison& run : runs) walk(Side::Simulated, run);

  for (SignalMetrics& f : result) {
    if (!f.judged()) continue;
    samples[f.signal].write(f, runs.size());
    for (const Side side : kSides) f.phase.of(side) = phases.of(side)[f.signal].metrics(interval_s);
  }
  return result;
}

/// Observations of a part of a comparison, sorted for the metrics.
class Collector {
 public:
  /// @param times weight of each epoch; empty: 1
  Collector(const Comparison& comparison, std::size_t first, std::size_t count,
            std::span<const Comparison> runs, std::span<const std::uint16_t> times = {})
      : comparison_(comparison),
        epochs_(std::span<const ComparedEpoch>(comparison.epochs).subspan(first, count)),
        first_(first),
        runs_(runs.empty() ? std::span<const Comparison>(&comparison, 1) : runs),
        times_(times) {
    assert(std::all_of(runs_.begin(), runs_.end(), [&comparison](const Comparison& run) {
      return run.epochs.size() == comparison.epochs.size() &&
             run.satellites.size() == comparison.satellites.size();
    }));
    for (std::size_t e = 0; e < epochs_.size(); ++e) {
      for (std::uint16_t time = 0; time < times_of(e); ++time) {
        count_tracked(epochs_[e]);
        for (std::size_t i = epochs_[e].first; i < epochs_[e].first + epochs_[e].count; ++i) {
          add_measured(comparison.satellites[i], static_cast<std::uint32_t>(e));
          for (const Comparison& run : runs_)
            sample_.add(Side::Simulated, !comparison.satellites[i].clear, run.satellites[i]);
        }
      }
    }
    for (const Side side : kSides) {
      for (const ComparedFix& fix : fixes(&ComparedEpoch::fix, side, first, count))
        if (fix.solved) used_.of(side).push_back(fix.used);
    }
  }

  [[nodiscard]] ModelMetrics metrics(const MetricOptions& options) const {
    ModelMetrics f = headline_metrics();
    f.by_cn0 = separation(weakness_.nlos(), weakness_.los());
    f.by_error = separation(sample_.error.measured.nlos(), sample_.error.measured.los());
    f.bands = bands_;
    for (std::size_t b = 0; b < f.bands.size(); ++b) {
      f.bands[b].by_cn0 = separation(band_weakness_[b].nlos(), band_weakness_[b].los());
      f.bands[b].by_error = separation(band_error_[b].nlos(), band_error_[b].los());
    }
    add_segments(f);
    f.signals = signal_metrics(comparison_, first_, epochs_.size(), runs_);
    if (options.resamples > 0) add_intervals(f, options);
    return f;
  }

  /// The metrics among the key metrics.
  [[nodiscard]] ModelMetrics headline_metrics() const {
    ModelMetrics f;
    f.epochs = epochs_.size();
    f.runs = runs_.size();
    f.los = sample_.error.measured.los().size();
    f.nlos = sample_.error.measured.nlos().size();
    sample_.write(f, runs_.size());
    for (std::size_t k = 0; k < kinds_.size(); ++k)
      f.explained.push_back(explained_[k].metrics(kinds_[k], f.nlos));
    f.used = pair_of(used_.measured, used_.simulated);
    f.tracked_over_time = spearman(tracked_.measured, tracked_.simulated);
    f.position = positions(&ComparedEpoch::fix, first_, epochs_.size());
    if (comparison_.filtered) f.filtered = positions(&ComparedEpoch::filter, first_, epochs_.size());
    return f;
  }

 private:
  /// Weight of epochs_[e].
  [[nodiscard]] std::uint16_t times_of(std::size_t e) const { return times_.empty() ? 1 : times_[e]; }

  void add_measured(const ComparedSatellite& s, std::uint32_t epoch) {
    const bool nlos = !s.clear;
    sample_.add(Side::Measured, nlos, s);
    if (!s.measured.error_m) return;
    const double error_m = *s.measured.error_m;
    const std::size_t b = band(geodesy::degrees(s.elevation_rad));
    ranked_error_.push_back({error_m, nlos, epoch});
    if (b < bands_.size()) {
      ++(nlos ? bands_[b].nlos : bands_[b].los);
      band_error_[b].add(nlos, error_m);
    }
    if (s.measured.cn0_dbhz) {
      const double weakness = -*s.measured.cn0_dbhz;
      weakness_.add(nlos, weakness);
      ranked_weakness_.push_back({weakness, nlos, epoch});
      if (b < bands_.size()) band_weakness_[b].add(nlos, weakness);
    }
    if (nlos && s.prediction) {
      const std::string kind = path_words(*s.prediction);
      const auto known = std::find(kinds_.begin(), kinds_.end(), kind);
      assert(known != kinds_.end());
      explained_[static_cast<std::size_t>(known - kinds_.begin())].add(s.prediction->excess_m, error_m);
      explained_.back().add(s.prediction->excess_m, error_m);
    }
  }

  void count_tracked(const ComparedEpoch& epoch) {
    const auto count = [&epoch](const Comparison& of, Side side) {
      const auto begin = of.satellites.begin() + static_cast<std::ptrdiff_t>(epoch.first);
      return std::count_if(begin, begin + static_cast<std::ptrdiff_t>(epoch.count),
                           [side](const ComparedSatellite& s) { return s.of(side).tracked; });
    };
    const auto measured = count(comparison_, Side::Measured);
    for (const Comparison& run : runs_) {
      const auto simulated = count(run, Side::Simulated);
      if (measured == 0 || simulated == 0) continue;
      tracked_.measured.push_back(static_cast<double>(measured));
      tracked_.simulated.push_back(static_cast<double>(simulated));
    }
  }

  /// bands_.size(): none.
  [[nodiscard]] std::size_t band(double elevation_deg) const {
    std::size_t b = 0;
    while (b < bands_.size() && !(elevation_deg >= bands_[b].low_deg &&
                                  (elevation_deg < bands_[b].high_deg || bands_[b].high_deg >= 90)))
      ++b;
    return b;
  }

  void add_segments(ModelMetrics& f) const {
    constexpr std::size_t kMin = 10;
    std::size_t street = 0;
    for (const StreetSegment& whole : comparison_.segments) {
      ++street;
      StreetSegment segment = whole;
      segment.first = std::max(whole.first, first_);
      const std::size_t end = std::min(whole.first + whole.count, first_ + epochs_.size());
      if (end < segment.first + kMin) continue;
      segment.count = end - segment.first;
      segment.length_m = 0;
      for (std::size_t e = segment.first + 1; e < end; ++e) {
        segment.length_m += (comparison_.epochs[e].position_enu_m - comparison_.epochs[e - 1].position_enu_m)
                                .head<2>()
                                .norm();
      }
      f.segments.push_back({street, segment, positions(&ComparedEpoch::fix, segment.first, segment.count)});
    }
  }

  /// One kind of fix of the comparisons' epochs [first, first + count).
  using FixKind = MeasuredAndSimulated<ComparedFix> ComparedEpoch::*;
  [[nodiscard]] std::vector<ComparedFix> fixes(FixKind kind, Side side, std::size_t first,
                                               std::size_t count) const {
    std::vector<ComparedFix> all;
    for (const Comparison& one : side == Side::Measured ? std::span(&comparison_, 1) : runs_)
      for (std::size_t e = first; e < first + count; ++e)
        all.insert(all.end(), times_of(e - first_), (one.epochs[e].*kind).of(side));
    return all;
  }
  [[nodiscard]] MeasuredAndSimulated<PositionMetrics> positions(FixKind kind, std::size_t first,
                                                                std::size_t count) const {
    return {position_metrics(fixes(kind, Side::Measured, first, count)),
            position_metrics(fixes(kind, Side::Simulated, first, count))};
  }

  void add_intervals(ModelMetrics& f, const MetricOptions& options) const {
    const auto samples = stream_name(epochs_, options);
    const auto interval = [&samples](const std::vector<RankedSample::Item>& items) {
      const RankedSample sample(items);
      std::vector<double> values;
      for (const auto& times_sampled : samples)
        if (const auto auc = sample.auc(times_sampled)) values.push_back(*auc);
      return bootstrap_interval_of(values, samples.size());
    };
    f.by_cn0_interval = interval(ranked_weakness_);
    f.by_error_interval = interval(ranked_error_);
  }

  const Comparison& comparison_;
  std::span<const ComparedEpoch> epochs_;
  std::size_t first_;
  std::span<const Comparison> runs_;  ///< of the simulated values
  std::span<const std::uint16_t> times_;
  const std::array<std::string, 5> kinds_{"reflected 1", "reflected 2", "diffracted", "diffuse", "all"};
  std::array<ExplainedSample, 5> explained_;
  std::vector<Band> bands_{{10, 30, 0, 0, {}, {}}, {30, 50, 0, 0, {}, {}}, {50, 90, 0, 0, {}, {}}};
  std::array<ByView, 3> band_error_, band_weakness_;
  ObservationSample sample_;
  ByView weakness_;
  MeasuredAndSimulated<std::vector<double>> used_, tracked_;  ///< satellites of a fix, and of an epoch
  std::vector<RankedSample::Item> ranked_error_, ranked_weakness_;
};

}  // namespace

std::optional<double> TrackedFraction::ratio(Side side) const {
  if (satellites == 0) return std::nullopt;
  return static_cast<double>(of(side)) / static_cast<double>(satellites);
}

std::string path_words(const ComparedSatellite::Prediction& p) {
  return p.kind == propagation::PathKind::Reflected ? fmt::format("reflected {}", p.order)
                                                    : std::string(propagation::name(p.kind));
}

std::string describe_part(const Comparison& comparison, std::size_t first, std::size_t count,
                          const std::string& name) {
  assert(first + count <= comparison.epochs.size());
  if (count == 0) return name + ": no epoch";
  const auto time_of_day = [&comparison](std::size_t e) {
    const std::string text = geodesy::format_gpst(comparison.epochs[e].time, 0);
    const std::size_t t = text.find('T');
    return t == std::string::npos ? text : text.substr(t + 1, 8);
  };
  return fmt::format("{}: {} to {} GPST, {} epochs", name, time_of_day(first), time_of_day(first + count - 1),
                     count);
}

ModelMetrics metrics(const Comparison& comparison, std::size_t first, std::size_t count,
                     const std::string& part, const MetricOptions& options,
                     std::span<const Comparison> runs) {
  assert(first + count <= comparison.epochs.size());
  ModelMetrics f = Collector(comparison, first, count, runs).metrics(options);
  f.model = comparison.name;
  f.part = part;
  return f;
}

PositionMetrics reported_fix_metrics(const Recording& recording, const Comparison& comparison,
                                     std::size_t first, std::size_t count) {
  assert(first + count <= comparison.epochs.size());
  std::vector<ComparedFix> fixes;
  if (count > 0) {
    // Receivers round the time of a fix.
    constexpr double kRounded_s = 0.01;
    const geodesy::GpsTime begin = comparison.epochs[first].time,
                           end = comparison.epochs[first + count - 1].time;
    for (const Recording::ReportedFix& own : recording.reported_fixes) {
      if (own.time - begin < -kRounded_s || own.time - end > kRounded_s) continue;
      fixes.push_back({true, own.error_enu_m});
    }
  }
  PositionMetrics metrics = position_metrics(fixes);
  metrics.mean_used = std::numeric_limits<double>::quiet_NaN();
  return metrics;
}

std::vector<KeyMetric> key_metrics(const Comparison& comparison, std::size_t first, std::size_t count) {
  return key_metrics(Collector(comparison, first, count, {}).headline_metrics());
}

std::vector<KeyMetric> headlines_by_other_part(const Comparison& comparison, std::size_t first,
                                               std::size_t count, std::size_t other_first,
                                               std::size_t other_count) {
  const auto measured_headlines = [&comparison](std::size_t begin, std::size_t n) {
    return key_metrics(Collector(comparison, begin, n, {}).headline_metrics());
  };
  // Distances of distributions: measured values of one part, and those of the other as the simulated ones.
  Comparison both;
  const auto add = [&](std::size_t begin, std::size_t n, bool other) {
    for (std::size_t e = begin; e < begin + n; ++e) {
      const ComparedEpoch& epoch = comparison.epochs[e];
      ComparedEpoch& to = both.epochs.emplace_back();
      to.first = both.satellites.size();
      to.count = epoch.count;
      for (std::size_t i = epoch.first; i < epoch.first + epoch.count; ++i) {
        const ComparedSatellite& s = comparison.satellites[i];
        ComparedSatellite& copy = both.satellites.emplace_back();
        copy.clear = s.clear;
        copy.elevation_rad = s.elevation_rad;
        copy.of(other ? Side::Simulated : Side::Measured) = s.measured;
      }
    }
  };
  add(first, count, false);
  add(other_first, other_count, true);
  std::vector<KeyMetric> result = key_metrics(Collector(both, 0, both.epochs.size(), {}).headline_metrics());
  const std::vector<KeyMetric> own = measured_headlines(first, count),
                               other = measured_headlines(other_first, other_count);
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (!result[i].pair()) continue;
    result[i].measured = own[i].measured;
    result[i].simulated = other[i].measured;
  }
  return result;
}

void add_intervals(std::vector<KeyMetric>& headlines_of_all, const Comparison& comparison, std::size_t first,
                   std::size_t count, const MetricOptions& options, std::span<const Comparison> runs) {
  assert(first + count <= comparison.epochs.size());
  const auto samples =
      stream_name(std::span<const ComparedEpoch>(comparison.epochs).subspan(first, count), options);
  std::vector<std::array<std::vector<double>, 2>> values(headlines_of_all.size());
  for (const auto& times : samples) {
    const std::vector<KeyMetric> sampled =
        key_metrics(Collector(comparison, first, count, runs, times).headline_metrics());
    for (std::size_t k = 0; k < std::min(sampled.size(), values.size()); ++k) {
      if (sampled[k].measured) values[k][0].push_back(*sampled[k].measured);
      if (sampled[k].simulated) values[k][1].push_back(*sampled[k].simulated);
    }
  }
  for (std::size_t k = 0; k < values.size(); ++k) {
    headlines_of_all[k].measured_interval = bootstrap_interval_of(values[k][0], samples.size());
    headlines_of_all[k].simulated_interval = bootstrap_interval_of(values[k][1], samples.size());
  }
}

Pooled pool(std::span<const PooledPart> parts) {
  std::vector<double> intervals_s;
  std::size_t max_runs = 0;
  for (const PooledPart& part : parts) {
    assert(part.first + part.count <= part.comparison->epochs.size());
    intervals_s.push_back(interval_of(std::span(part.comparison->epochs).subspan(part.first, part.count)));
    max_runs = std::max(max_runs, part.runs.size());
  }
  const double step_s = intervals_s.empty() ? 0 : *std::max_element(intervals_s.begin(), intervals_s.end());
  Pooled pooled;
  pooled.runs.resize(max_runs);
  for (const PooledPart& part : parts) {
    std::optional<geodesy::GpsTime> taken;
    for (std::size_t e = part.first; e < part.first + part.count; ++e) {
      const geodesy::GpsTime time = part.comparison->epochs[e].time;
      // Receivers' clocks shift their tags by less than a tenth of any interval.
      if (taken && time - *taken < 0.9 * step_s) continue;
      taken = time;
      const auto append = [e](const Comparison& from, Comparison& to) {
        ComparedEpoch epoch = from.epochs[e];
        const auto begin = from.satellites.begin() + static_cast<std::ptrdiff_t>(epoch.first);
        epoch.first = to.satellites.size();
        to.satellites.insert(to.satellites.end(), begin, begin + static_cast<std::ptrdiff_t>(epoch.count));
        to.epochs.push_back(epoch);
      };
      append(*part.comparison, pooled.comparison);
      for (std::size_t r = 0; r < max_runs; ++r)
        append(part.runs.empty() ? *part.comparison : part.runs[r % part.runs.size()], pooled.runs[r]);
    }
  }
  return pooled;
}

std::optional<double> PhaseView::fraction() const {
  if (observations == 0) return std::nullopt;
  return static_cast<double>(with_phase) / static_cast<double>(observations);
}

std::optional<double> PhaseMetrics::time_between_slips_s() const {
  if (slips == 0) return std::nullopt;
  return time_s / static_cast<double>(slips);
}

std::string SignalMetrics::name() const {
  return fmt::format("{} {}", gnss::name(signal->system), signal->name);
}

bool SignalMetrics::first() const {
  return gnss::index_of(*signal) == 0;
}

}  // namespace canyon::validation
