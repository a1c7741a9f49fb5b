#include "canyon/calibration/score_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "canyon/options/values.hpp"
#include "canyon/validation/figures.hpp"
#include "canyon/validation/score_card.hpp"

namespace canyon::calibration {
namespace {

using Verdict = Estimate::Verdict;

constexpr const char* kAcquisitionKey = "signal.lock.acquisition_threshold_dbhz";
constexpr std::size_t kAxes = 3;
/// Simulated epochs that are held at a time: some 300 MB.
constexpr std::size_t kEpochsAtOnce = 60'000;
/// Deviation of the distance of a figure that the right receiver has, in units of its range: halves of a
/// drive differ, and models are wrong somewhere.
constexpr double kSigma = 1.4;
/// A key is not identified where the figures move the prior by less than this, of its deviation.
constexpr double kMoved = 0.1;
/// So near to the profile's value, of the deviation, it stays.
constexpr double kAgrees = 0.1;

/// A key that is fitted.
struct Axis {
  std::string key, unit;
  double profile = 0;         ///< its value before
  double deviation = 1;       ///< of the normal prior about that
  std::vector<double> nodes;  ///< that are simulated, ascending
  double step = 1;            ///< of what is interpolated between them
};
using Axes = std::array<Axis, kAxes>;
using Point = std::array<double, kAxes>;

Axis axis_of(const char* key, const char* unit, double profile, double deviation,
             const std::vector<double>& nodes, double low, double high, double step) {
  Axis axis{key, unit, profile, deviation, {}, step};
  for (const double each : nodes) {
    const double node = std::clamp(each, low, high);
    if (axis.nodes.empty() || node > axis.nodes.back()) axis.nodes.push_back(node);
  }
  return axis;
}

Axes axes_of(const simulation::ReceiverConfig& receiver) {
  const tracking::SignalOptions& signal = receiver.options.signal;
  const double level_db = signal.link.above_minimum_db, threshold = signal.lock.tracking_threshold_dbhz;
  return {axis_of("signal.link.above_minimum_db", "dB", level_db, 5,
                  {level_db - 8, level_db - 4, level_db, level_db + 4, level_db + 8}, -10, 20, 1),
          axis_of("signal.shadowing.skyline.share", "", disturbance::skyline_numbers(signal.shadowing).share,
                  0.2, {0, 0.4, 0.8}, 0, 1, 0.05),
          axis_of("signal.lock.tracking_threshold_dbhz", "dB-Hz", threshold, 4,
                  {threshold - 8, threshold, threshold + 8}, 0, 100, 1)};
}

/// Points of the product of lists, the last one fastest.
std::vector<Point> points_of(const std::array<std::vector<double>, kAxes>& lists) {
  std::vector<Point> points{Point{}};
  for (std::size_t a = 0; a < kAxes; ++a) {
    std::vector<Point> more;
    for (Point point : points) {
      for (const double value : lists.at(a)) {
        point.at(a) = value;
        more.push_back(point);
      }
    }
    points = std::move(more);
  }
  return points;
}

Values values_at(const Axes& axes, const Point& point, const simulation::ReceiverConfig& receiver) {
  Values values;
  for (std::size_t a = 0; a < kAxes; ++a) values[axes.at(a).key] = options::show(point.at(a));
  // It is no lower than the tracking threshold.
  if (point.back() > receiver.options.signal.lock.acquisition_threshold_dbhz)
    values[kAcquisitionKey] = values[axes.back().key];
  return values;
}

/// validation::range_distance() of the score card's figures, of one drive and seed.
using Distances = std::vector<double>;

Distances distances_of(const validation::Comparison& comparison) {
  // A figure without a value, because of too few observations, counts as quite wrong.
  constexpr double kFarthest = 4;
  Distances distances;
  for (const validation::Headline& h : validation::headlines(comparison, 0, comparison.epochs.size())) {
    if (!validation::has_range(h)) continue;
    const double distance = validation::range_distance(h).value_or(kFarthest);
    distances.push_back(std::clamp(distance, -kFarthest, kFarthest));
  }
  return distances;
}

/// The posterior of the axes.
struct Posterior {
  Point mean{}, sigma{};
};

/// Figures at the nodes, of each drive and seed; linear between the nodes.
class Grid {
 public:
  explicit Grid(Axes axes) : axes_(std::move(axes)) {
    std::array<std::vector<double>, kAxes> nodes;
    for (std::size_t a = 0; a < kAxes; ++a) nodes.at(a) = axes_.at(a).nodes;
    points_ = points_of(nodes);
  }
  [[nodiscard]] const Axes& axes() const { return axes_; }
  /// The nodes.
  [[nodiscard]] const std::vector<Point>& points() const { return points_; }
  /// @param of_nodes in the order of points() @param weight against one simulation of one drive
  void add_run(std::vector<Distances> of_nodes, double weight) {
    runs_.push_back({std::move(of_nodes), weight});
  }

