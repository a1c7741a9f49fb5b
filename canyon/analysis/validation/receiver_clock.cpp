#include "canyon/analysis/validation/receiver_clock.hpp"

// Step two of pseudorange_errors.hpp: receiver clock and inter-system biases.
#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/receiver/positioning/positioning_options.hpp"

namespace canyon::validation {
namespace {

using gnss::kSystemCount;
using gnss::System;

constexpr int kMaxIterations = 100;
/// Steps of clocks and biases below this [m] end the iteration.
constexpr double kConverged_m = 1e-4;
/// Without scatter (simulated pseudoranges) the weights would have no scale.
constexpr double kSmallestScatter = 1e-6;

/// Value with half of the weight on either side; the middle if the halves meet between two. Reorders.
double weighted_median(std::vector<std::pair<double, double>>& value_and_weight) {
  std::sort(value_and_weight.begin(), value_and_weight.end());
  double total = 0;
  for (const auto& [value, weight] : value_and_weight) total += weight;
  double sum = 0;
  for (std::size_t i = 0; i < value_and_weight.size(); ++i) {
    sum += value_and_weight[i].second;
    if (sum > 0.5 * total * (1 + 1e-12)) return value_and_weight[i].first;
    if (sum >= 0.5 * total * (1 - 1e-12) && i + 1 < value_and_weight.size())
      return (value_and_weight[i].first + value_and_weight[i + 1].first) / 2;
  }
  return value_and_weight.back().first;
}

class ClockEstimator {
 public:
  ClockEstimator(const PseudorangeResiduals& residuals, const ClearView& clear_view,
                 const ReceiverClockOptions& options)
      : residuals_(residuals), options_(options) {
    result_.observations.resize(residuals.observations.size());
    result_.clocks.resize(residuals.epochs.size());
    origin_.resize(residuals.epochs.size());
    clock_.assign(residuals.epochs.size(), 0);
    weight_.resize(residuals.observations.size());
    classify(clear_view);
  }

  PseudorangeErrors estimate() {
    choose_reference();
    start();
    converge();
    add_weak_systems();
    for (std::size_t e = 0; e < clock_.size(); ++e) finish(e);
    return std::move(result_);
  }

 private:
  [[nodiscard]] const PseudorangeResidual& observation(std::size_t i) const {
    return residuals_.observations[i];
  }
  [[nodiscard]] static std::size_t index(System s) { return static_cast<std::size_t>(s); }
  /// Residual relative to the epoch's median, minus the system's bias [m]: small numbers.
  [[nodiscard]] double reduced(std::size_t i) const {
    const PseudorangeResidual& o = observation(i);
    return o.residual_m - origin_[o.epoch] - bias_[index(o.id.system)];
  }
  template <typename Visit>
  void each(std::size_t epoch, Visit visit) const {
    const ResidualEpoch& e = residuals_.epochs[epoch];
    for (std::size_t i = e.first; i < e.first + e.count; ++i) visit(i);
  }

  void classify(const ClearView& clear_view) {
    std::vector<double> values;
    for (std::size_t e = 0; e < residuals_.epochs.size(); ++e) {
      values.clear();
      each(e, [&](std::size_t i) { values.push_back(observation(i).residual_m); });
      origin_[e] = *median(values);
      each(e, [&](std::size_t i) {
        const PseudorangeResidual& o = observation(i);
        PseudorangeError& error = result_.observations[i];
        error.clear = clear_view(o, residuals_.epochs[e]);
        error.gross = std::abs(o.residual_m - origin_[e]) > options_.gross_m;
        observed_[index(o.id.system)] = true;
        const double cn0 = o.cn0_dbhz.value_or(positioning::kUnknownCn0_dbhz);
        weight_[i] =
            1 / (options_.variance_floor_m2 + options_.variance_scale_m2_hz * std::pow(10.0, -cn0 / 10));
        if (usable(i) && error.clear) ++result_.clocks[e].clear;
      });
    }
  }

  /// Whether it can be used to estimate a clock.
  [[nodiscard]] bool usable(std::size_t i) const {
    return !result_.observations[i].gross && observation(i).elevation_rad >= options_.elevation_mask_rad;
  }
  [[nodiscard]] bool clear(std::size_t i) const { return usable(i) && result_.observations[i].clear; }

  void choose_reference() {
    std::array<std::size_t, kSystemCount> clear_count{}, count{};
    for (std::size_t i = 0; i < weight_.size(); ++i) {
      const std::size_t s = index(observation(i).id.system);
      ++count[s];
      if (clear(i)) ++clear_count[s];
    }
    std::size_t best = 0;
    for (std::size_t s = 1; s < kSystemCount; ++s)
      if (std::pair(clear_count[s], count[s]) > std::pair(clear_count[best], count[best])) best = s;
    result_.reference = static_cast<System>(best);
    link_systems(best);
  }

