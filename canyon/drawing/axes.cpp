#include "canyon/drawing/axes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/statistics.hpp"

namespace canyon::drawing {
namespace {

constexpr double kLogarithmicFrom = 30;
/// Keeps 5 from becoming 10 by rounding.
constexpr double kSlack = 1e-9;

std::vector<double> log_ticks(double low, double high) {
  std::vector<double> ticks;
  const bool every = high / low <= 2e3;
  for (double decade = std::pow(10, std::floor(std::log10(low))); decade <= high * (1 + kSlack);
       decade *= 10) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double tick = decade * factor;
      if ((every || factor == 1.0) && tick >= low * (1 - kSlack) && tick <= high * (1 + kSlack)) {
        ticks.push_back(tick);
      }
    }
  }
  return ticks;
}

}  // namespace

double nice_ceil(double x) {
  const double decade = std::pow(10, std::floor(std::log10(x)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (decade * factor >= x * (1 - kSlack)) return decade * factor;
  }
  return 10 * decade;
}

double nice_floor(double x) {
  const double decade = std::pow(10, std::floor(std::log10(x)));
  for (const double factor : {5.0, 2.0}) {
    if (decade * factor <= x * (1 + kSlack)) return decade * factor;
  }
  return decade;
}

std::vector<double> linear_ticks(double low, double high, int count) {
  const double step = nice_ceil((high - low) / count);
  std::vector<double> ticks;
  for (double k = std::ceil(low / step - kSlack); k * step <= high + kSlack * step; ++k) {
    ticks.push_back(k * step + 0.0);
  }
  return ticks;
}

double nice_time_step(double at_least_s) {
  static constexpr std::array kSteps{0.1,    0.2,    0.5,    1.0,     2.0,     5.0,    10.0,
                                     15.0,   30.0,   60.0,   120.0,   300.0,   600.0,  900.0,
                                     1800.0, 3600.0, 7200.0, 10800.0, 21600.0, 43200.0};
  for (const double step : kSteps) {
    if (step >= at_least_s) return step;
  }
  return 86400 * std::max(1.0, std::ceil(at_least_s / 86400));
}

std::string tick_label(double value) {
  if (value == 0) return "0";
  return fmt::format("{:.4g}", value);
}

double Scale::at(double value) const {
  if (std::isnan(value)) return 0;
  if (!logarithmic) return std::clamp((value - low) / (high - low), 0.0, 1.0);
  if (value <= low) return 0;
  return std::clamp(std::log(value / low) / std::log(high / low), 0.0, 1.0);
}

Scale decade_scale(double low, double high) {
  Scale scale;
  scale.logarithmic = true;
  scale.low = std::pow(10, std::floor(std::log10(low) + kSlack));
  scale.high = std::pow(10, std::ceil(std::log10(high) - kSlack));
  for (double tick = scale.low; tick < 1.5 * scale.high; tick *= 10) scale.ticks.push_back(tick);
  return scale;
}

Scale make_scale(std::vector<double> values, double tail) {
  values.erase(
      std::remove_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v) || v < 0; }),
      values.end());
  Scale scale;
  if (!values.empty()) {
    const double high = *quantile(values, 1 - tail);
    const double low = *quantile(values, std::max(tail, 0.02));
    if (low > 0 && high / low > kLogarithmicFrom) {
      scale.logarithmic = true;
      scale.high = nice_ceil(high);
      // Shows at most four decades: smaller values are as good as perfect.
      scale.low = std::max(nice_floor(low), scale.high * 1e-4);
      scale.ticks = log_ticks(scale.low, scale.high);
      return scale;
    }
    if (high > 0) {
      // A little above the largest value, so that it does not lie on the frame.
      const double step = nice_ceil(high / 5);
      scale.high = step * std::ceil(1.03 * high / step - kSlack);
    }
  }
  scale.ticks = linear_ticks(scale.low, scale.high, 5);
  return scale;
}

}  // namespace canyon::drawing
