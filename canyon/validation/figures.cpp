#include "canyon/validation/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/options/values.hpp"
#include "canyon/validation/epoch_interval.hpp"
#include "canyon/validation/ranked_sample.hpp"
#include "canyon/validation/signal_figures.hpp"

namespace canyon::validation {
namespace {

/// Of NLOS observations with a prediction of one kind.
struct ExplainedSample {
  std::vector<double> predicted, measured, difference;
  void add(double prediction_m, double error_m) {
    predicted.push_back(prediction_m);
    measured.push_back(error_m);
    difference.push_back(std::abs(error_m - prediction_m));
  }
  [[nodiscard]] Explained figures(std::string kind, std::size_t nlos) const {
    Explained e;
    e.kind = std::move(kind);
    e.n = predicted.size();
    e.share = nlos > 0 ? static_cast<double>(e.n) / static_cast<double>(nlos) : 0;
    e.median_difference_m = median(difference);
    e.correlation = spearman(predicted, measured);
    return e;
  }
};

PositionFigures position_figures(std::span<const ComparedFix> fixes) {
  PositionFigures p;
  p.epochs = fixes.size();
  std::vector<double> horizontal, vertical;
  double used = 0;
  for (const ComparedFix& f : fixes) {
    if (!f.solved) continue;
    ++p.fixes;
    used += f.used;
    horizontal.push_back(f.error_enu_m.head<2>().norm());
    vertical.push_back(std::abs(f.error_enu_m.z()));
  }
  if (p.fixes > 0) p.mean_used = used / static_cast<double>(p.fixes);
  p.horizontal_m = five_quantiles(horizontal);
  p.vertical_m = five_quantiles(vertical);
  return p;
}

/// Observations of a part of a comparison, by the questions asked of them.
class Collector {
 public:
  Collector(const Comparison& comparison, std::size_t first, std::size_t count,
            std::span<const Comparison> runs)
      : comparison_(comparison),
        epochs_(std::span<const ComparedEpoch>(comparison.epochs).subspan(first, count)),
        first_(first),
        runs_(runs.empty() ? std::span<const Comparison>(&comparison, 1) : runs) {
    assert(std::all_of(runs_.begin(), runs_.end(), [&comparison](const Comparison& run) {
      return run.epochs.size() == comparison.epochs.size() &&
             run.satellites.size() == comparison.satellites.size();
    }));
    for (std::size_t e = 0; e < epochs_.size(); ++e) {
      for (std::size_t i = epochs_[e].first; i < epochs_[e].first + epochs_[e].count; ++i) {
        add_measured(comparison.satellites[i], static_cast<std::uint32_t>(e));
        for (const Comparison& run : runs_) add_simulated(!comparison.satellites[i].clear, run.satellites[i]);
      }
      if (epochs_[e].measured.solved) used_measured_.push_back(epochs_[e].measured.used);
    }
    for (const ComparedFix& fix : simulated_fixes(first, count)) {
      if (fix.solved) used_simulated_.push_back(fix.used);
    }
    for (TrackedShare& share : tracked_) share_among(runs_.size(), share);
  }

  [[nodiscard]] Figures figures(const FigureOptions& options) const {
    Figures f;
    f.epochs = epochs_.size();
    f.los = error_.los().size();
    f.nlos = error_.nlos().size();
    f.by_cn0 = separation(weakness_.nlos(), weakness_.los());
    f.by_error = separation(error_.nlos(), error_.los());
    f.bands = bands_;
    for (std::size_t b = 0; b < f.bands.size(); ++b) {
      f.bands[b].by_cn0 = separation(band_weakness_[b].nlos(), band_weakness_[b].los());
      f.bands[b].by_error = separation(band_error_[b].nlos(), band_error_[b].los());
    }
    f.tracked_los = tracked_[0];
    f.tracked_nlos = tracked_[1];
    for (std::size_t k = 0; k < kinds_.size(); ++k) {
      f.explained.push_back(explained_[k].figures(kinds_[k], f.nlos));
    }
    f.error_los_m = pair_of(error_.los(), simulated_error_.los());
    f.error_nlos_m = pair_of(error_.nlos(), simulated_error_.nlos());
    f.cn0_los_dbhz = pair_of(cn0_.los(), simulated_cn0_.los());
    f.cn0_nlos_dbhz = pair_of(cn0_.nlos(), simulated_cn0_.nlos());
    f.used = pair_of(used_measured_, used_simulated_);
    f.runs = runs_.size();
    f.measured = position_figures(measured_fixes(first_, epochs_.size()));
    f.simulated = position_figures(simulated_fixes(first_, epochs_.size()));
    add_segments(f);
    f.signals = signal_figures(comparison_, first_, epochs_.size(), runs_);
    if (options.resamples > 0) add_intervals(f, options);
    return f;
  }

