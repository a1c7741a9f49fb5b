#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "canyon/calibration/estimate.hpp"
#include "canyon/calibration/moments.hpp"
#include "canyon/options/visitor.hpp"

// The keys that simulation fits, and what was known of them before. Private to canyon/calibration.

namespace canyon::calibration {

/// One key, as the profile's value and a normal prior about it, of its logarithm or logit where that is the
/// natural scale: x = 0 is the profile's value, x = +-2 the ends of the range that docs/profiles.md gives.
struct Parameter {
  enum class Scale : std::uint8_t { Linear, Log, Logit };
  std::string key, unit;
  Scale scale = Scale::Linear;
  double deviation = 1;  ///< of the prior, on the scale
  double low = 0, high = 1;
  std::vector<Moment> moments;  ///< without any of these nothing can be said
  std::string source;           ///< of the range
  bool environment = false;
  double centre = 0;    ///< the profile's value, on the scale
  std::string before;   ///< as written
  std::string missing;  ///< why it cannot be fitted in this profile; empty: it can

  [[nodiscard]] double value(double x) const;  ///< within [low, high]
  [[nodiscard]] bool within(double x) const;
};

inline constexpr const char* kTrackingKey = "signal.lock.tracking_threshold_dbhz";
inline constexpr const char* kAcquisitionKey = "signal.lock.acquisition_threshold_dbhz";
/// Share of facades that reflect nearly everything; no key of a profile.
inline constexpr const char* kFacadesKey = "city.facades.shares";
/// Coated glass and concrete.
[[nodiscard]] std::map<std::string, double> facade_shares_of(double strong_share);

[[nodiscard]] std::vector<Parameter> parameters_of(const Values& profile, bool environment);

/// The acquisition threshold is at least the tracking threshold.
void keep_thresholds_in_order(Values& values);

/// What moments of a right model may differ by all the same: steps of C/N0, outlines of the map.
[[nodiscard]] double least_deviation(Moment moment);

}  // namespace canyon::calibration
