#include "canyon/calibration/parameters.hpp"

#include <algorithm>
#include <cmath>

namespace canyon::calibration {
namespace {

using Scale = Parameter::Scale;

double to_scale(Scale scale, double value) {
  switch (scale) {
    case Scale::Linear:
      return value;
    case Scale::Log:
      return std::log(value);
    case Scale::Logit:
      break;
  }
  return std::log(value / (1 - value));
}
double from_scale(Scale scale, double value) {
  switch (scale) {
    case Scale::Linear:
      return value;
    case Scale::Log:
      return std::exp(value);
    case Scale::Logit:
      break;
  }
  return 1 / (1 + std::exp(-value));
}

std::vector<Parameter> table() {
  using M = Moment;
  return {{kTrackingKey,
           "dB-Hz",
           Scale::Linear,
           6,
           0,
           45,
           {M::Weakest},
           "docs/profiles.md, 7 to 15 for mass market; makers' masks up to 25",
           false,
           0,
           {},
           {}},
          {kAcquisitionKey,
           "dB-Hz",
           Scale::Linear,
           6,
           0,
           50,
           {M::FirstAfterGap},
           "docs/profiles.md, 14 to 26",
           false,
           0,
           {},
           {}},
          {"signal.lock.reacquisition_s",
           "s",
           Scale::Log,
           0.7,
           0.05,
           30,
           {M::DelayInView},
           "assumed, a factor of four",
           false,
           0,
           {},
           {}},
          {"signal.cn0_sigma_db",
           "dB",
           Scale::Linear,
           0.5,
           0.01,
           5,
           {M::ChangeAtRest},
           "the profiles' 0.3 to 1",
           false,
           0,
           {},
           {}},
          {"signal.dll.loop_bandwidth_hz",
           "Hz",
           Scale::Log,
           0.7,
           0.02,
           20,
           {M::ScatterWeak, M::ScatterMiddle, M::ScatterStrong},
           "Kaplan & Hegarty, figure 5.28: 0.2 to 2",
           false,
           0,
           {},
           {}},
          {"signal.dll.spacing_chips",
           "chips",
           Scale::Log,
           0.4,
           0.05,
           0.5,
           {M::TailClear, M::WidthClear},
           "docs/profiles.md, 0.1 to 0.5",
           false,
           0,
           {},
           {}},
          {"noise.sigma_m_per_sqrt_s",
           "m/sqrt(s)",
           Scale::Log,
           0.7,
           0.01,
           5,
           {M::WidthClear},
           "assumed, a factor of four",
           false,
           0,
           {},
           {}},
          {"position_filter.acceleration_horizontal",
           "m/s^2/sqrt(Hz)",
           Scale::Log,
           0.7,
           0.01,
           20,
           {M::FixRoughness},
           "the profiles' 0.5 to 3 for cars",
           false,
           0,
           {},
           {}},
          {"propagation.diffuse.scattering_coefficient",
           "",
           Scale::Linear,
           0.15,
           0.02,
           1,
           {M::NlosMedian},
           "docs/diffuse.md",
           true,
           0,
           {},
           {}},
          {kFacadesKey,
           "",
           Scale::Logit,
           1,
           0.01,
           0.99,
           {M::NlosMedian},
           "docs/city.md: 14 % by ITU-R M.2412 to 70 % by 3GPP TR 38.901",
           true,
           0,
           {},
           {}}};
}

}  // namespace

double Parameter::value(double x) const {
  return std::clamp(from_scale(scale, centre + deviation * x), low, high);
}
bool Parameter::within(double x) const {
  const double free = from_scale(scale, centre + deviation * x);
  return free >= low && free <= high;
}

std::map<std::string, double> facade_shares_of(double strong_share) {
  const double percent = std::round(1000 * strong_share) / 10;
  return {{"coated_glass", percent}, {"concrete", 100 - percent}};
}

std::vector<Parameter> parameters_of(const Values& profile, bool environment) {
  const auto is = [&profile](const char* key, const char* value) {
    const auto at = profile.find(key);
    return at != profile.end() && at->second == value;
  };
  std::vector<Parameter> result;
  for (Parameter& p : table()) {
    if (p.environment && !environment) continue;
    if (p.key == kFacadesKey) {
      constexpr double kMiddle = 0.35;
      p.centre = to_scale(p.scale, kMiddle);
      p.before = "as the scenario has them";
      result.push_back(std::move(p));
      continue;
    }
    const double value = number_of(profile, p.key);
    p.before = profile.at(p.key);
    p.centre = to_scale(p.scale, std::clamp(value, p.low, p.high));
    if (p.key == "signal.dll.loop_bandwidth_hz" && is("signal.loop_noise", "false")) {
      p.missing = "signal.loop_noise is off";
    } else if (p.key == "noise.sigma_m_per_sqrt_s" && is("noise.enabled", "false")) {
      p.missing = "noise is off";
    } else if (p.key == "propagation.diffuse.scattering_coefficient" &&
               is("propagation.diffuse.enabled", "false")) {
      p.missing = "diffuse scattering is off";
    } else if (value > p.high) {
      p.missing = "the profile's value lies beyond what is fitted";
    }
    result.push_back(std::move(p));
  }
  return result;
}

void keep_thresholds_in_order(Values& values) {
  const auto tracking = values.find(kTrackingKey), acquisition = values.find(kAcquisitionKey);
  if (tracking == values.end() || acquisition == values.end()) return;
  if (number_of(values, kAcquisitionKey) < number_of(values, kTrackingKey))
    acquisition->second = tracking->second;
}

double least_deviation(Moment moment) {
  switch (moment) {
    case Moment::Weakest:
      return 0.3;
    case Moment::FirstAfterGap:
    case Moment::NlosLow:
    case Moment::NlosMedian:
    case Moment::NlosHigh:
      return 0.5;
    case Moment::DelayInView:
      return 0.2;
    case Moment::ChangeAtRest:
      return 0.02;
    case Moment::NlosTracked:
      return 0.02;
    case Moment::NlosError:
    case Moment::NlosErrorHigh:
      return 1;
    case Moment::ScatterStrong:
    case Moment::ScatterMiddle:
    case Moment::ScatterWeak:
    case Moment::WidthClear:
    case Moment::TailClear:
    case Moment::FixRoughness:
    case Moment::Count:
      break;
  }
  return 0.05;
}

}  // namespace canyon::calibration