  /// By the figures; or by the priors alone.
  [[nodiscard]] Posterior posterior(bool by_figures) const {
    std::array<std::vector<double>, kAxes> lists;
    for (std::size_t a = 0; a < kAxes; ++a) lists.at(a) = between(axes_.at(a));
    const std::vector<Point> points = points_of(lists);
    std::vector<double> exponents;
    for (const Point& point : points) {
      double squares = by_figures ? misfit(point) / (kSigma * kSigma) : 0;
      for (std::size_t a = 0; a < kAxes; ++a)
        squares += std::pow((point.at(a) - axes_.at(a).profile) / axes_.at(a).deviation, 2);
      exponents.push_back(-0.5 * squares);
    }
    const double largest = *std::max_element(exponents.begin(), exponents.end());
    double sum = 0;
    Point first{}, second{};
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double weight = std::exp(exponents[i] - largest);
      sum += weight;
      for (std::size_t a = 0; a < kAxes; ++a) {
        first.at(a) += weight * points[i].at(a);
        second.at(a) += weight * points[i].at(a) * points[i].at(a);
      }
    }
    Posterior posterior;
    for (std::size_t a = 0; a < kAxes; ++a) {
      posterior.mean.at(a) = first.at(a) / sum;
      posterior.sigma.at(a) =
          std::sqrt(std::max(0.0, second.at(a) / sum - std::pow(posterior.mean.at(a), 2)));
    }
    return posterior;
  }

 private:
  struct Run {
    std::vector<Distances> of_nodes;
    double weight = 1;
  };

  /// Sum of the figures' squares, weighted.
  [[nodiscard]] double misfit(const Point& point) const {
    std::array<std::pair<std::size_t, double>, kAxes> places;
    for (std::size_t a = 0; a < kAxes; ++a) places.at(a) = place(axes_.at(a).nodes, point.at(a));
    double sum = 0;
    for (const Run& run : runs_) {
      Distances distances(run.of_nodes.front().size());
      for (std::size_t corner = 0; corner < (std::size_t{1} << kAxes); ++corner) {
        double weight = 1;
        std::size_t node = 0;
        for (std::size_t a = 0; a < kAxes; ++a) {
          const auto [below, share] = places.at(a);
          const bool upper = (corner >> a & 1) != 0;
          weight *= upper ? share : 1 - share;
          node = node * axes_.at(a).nodes.size() + below + (upper && share > 0 ? 1 : 0);
        }
        if (weight == 0) continue;
        for (std::size_t f = 0; f < distances.size(); ++f) distances[f] += weight * run.of_nodes[node][f];
      }
      for (const double distance : distances) sum += run.weight * distance * distance;
    }
    return sum;
  }
  /// The node at or below a value, and the share of the way to the next one.
  static std::pair<std::size_t, double> place(const std::vector<double>& nodes, double value) {
    const auto above = std::upper_bound(nodes.begin(), nodes.end(), value);
    if (above == nodes.end()) return {nodes.size() - 1, 0};
    const auto below = static_cast<std::size_t>(above - nodes.begin()) - 1;
    return {below, (value - nodes[below]) / (nodes[below + 1] - nodes[below])};
  }
  static std::vector<double> between(const Axis& axis) {
    const auto steps = std::lround((axis.nodes.back() - axis.nodes.front()) / axis.step);
    std::vector<double> values;
    for (long k = 0; k <= steps; ++k)
      values.push_back(std::min(axis.nodes.front() + static_cast<double>(k) * axis.step, axis.nodes.back()));
    return values;
  }