  /// Finds systems connected to the reference by epochs with clear satellites of both, also indirectly.
  void link_systems(std::size_t reference) {
    linked_.fill(false);
    linked_[reference] = true;
    for (bool grew = true; grew;) {
      grew = false;
      for (std::size_t e = 0; e < clock_.size(); ++e) {
        std::array<bool, kSystemCount> here{};
        bool any = false;
        each(e, [&](std::size_t i) {
          if (!clear(i)) return;
          const std::size_t s = index(observation(i).id.system);
          here[s] = true;
          any = any || linked_[s];
        });
        for (std::size_t s = 0; any && s < kSystemCount; ++s)
          if (here[s] && !linked_[s]) linked_[s] = grew = true;
      }
    }
  }

  [[nodiscard]] bool joins(std::size_t i) const {
    return clear(i) && linked_[index(observation(i).id.system)];
  }

  /// Clock of an epoch by the weighted median of the chosen observations; false if there is none.
  template <typename Choose>
  bool median_clock(std::size_t e, Choose choose) {
    std::vector<std::pair<double, double>> values;
    each(e, [&](std::size_t i) {
      if (choose(i)) values.emplace_back(reduced(i), weight_[i]);
    });
    if (values.empty()) return false;
    clock_[e] = weighted_median(values);
    return true;
  }

  /// Medians of clocks and biases alternately, starting from biases of 0.
  void start() {
    for (int round = 0; round < 10; ++round) {
      std::array<std::vector<std::pair<double, double>>, kSystemCount> values;
      for (std::size_t e = 0; e < clock_.size(); ++e) {
        if (!median_clock(e, [this](std::size_t i) { return joins(i); })) continue;
        each(e, [&](std::size_t i) {
          const std::size_t s = index(observation(i).id.system);
          if (joins(i)) values[s].emplace_back(reduced(i) + bias_[s] - clock_[e], weight_[i]);
        });
      }
      for (std::size_t s = 0; s < kSystemCount; ++s)
        if (!values[s].empty()) bias_[s] = weighted_median(values[s]);
      const double shift = bias_[index(result_.reference)];
      for (std::size_t s = 0; s < kSystemCount; ++s)
        if (linked_[s]) bias_[s] -= shift;
      for (double& c : clock_) c += shift;
    }
  }

  /// Robust deviation of clear errors from their clock, in units of the weights' deviation.
  void measure_scatter() {
    std::vector<double> scaled;
    for (std::size_t e = 0; e < clock_.size(); ++e) {
      // A single satellite determines its own clock and has no scatter.
      if (result_.clocks[e].clear < 2) continue;
      each(e, [&](std::size_t i) {
        if (joins(i)) scaled.push_back(std::abs(reduced(i) - clock_[e]) * std::sqrt(weight_[i]));
      });
    }
    result_.scatter = kMadToSigma * median(scaled).value_or(0);
  }

  /// Huber's weight of an observation, relative to its epoch's clock.
  [[nodiscard]] double robust_weight(std::size_t i, double clock) const {
    const double limit = options_.huber * std::max(result_.scatter, kSmallestScatter);
    const double t = std::abs(reduced(i) - clock) * std::sqrt(weight_[i]);
    return t <= limit ? weight_[i] : weight_[i] * limit / t;
  }

  /// Iteratively reweighted least squares for clocks and biases together. With W_es the weight of system s in
  /// epoch e and m_es its mean residual, eliminating the clock of each epoch leaves the normal equations
  ///   sum_e (W_es [s = q] - W_es W_eq / W_e) x_q = sum_e W_es (m_es - m_e).
  void converge() {
    measure_scatter();
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      Eigen::Matrix<double, kSystemCount, kSystemCount> normal;
      Eigen::Matrix<double, kSystemCount, 1> right;
      normal.setZero();
      right.setZero();
      std::vector<std::array<double, kSystemCount>> weight(clock_.size()), sum(clock_.size());
      for (std::size_t e = 0; e < clock_.size(); ++e) {
        weight[e].fill(0);
        sum[e].fill(0);
        double w_all = 0, sum_all = 0;
        each(e, [&](std::size_t i) {
          if (!joins(i)) return;
          const std::size_t s = index(observation(i).id.system);
          const double w = robust_weight(i, clock_[e]);
          weight[e][s] += w;
          sum[e][s] += w * reduced(i);
          w_all += w;
          sum_all += w * reduced(i);
        });
        if (w_all == 0) continue;
        for (std::size_t s = 0; s < kSystemCount; ++s) {
          const auto row = static_cast<Eigen::Index>(s);
          right[row] += sum[e][s] - weight[e][s] * sum_all / w_all;
          normal(row, row) += weight[e][s];
          for (std::size_t q = 0; q < kSystemCount; ++q)
            normal(row, static_cast<Eigen::Index>(q)) -= weight[e][s] * weight[e][q] / w_all;
        }
      }
      // The reference is fixed at 0; systems without observations keep their bias.
      for (std::size_t s = 0; s < kSystemCount; ++s) {
        if (linked_[s] && s != index(result_.reference)) continue;
        const auto row = static_cast<Eigen::Index>(s);
        normal.row(row).setZero();
        normal.col(row).setZero();
        normal(row, row) = 1;
        right[row] = 0;
      }
      const Eigen::Matrix<double, kSystemCount, 1> step = normal.colPivHouseholderQr().solve(right);
      double largest = step.cwiseAbs().maxCoeff();
      for (std::size_t e = 0; e < clock_.size(); ++e) {
        double w_all = 0, sum_all = 0;
        for (std::size_t s = 0; s < kSystemCount; ++s) {
          w_all += weight[e][s];
          sum_all += sum[e][s] - weight[e][s] * step[static_cast<Eigen::Index>(s)];
        }
        if (w_all == 0) continue;
        largest = std::max(largest, std::abs(sum_all / w_all - clock_[e]));
        clock_[e] = sum_all / w_all;
      }
      for (std::size_t s = 0; s < kSystemCount; ++s) bias_[s] += step[static_cast<Eigen::Index>(s)];
      if (largest < kConverged_m) break;
      // The scale is fixed after a few rounds, since it and the weights could oscillate.
      if (iteration < 5) measure_scatter();
    }
    measure_scatter();
  }

