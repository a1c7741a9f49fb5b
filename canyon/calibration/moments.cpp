#include "canyon/calibration/moments.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "canyon/base/statistics.hpp"

namespace canyon::calibration {
namespace {

constexpr double kGap_s = 3, kLongest_s = 10, kViewLasts_s = 5, kRest_mps = 0.05;
constexpr std::array<double, 2> kStrengths_dbhz{42, 34};
constexpr std::size_t kFewestEvents = 6, kFewest = 60;

/// Equal values spread evenly over the step that they were rounded to: quantiles then move smoothly.
void spread_ties(std::vector<double>& values, double step) {
  std::sort(values.begin(), values.end());
  for (std::size_t begin = 0; begin < values.size();) {
    std::size_t end = begin;
    const double value = values[begin];
    while (end < values.size() && values[end] == value) ++end;
    for (std::size_t i = begin; i < end; ++i) {
      values[i] =
          value + step * ((static_cast<double>(i - begin) + 0.5) / static_cast<double>(end - begin) - 0.5);
    }
    begin = end;
  }
}

class Collector {
 public:
  Collector(const Observed& o, std::span<const std::uint16_t> weights) : o_(o), weights_(weights) {
    for (const Series& series : o.series) {
      if (series.first()) add(series);
    }
    add_changes();
  }

  [[nodiscard]] Moments result(double step_db) {
    Moments m;
    const auto set = [&m](Moment moment, std::optional<double> value) {
      m.at(static_cast<std::size_t>(moment)) = value;
    };
    const auto at = [](std::vector<double>& values, std::size_t fewest, double p) {
      return values.size() < fewest ? std::nullopt : quantile(values, p);
    };
    const auto mean = [](const std::vector<double>& values, std::size_t fewest) -> std::optional<double> {
      if (values.size() < fewest) return {};
      double sum = 0;
      for (const double v : values) sum += v;
      return sum / static_cast<double>(values.size());
    };
    const auto log_of = [](const std::optional<double>& value) {
      return value && *value > 1e-6 ? std::optional(std::log(*value)) : std::nullopt;
    };
    for (std::vector<double>* stated : {&cn0_, &first_, &nlos_cn0_, &los_cn0_}) spread_ties(*stated, step_db);
    set(Moment::Weakest, at(cn0_, kFewest, 0.02));
    set(Moment::FirstAfterGap, at(first_, kFewestEvents, 0.25));
    set(Moment::DelayInView, mean(delays_s_, kFewestEvents));
    set(Moment::ChangeAtRest, mean(changes_at_rest_, kFewest));
    for (std::size_t k = 0; k < scatter_.size(); ++k) {
      m.at(static_cast<std::size_t>(Moment::ScatterStrong) + k) = log_of(at(scatter_.at(k), kFewest, 0.5));
    }
    const auto median_error = at(errors_, kFewest, 0.5);
    if (median_error) {
      set(Moment::WidthClear, log_of(*quantile(errors_, 0.75) - *quantile(errors_, 0.25)));
      set(Moment::TailClear, log_of(*quantile(errors_, 0.95) - *median_error));
    }
    const auto los = at(los_cn0_, kFewest, 0.5);
    if (los && nlos_cn0_.size() >= kFewest) {
      set(Moment::NlosLow, *quantile(nlos_cn0_, 0.25) - *los);
      set(Moment::NlosMedian, *quantile(nlos_cn0_, 0.5) - *los);
      set(Moment::NlosHigh, *quantile(nlos_cn0_, 0.75) - *los);
    }
    if (blocked_ >= kFewest)
      set(Moment::NlosTracked, static_cast<double>(blocked_tracked_) / static_cast<double>(blocked_));
    set(Moment::NlosError, at(nlos_errors_, kFewest, 0.5));
    set(Moment::NlosErrorHigh, at(nlos_errors_, kFewest, 0.75));
    return m;
  }

 private:
  [[nodiscard]] std::size_t times(std::size_t epoch) const { return weights_.empty() ? 1 : weights_[epoch]; }
  void push(std::vector<double>& values, double value, std::size_t epoch) const {
    values.insert(values.end(), times(epoch), value);
  }

