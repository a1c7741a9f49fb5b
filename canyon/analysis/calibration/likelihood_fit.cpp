#include "canyon/analysis/calibration/likelihood_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "canyon/analysis/calibration/direct_estimates.hpp"
#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::calibration {
namespace {

using Verdict = Estimate::Verdict;

/// The first axis belongs to the city, the others are keys of a profile.
constexpr std::size_t kAxes = 3, kFacades = 0;
/// Prior mean and deviation of the fraction of buildings with coated glass; urban_stock: 0.14 (docs/city.md).
constexpr double kCoatedGlass = 0.14, kCoatedGlassDeviation = 0.2;
/// Simulated epochs in memory at a time: about 300 MB.
constexpr std::size_t kEpochsAtOnce = 60'000;
/// Time [s] over which a satellite's observations count as one: obstacles and model errors are correlated.
constexpr double kCorrelated_s = 60;
/// A key is not identified if the observations move the prior by less than this fraction of its deviation.
constexpr double kMoved = 0.1;
/// A key keeps the profile's value if the fit differs from it by less than this fraction of its deviation.
constexpr double kAgrees = 0.1;

/// A fitted key.
struct Axis {
  std::string key, unit;
  double profile = 0;         ///< value before the fit
  double deviation = 1;       ///< of the normal prior around that
  std::vector<double> nodes;  ///< simulated values, ascending
  double step = 1;            ///< of the interpolated values between them
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

/// The fractions of coated glass common to all drives; one if facades are known.
std::vector<double> coated_fractions(std::span<const FitDrive> drives) {
  std::vector<double> fractions;
  for (const Facades& each : drives.front().drive->facades) fractions.push_back(each.coated_glass);
  for (const FitDrive& of : drives) {
    const bool same =
        std::equal(fractions.begin(), fractions.end(), of.drive->facades.begin(), of.drive->facades.end(),
                   [](double fraction, const Facades& facades) { return fraction == facades.coated_glass; });
    if (!same) return {kCoatedGlass};
  }
  return fractions.empty() ? std::vector{kCoatedGlass} : fractions;
}

Axes axes_of(const simulation::ReceiverConfig& receiver, const std::vector<double>& coated_glass) {
  const tracking::SignalOptions& signal = receiver.options.signal;
  const double level_db = signal.link.above_minimum_db;
  return {axis_of("city.facades.fractions.coated_glass", "", kCoatedGlass, kCoatedGlassDeviation,
                  coated_glass, 0, 1, 0.05),
          axis_of("signal.link.above_minimum_db", "dB", level_db, 5,
                  {level_db - 8, level_db - 4, level_db, level_db + 4, level_db + 8}, -10, 20, 1),
          axis_of(kSkylineFraction, "", *disturbance::skyline_numbers(signal.shadowing).fraction, 0.2,
                  {0, 0.4, 0.8}, 0, 1, 0.05)};
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

Values values_at(const Axes& axes, const Point& point) {
  Values values;
  for (std::size_t a = 0; a < kAxes; ++a)
    if (a != kFacades) values[axes.at(a).key] = options::show(point.at(a));
  return values;
}

/// A histogram; values outside count in the nearest bin.
struct Histogram {
  static constexpr std::size_t kBins = 34;
  std::array<double, kBins> counts{};

  /// @param bin in bins, from the start of the first one
  void add(double bin) { counts.at(static_cast<std::size_t>(std::clamp(bin, 0.0, kBins - 1.0))) += 1; }
  void add(const Histogram& other, double weight) {
    for (std::size_t i = 0; i < kBins; ++i) counts.at(i) += weight * other.counts.at(i);
  }
};

/// Observations of one class of satellites: tracked or not; if tracked, C/N0 in bins of 2 dB and pseudorange
/// errors, in even bins up to some 3 m and logarithmic ones above.
struct Counts {
  static constexpr double kBin_dB = 2, kBinsOfError = 4, kLinear_m = 3;
  double tracked = 0, untracked = 0;
  Histogram cn0, error;

  void add(const validation::ComparedObservation& o) {
    (o.tracked ? tracked : untracked) += 1;
    if (!o.tracked) return;
    if (o.cn0_dbhz) cn0.add(*o.cn0_dbhz / kBin_dB);
    if (o.error_m) error.add(Histogram::kBins / 2.0 + kBinsOfError * std::asinh(*o.error_m / kLinear_m));
  }
  void add(const Counts& other, double weight) {
    tracked += weight * other.tracked;
    untracked += weight * other.untracked;
    cn0.add(other.cn0, weight);
    error.add(other.error, weight);
  }
};
/// Classes: hidden or clear in the map, in four bands of elevation.
using Classes = std::array<Counts, 8>;
/// Errors of clear satellites depend on the receiver's noise, which is not fitted.
constexpr std::size_t kHiddenClasses = 4;

/// A drive's observations, recorded and simulated at the nodes.
struct Observations {
  Classes recorded{};
  std::vector<Classes> node_classes;  ///< of all seeds
  double weight = 1;                  ///< of one epoch
};

/// The class of a satellite, hidden ones first.
std::size_t class_of(const validation::ComparedSatellite& s) {
  constexpr std::array kBorders_deg = {30, 45, 60};
  std::size_t of = s.clear ? kHiddenClasses : 0;
  for (const double border : kBorders_deg) of += geodesy::degrees(s.elevation_rad) >= border ? 1 : 0;
  return of;
}

void add_side(const validation::Comparison& comparison, validation::Side side, Classes& classes) {
  for (const validation::ComparedSatellite& s : comparison.satellites)
    classes.at(class_of(s)).add(s.of(side));
}

/// Log-probability of recorded values under a model's density; each epoch counts by `weight`.
double log_density(const Histogram& recorded, const Histogram& model, double weight) {
  // A triangle over 5 bins; a twentieth of the density is uniform.
  constexpr std::array kTriangle = {1 / 9.0, 2 / 9.0, 3 / 9.0, 2 / 9.0, 1 / 9.0};
  constexpr double kEven = 0.05;
  const double all = std::accumulate(model.counts.begin(), model.counts.end(), 0.0);
  double sum = 0;
  for (std::size_t i = 0; i < Histogram::kBins; ++i) {
    if (recorded.counts.at(i) == 0) continue;
    double near = 0;
    for (std::size_t k = 0; k < kTriangle.size(); ++k)
      if (i + k >= 2 && i + k - 2 < Histogram::kBins) near += kTriangle.at(k) * model.counts.at(i + k - 2);
    sum += recorded.counts.at(i) *
           std::log((weight * (1 - kEven) * near + (weight * kEven * all + 1) / Histogram::kBins) /
                    (weight * all + 1));
  }
  return sum;
}

/// Log-probability of the recorded observations under a model's fractions and densities, each epoch counting
/// by `weight`. @param errors whether pseudorange errors count
double log_likelihood(const Counts& recorded, const Counts& model, double weight, bool errors) {
  // One more observation of each kind, so that no fraction is 0 or 1.
  const double tracked = weight * model.tracked + 1, untracked = weight * model.untracked + 1;
  double sum = recorded.tracked * std::log(tracked / (tracked + untracked)) +
               recorded.untracked * std::log(untracked / (tracked + untracked)) +
               log_density(recorded.cn0, model.cn0, weight);
  if (errors) sum += log_density(recorded.error, model.error, weight);
  return weight * sum;
}

struct Posterior {
  Point mean{}, sigma{};
};

/// Observations at the nodes, of each drive; fractions and densities are linear between the nodes.
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
  /// @param drive its nodes in the order of points()
  void add(Observations drive) { drives_.push_back(std::move(drive)); }

  /// The posterior from observations and priors, or from the priors alone.
  [[nodiscard]] Posterior posterior(bool by_observations) const {
    std::array<std::vector<double>, kAxes> lists;
    for (std::size_t a = 0; a < kAxes; ++a) lists.at(a) = between(axes_.at(a));
    const std::vector<Point> points = points_of(lists);
    std::vector<double> exponents;
    for (const Point& point : points) {
      double squares = by_observations ? -2 * log_likelihood_at(point) : 0;
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
  [[nodiscard]] double log_likelihood_at(const Point& point) const {
    std::array<std::pair<std::size_t, double>, kAxes> indices;
    for (std::size_t a = 0; a < kAxes; ++a) indices.at(a) = interval_of(axes_.at(a).nodes, point.at(a));
    double sum = 0;
    for (const Observations& drive : drives_) {
      Classes model;
      for (std::size_t corner = 0; corner < (std::size_t{1} << kAxes); ++corner) {
        double weight = 1;
        std::size_t node = 0;
        for (std::size_t a = 0; a < kAxes; ++a) {
          const auto [below, fraction] = indices.at(a);
          const bool upper = (corner >> a & 1) != 0;
          weight *= upper ? fraction : 1 - fraction;
          node = node * axes_.at(a).nodes.size() + below + (upper && fraction > 0 ? 1 : 0);
        }
        if (weight == 0) continue;
        for (std::size_t c = 0; c < model.size(); ++c)
          model.at(c).add(drive.node_classes[node].at(c), weight);
      }
      for (std::size_t c = 0; c < model.size(); ++c)
        sum += log_likelihood(drive.recorded.at(c), model.at(c), drive.weight, c < kHiddenClasses);
    }
    return sum;
  }
  /// The node at or below a value, and the fraction of the distance to the next one.
  static std::pair<std::size_t, double> interval_of(const std::vector<double>& nodes, double value) {
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
  std::vector<Observations> drives_;
};

/// Simulates a drive at all points of the grid.
class NodeRun {
 public:
  NodeRun(const FitDrive& of, const Grid& grid, const Values& known, const CalibrateOptions& options)
      : fit_drive_(of),
        drive_(*of.drive),
        grid_(grid),
        known_(known),
        options_(options),
        in_city_(grid.points().size() / grid.axes().at(kFacades).nodes.size()) {}

  Observations run() {
    observations_.node_classes.resize(grid_.points().size());
    for (std::size_t node = 0; node < grid_.points().size(); node += in_city_)
      if (in_city_ == grid_.points().size())
        run_city(node, *drive_.environment);
      else
        run_city(node, *drive_.facades.at(node / in_city_).make());
    observations_.weight = std::min(1.0, validation::interval_of(epochs()) / kCorrelated_s);
    return std::move(observations_);
  }

 private:
  [[nodiscard]] const std::vector<validation::ResidualEpoch>& epochs() const {
    return drive_.recording.residuals.epochs;
  }

  /// The nodes of one city, from `first_node` on, with all seeds. Rays are traced once for all held epochs.
  void run_city(std::size_t first_node, const simulation::Environment& environment) {
    const std::size_t at_once = std::max<std::size_t>(1, kEpochsAtOnce / epochs().size());
    const std::size_t count = static_cast<std::size_t>(options_.seeds) * in_city_;
    for (std::size_t first = 0; first < count; first += at_once) {
      const std::size_t size = std::min(count - first, at_once);
      std::vector<simulation::ReceiverConfig> receivers(size, drive_.receiver);
      std::vector<validation::SeededReceiver> seeded;
      for (std::size_t i = 0; i < size; ++i) {
        const std::size_t k = first + i;
        set_values(known_, receivers[i]);
        set_values(values_at(grid_.axes(), grid_.points()[first_node + k % in_city_]), receivers[i]);
        seeded.push_back({&receivers[i], drive_.seed + k / in_city_});
      }
      validation::CompareOptions compare;
      compare.threads = options_.threads;
      compare.leave_out = fit_drive_.leave_out;
      compare.progress = [&](std::size_t done, std::size_t) {
        if (!options_.progress) return;
        const std::size_t before = first_node * static_cast<std::size_t>(options_.seeds) + first;
        const std::size_t all = grid_.points().size() * static_cast<std::size_t>(options_.seeds);
        options_.progress(drive_.name + ": simulating receivers", before * epochs().size() + done * size,
                          all * epochs().size());
      };
      std::size_t k = first;
      for (const validation::Comparison& comparison :
           validation::compare(drive_.recording, seeded, environment, drive_.registration, compare)) {
        if (first_node + k == 0) add_side(comparison, validation::Side::Measured, observations_.recorded);
        add_side(comparison, validation::Side::Simulated,
                 observations_.node_classes[first_node + k++ % in_city_]);
      }
    }
  }

  const FitDrive& fit_drive_;
  const Drive& drive_;
  const Grid& grid_;
  const Values& known_;
  const CalibrateOptions& options_;
  std::size_t in_city_;  ///< nodes with the same facades
  Observations observations_;
};

/// The estimate of one axis from the observations.
Estimate estimate_of(const Axis& axis, std::size_t a, const Posterior& prior, const Posterior& known) {
  const double mean = known.mean.at(a), sigma = known.sigma.at(a), open = prior.sigma.at(a);
  Estimate e{axis.key, axis.unit, options::show(axis.profile)};
  if (std::abs(mean - prior.mean.at(a)) < kMoved * open && std::abs(sigma - open) < kMoved * open) {
    e.basis = "tracked satellites, C/N0 and errors hardly depend on it";
    return e;
  }
  e.recorded = rounded(mean, sigma);
  e.interval = fmt::format("{} to {}", rounded(std::max(mean - 2 * sigma, axis.nodes.front()), sigma),
                           rounded(std::min(mean + 2 * sigma, axis.nodes.back()), sigma));
  e.basis = "tracked satellites, their C/N0, errors of hidden ones, by simulation";
  e.verdict = std::abs(mean - axis.profile) < kAgrees * sigma ? Verdict::Agrees : Verdict::Fitted;
  return e;
}

}  // namespace

void add_likelihood_fit(std::span<const FitDrive> drives, const CalibrateOptions& options,
                        Calibration& result) {
  simulation::ReceiverConfig receiver = drives.front().drive->receiver;
  set_values(result.values, receiver);
  Grid grid(axes_of(receiver, coated_fractions(drives)));
  for (const FitDrive& drive : drives) grid.add(NodeRun(drive, grid, result.values, options).run());
  const Posterior prior = grid.posterior(false), known = grid.posterior(true);
  for (std::size_t a = 0; a < kAxes; ++a) {
    const Axis& axis = grid.axes().at(a);
    Estimate e = estimate_of(axis, a, prior, known);
    if (a != kFacades)
      result.add(std::move(e));
    else if (axis.nodes.size() > 1)
      result.coated_glass = std::move(e);
  }
}

}  // namespace canyon::calibration