  /// Huber's estimate of one epoch's clock with the current biases; returns the sum of the weights.
  template <typename Choose>
  double robust_clock(std::size_t e, Choose choose) {
    if (!median_clock(e, choose)) return 0;
    double w_all = 0;
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      double sum = 0;
      w_all = 0;
      each(e, [&](std::size_t i) {
        if (!choose(i)) return;
        const double w = robust_weight(i, clock_[e]);
        w_all += w;
        sum += w * reduced(i);
      });
      const double before = std::exchange(clock_[e], sum / w_all);
      if (std::abs(clock_[e] - before) < kConverged_m) break;
    }
    return w_all;
  }

  /// Systems that were never clear together with a linked one: their bias is the median relative to clocks of
  /// the others, of clear satellites if there are any, else of all.
  void add_weak_systems() {
    known_ = linked_;
    for (std::size_t s = 0; s < kSystemCount; ++s) {
      if (!observed_[s] || linked_[s]) continue;
      for (const bool only_clear : {true, false}) {
        std::vector<double> values;
        for (std::size_t e = 0; e < clock_.size(); ++e) {
          if (robust_clock(e, [&](std::size_t i) { return trusted(e, i); }) == 0) continue;
          each(e, [&](std::size_t i) {
            if (index(observation(i).id.system) != s || !usable(i)) return;
            if (!only_clear || clear(i)) values.push_back(reduced(i) - clock_[e]);
          });
        }
        if (const auto middle = median(values)) {
          bias_[s] = *middle;
          known_[s] = true;
          break;
        }
      }
    }
  }

  /// Whether a satellite's system has a known bias, and it is in clear view if enough others are.
  [[nodiscard]] bool trusted(std::size_t e, std::size_t i) const {
    if (!usable(i) || !known_[index(observation(i).id.system)]) return false;
    return result_.clocks[e].clear < options_.min_clear || result_.observations[i].clear;
  }

  void finish(std::size_t e) {
    EpochClock& clock = result_.clocks[e];
    clock.source = clock.clear >= options_.min_clear ? ClockSource::Clear : ClockSource::All;
    double w = robust_clock(e, [&](std::size_t i) { return trusted(e, i); });
    if (w == 0) {
      // Only systems without a link to the others: their errors are comparable among themselves.
      w = robust_clock(e, [&](std::size_t i) { return usable(i); });
      clock.source = ClockSource::All;
    }
    if (w == 0) {
      clock.source = ClockSource::None;
      (void)median_clock(e, [](std::size_t) { return true; });
    }
    clock.bias_m = origin_[e] + clock_[e];
    each(e, [&](std::size_t i) {
      PseudorangeError& error = result_.observations[i];
      error.error_m = reduced(i) - clock_[e];
      const System system = observation(i).id.system;
      result_.inter_system_bias_m[system] = bias_[index(system)];
    });
  }

  const PseudorangeResiduals& residuals_;
  const ReceiverClockOptions& options_;
  PseudorangeErrors result_;
  std::vector<double> origin_;               ///< median residual of each epoch [m]
  std::vector<double> clock_;                ///< of each epoch relative to its origin [m]
  std::vector<double> weight_;               ///< of each observation [1/m^2]
  std::array<double, kSystemCount> bias_{};  ///< [m]
  std::array<bool, kSystemCount> observed_{};
  std::array<bool, kSystemCount> linked_{};  ///< to the reference by satellites in clear view
  std::array<bool, kSystemCount> known_{};   ///< bias known, weak or not
};

}  // namespace

PseudorangeErrors remove_receiver_clock(const PseudorangeResiduals& residuals, const ClearView& clear_view,
                                        const ReceiverClockOptions& options) {
  return ClockEstimator(residuals, clear_view, options).estimate();
}

}  // namespace canyon::validation