  void add(const Series& series) {
    const std::vector<Sample>& samples = series.samples;
    bool lost = false;
    double lost_s = 0;  // since when it is not tracked
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const Sample& s = samples[i];
      const double time_s = o_.time_s[s.epoch];
      const Sample* before = i > 0 && samples[i - 1].epoch + 1 == s.epoch ? &samples[i - 1] : nullptr;
      if (before != nullptr && s.clear && !before->clear && !before->tracked && lost &&
          time_s - lost_s >= kGap_s) {
        add_arrival(samples, i);
      }
      if (!s.clear) {
        blocked_ += times(s.epoch);
        blocked_tracked_ += s.tracked ? times(s.epoch) : 0;
      }
      if (!s.tracked) {
        if (!lost) lost_s = time_s;
        lost = true;
        continue;
      }
      if (s.cn0_dbhz) {
        push(cn0_, *s.cn0_dbhz, s.epoch);
        push(s.clear ? los_cn0_ : nlos_cn0_, *s.cn0_dbhz, s.epoch);
        if (lost && time_s - lost_s >= kGap_s) push(first_, *s.cn0_dbhz, s.epoch);
      }
      if (s.error_m) push(s.clear ? errors_ : nlos_errors_, *s.error_m, s.epoch);
      lost = false;
      if (before == nullptr || !s.clear || !before->clear || !s.cn0_dbhz) continue;
      const double step_s = time_s - o_.time_s[before->epoch];
      if (before->cn0_dbhz && o_.step_m[s.epoch] < kRest_mps * step_s) {
        push(changes_at_rest_, std::min(std::abs(*s.cn0_dbhz - *before->cn0_dbhz), 5.0), s.epoch);
      }
      if (s.error_m && before->error_m) {
        changes_[s.epoch].push_back({*s.error_m - *before->error_m, *s.cn0_dbhz});
      }
    }
  }

  /// A satellite that was lost comes into clear view at samples[i].
  void add_arrival(const std::vector<Sample>& samples, std::size_t i) {
    const double begin_s = o_.time_s[samples[i].epoch];
    double delay_s = kLongest_s;
    double lasts_s = 0;
    for (std::size_t k = i; k < samples.size() && samples[k].clear; ++k) {
      lasts_s = o_.time_s[samples[k].epoch] - begin_s;
      if (samples[k].tracked) delay_s = std::min(delay_s, lasts_s);
      if (lasts_s >= kLongest_s) break;
    }
    if (lasts_s >= kViewLasts_s) push(delays_s_, delay_s, samples[i].epoch);
  }

  /// Changes of errors, without what the receiver's clock puts into all of an epoch.
  void add_changes() {
    for (auto& [epoch, changes] : changes_) {
      constexpr std::size_t kFewestOfEpoch = 4;
      if (changes.size() < kFewestOfEpoch) continue;
      std::vector<double> all;
      for (const Change& c : changes) all.push_back(c.error_m);
      const double common = *median(all);
      for (const Change& c : changes) {
        std::size_t k = 0;
        while (k < kStrengths_dbhz.size() && c.cn0_dbhz < kStrengths_dbhz.at(k)) ++k;
        push(scatter_.at(k), std::abs(c.error_m - common), epoch);
      }
    }
  }

  struct Change {
    double error_m = 0, cn0_dbhz = 0;
  };
  const Observed& o_;
  std::span<const std::uint16_t> weights_;
  std::vector<double> cn0_, first_, delays_s_, changes_at_rest_, errors_, los_cn0_, nlos_cn0_, nlos_errors_;
  std::array<std::vector<double>, 3> scatter_;
  std::map<std::size_t, std::vector<Change>> changes_;  // by epoch
  std::size_t blocked_ = 0, blocked_tracked_ = 0;
};

std::optional<double> roughness(const FixErrors& fixes) {
  std::vector<double> second;
  for (std::size_t i = 2; i < fixes.size(); ++i) {
    const double d = (fixes[i] - 2 * fixes[i - 1] + fixes[i - 2]).norm();
    if (std::isfinite(d)) second.push_back(d);
  }
  if (second.size() < kFewest) return {};
  const double middle = *median(second);
  return middle > 1e-6 ? std::optional(std::log(middle)) : std::nullopt;
}

}  // namespace

std::string_view name(Moment moment) {
  static constexpr std::array<std::string_view, kMoments> kNames{"weakest C/N0",
                                                                 "first C/N0 after gaps",
                                                                 "delay after coming into view",
                                                                 "change of C/N0 at rest",
                                                                 "scatter of strong errors",
                                                                 "scatter of middling errors",
                                                                 "scatter of weak errors",
                                                                 "width of clear errors",
                                                                 "tail of clear errors",
                                                                 "roughness of own fixes",
                                                                 "C/N0 of blocked satellites, lower quartile",
                                                                 "median",
                                                                 "upper quartile",
                                                                 "blocked satellites tracked",
                                                                 "error of blocked satellites, median",
                                                                 "upper quartile of errors"};
  return kNames.at(static_cast<std::size_t>(moment));
}

Moments moments(const Observed& observed, const FixErrors& fixes, double step_db,
                std::span<const std::uint16_t> weights) {
  Moments m = Collector(observed, weights).result(step_db);
  m.at(static_cast<std::size_t>(Moment::FixRoughness)) = roughness(fixes);
  return m;
}

}  // namespace canyon::calibration