  Axes axes_;
  std::vector<Point> points_;
  std::vector<Run> runs_;
};

/// Figures of the drive at all points by the first seed, then by the second and so on.
std::vector<Distances> simulate(const FitDrive& of, const Grid& grid, const Values& known,
                                const CalibrateOptions& options) {
  const Drive& drive = *of.drive;
  const std::vector<Point>& points = grid.points();
  const std::size_t at_once =
      std::max<std::size_t>(1, kEpochsAtOnce / drive.recording.residuals.epochs.size());
  const std::size_t count = static_cast<std::size_t>(options.seeds) * points.size();
  std::vector<Distances> distances;
  while (distances.size() < count) {
    const std::size_t first = distances.size(), size = std::min(count - first, at_once);
    std::vector<simulation::ReceiverConfig> receivers(size, drive.receiver);
    std::vector<validation::SeededReceiver> seeded;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t k = first + i;
      set_values(known, receivers[i]);
      set_values(values_at(grid.axes(), points[k % points.size()], receivers[i]), receivers[i]);
      seeded.push_back({&receivers[i], drive.seed + k / points.size()});
    }
    validation::CompareOptions compare;
    compare.threads = options.threads;
    compare.leave_out = of.leave_out;
    compare.progress = [&](std::size_t done, std::size_t epochs) {
      if (options.progress)
        options.progress(drive.name + ": simulating receivers", first * epochs + done * size, count * epochs);
    };
    for (const validation::Comparison& comparison :
         validation::compare(drive.recording, seeded, *drive.environment, drive.registration, compare)) {
      distances.push_back(distances_of(comparison));
    }
  }
  return distances;
}

}  // namespace

void add_score_fit(std::span<const FitDrive> drives, const CalibrateOptions& options, Calibration& result) {
  simulation::ReceiverConfig receiver = drives.front().drive->receiver;
  set_values(result.values, receiver);
  const Values before = values_of(receiver);
  Grid grid(axes_of(receiver));
  for (const FitDrive& drive : drives) {
    const std::vector<Distances> all = simulate(drive, grid, result.values, options);
    const auto nodes = static_cast<std::ptrdiff_t>(grid.points().size());
    for (auto begin = all.begin(); begin != all.end(); begin += nodes)
      grid.add_run({begin, begin + nodes}, 1.0 / options.seeds);
  }
  const Posterior prior = grid.posterior(false), known = grid.posterior(true);
  Point after = known.mean;
  for (std::size_t a = 0; a < kAxes; ++a) {
    const Axis& axis = grid.axes().at(a);
    const double mean = known.mean.at(a), sigma = known.sigma.at(a), open = prior.sigma.at(a);
    Estimate e{axis.key, axis.unit, options::show(axis.profile), {}, {}, {}, {}, {}};
    e.after = e.before;
    if (std::abs(mean - prior.mean.at(a)) < kMoved * open && std::abs(sigma - open) < kMoved * open) {
      e.basis = "the figures of the score card hardly depend on it";
    } else {
      e.recorded = rounded(mean, sigma);
      e.interval = fmt::format("{} to {}", rounded(std::max(mean - 2 * sigma, axis.nodes.front()), sigma),
                               rounded(std::min(mean + 2 * sigma, axis.nodes.back()), sigma));
      e.basis = "figures of the score card, by simulation";
      e.verdict = std::abs(mean - axis.profile) < kAgrees * sigma ? Verdict::Agrees : Verdict::Fitted;
    }
    if (e.verdict == Verdict::Fitted) {
      e.after = result.values[axis.key] = e.recorded;
    } else {
      after.at(a) = axis.profile;
    }
    result.estimates.push_back(std::move(e));
  }
  const Values values = values_at(grid.axes(), after, receiver);
  if (const auto raised = values.find(kAcquisitionKey); raised != values.end()) {
    result.values[raised->first] = result.values[grid.axes().back().key];
    result.estimates.push_back({raised->first,
                                "dB-Hz",
                                before.at(raised->first),
                                result.values[raised->first],
                                result.values[raised->first],
                                {},
                                Verdict::Fitted,
                                "no lower than the tracking threshold"});
  }
}

}  // namespace canyon::calibration