 private:
  void add_simulated(bool nlos, const ComparedSatellite& s) {
    if (s.simulated) ++tracked_[nlos ? 1 : 0].simulated;
    if (s.simulated_error_m) simulated_error_.add(nlos, *s.simulated_error_m);
    if (s.simulated && s.simulated_cn0_dbhz) simulated_cn0_.add(nlos, *s.simulated_cn0_dbhz);
  }

  void add_measured(const ComparedSatellite& s, std::uint32_t epoch) {
    const bool nlos = !s.clear;
    TrackedShare& share = tracked_[nlos ? 1 : 0];
    ++share.satellites;
    if (s.measured) ++share.measured;
    if (!s.measured_error_m) return;

    const double error_m = *s.measured_error_m;
    const std::size_t b = band(geodesy::degrees(s.elevation_rad));
    error_.add(nlos, error_m);
    ranked_error_.push_back({error_m, nlos, epoch});
    if (b < bands_.size()) {
      ++(nlos ? bands_[b].nlos : bands_[b].los);
      band_error_[b].add(nlos, error_m);
    }
    if (s.measured_cn0_dbhz) {
      cn0_.add(nlos, *s.measured_cn0_dbhz);
      weakness_.add(nlos, -*s.measured_cn0_dbhz);
      ranked_weakness_.push_back({-*s.measured_cn0_dbhz, nlos, epoch});
      if (b < bands_.size()) band_weakness_[b].add(nlos, -*s.measured_cn0_dbhz);
    }
    if (nlos && s.prediction) {
      const std::string kind = path_words(*s.prediction);
      const auto known = std::find(kinds_.begin(), kinds_.end(), kind);
      assert(known != kinds_.end());
      explained_[static_cast<std::size_t>(known - kinds_.begin())].add(s.prediction->excess_m, error_m);
      explained_.back().add(s.prediction->excess_m, error_m);
    }
  }

  /// bands_.size(): none.
  [[nodiscard]] std::size_t band(double elevation_deg) const {
    std::size_t b = 0;
    while (b < bands_.size() && !(elevation_deg >= bands_[b].low_deg &&
                                  (elevation_deg < bands_[b].high_deg || bands_[b].high_deg >= 90))) {
      ++b;
    }
    return b;
  }

  void add_segments(Figures& f) const {
    constexpr std::size_t kFewest = 10;
    for (const Segment& whole : comparison_.segments) {
      Segment segment = whole;
      segment.first = std::max(whole.first, first_);
      const std::size_t end = std::min(whole.first + whole.count, first_ + epochs_.size());
      if (end < segment.first + kFewest) continue;
      segment.count = end - segment.first;
      segment.length_m = 0;
      for (std::size_t e = segment.first + 1; e < end; ++e) {
        segment.length_m +=
            (comparison_.epochs[e].place_enu_m - comparison_.epochs[e - 1].place_enu_m).head<2>().norm();
      }
      f.segments.push_back({segment, position_figures(measured_fixes(segment.first, segment.count)),
                            position_figures(simulated_fixes(segment.first, segment.count))});
    }
  }

  [[nodiscard]] std::vector<ComparedFix> measured_fixes(std::size_t first, std::size_t count) const {
    std::vector<ComparedFix> fixes;
    for (std::size_t e = first; e < first + count; ++e) fixes.push_back(comparison_.epochs[e].measured);
    return fixes;
  }
  [[nodiscard]] std::vector<ComparedFix> simulated_fixes(std::size_t first, std::size_t count) const {
    std::vector<ComparedFix> fixes;
    for (const Comparison& run : runs_) {
      for (std::size_t e = first; e < first + count; ++e) fixes.push_back(run.epochs[e].simulated);
    }
    return fixes;
  }

  void add_intervals(Figures& f, const FigureOptions& options) const {
    std::vector<geodesy::GpsTime> times;
    for (const ComparedEpoch& epoch : epochs_) times.push_back(epoch.time);
    const auto draws =
        block_draws(epochs_.size(), epochs_in(options.block_s, times), options.resamples, options.seed);
    const auto interval = [&draws](const std::vector<RankedSample::Item>& items) -> std::optional<Interval> {
      const RankedSample sample(items);
      std::vector<double> values;
      for (const auto& times_drawn : draws) {
        if (const auto auc = sample.auc(times_drawn)) values.push_back(*auc);
      }
      if (2 * values.size() <= draws.size()) return {};
      const std::vector<double> ends = quantiles(values, std::array{0.025, 0.975});
      return Interval{ends[0], ends[1]};
    };
    f.by_cn0_interval = interval(ranked_weakness_);
    f.by_error_interval = interval(ranked_error_);
  }

  const Comparison& comparison_;
  std::span<const ComparedEpoch> epochs_;
  std::size_t first_;
  std::span<const Comparison> runs_;  ///< that simulated values are of
  const std::array<std::string, 5> kinds_{"reflected 1", "reflected 2", "diffracted", "diffuse", "all"};
  std::array<ExplainedSample, 5> explained_;
  std::vector<Band> bands_{{10, 30, 0, 0, {}, {}}, {30, 50, 0, 0, {}, {}}, {50, 90, 0, 0, {}, {}}};
  std::array<ByView, 3> band_error_, band_weakness_;
  ByView error_, weakness_, cn0_, simulated_error_, simulated_cn0_;
  std::array<TrackedShare, 2> tracked_;
  std::vector<double> used_measured_, used_simulated_;
  std::vector<RankedSample::Item> ranked_error_, ranked_weakness_;
};

double ratio(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

}  // namespace

std::array<double, 5> five_quantiles(std::span<const double> values) {
  std::array<double, 5> result{};
  if (values.empty()) return result;
  const std::vector<double> at = quantiles(values, kQuantiles);
  std::copy(at.begin(), at.end(), result.begin());
  return result;
}

DistributionPair pair_of(std::span<const double> measured, std::span<const double> simulated) {
  DistributionPair pair;
  pair.measured_n = measured.size();
  pair.simulated_n = simulated.size();
  pair.measured = five_quantiles(measured);
  pair.simulated = five_quantiles(simulated);
  pair.ks = kolmogorov_smirnov(measured, simulated);
  return pair;
}

void share_among(std::size_t runs, TrackedShare& share) {
  share.simulated =
      static_cast<std::size_t>(std::lround(static_cast<double>(share.simulated) / static_cast<double>(runs)));
}

double TrackedShare::measured_ratio() const {
  return ratio(measured, satellites);
}
double TrackedShare::simulated_ratio() const {
  return ratio(simulated, satellites);
}

void FigureOptions::validate() const {
  options::check(*this, "figures");
  if (resamples > 0 && resamples < 100) {
    throw InputError(fmt::format("resamples of the figures is {}", resamples),
                     "give 0 for no intervals, or 100 and more");
  }
}

void visit(options::Visitor& v, FigureOptions& o) {
  v.number({"block_s", "s", "of time, drawn together by the bootstrap"}, o.block_s, {1, 600});
  v.integer({"resamples", "", "of the bootstrap; 0: no intervals"}, o.resamples, 0, 100'000);
  v.integer({"seed", "", "of the bootstrap"}, o.seed);
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

Figures figures(const Comparison& comparison, std::size_t first, std::size_t count, const std::string& part,
                const FigureOptions& options, std::span<const Comparison> runs) {
  options.validate();
  assert(first + count <= comparison.epochs.size());
  Figures f = Collector(comparison, first, count, runs).figures(options);
  f.model = comparison.name;
  f.part = part;
  return f;
}

}  // namespace canyon::validation
