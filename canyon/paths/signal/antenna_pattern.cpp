#include "canyon/paths/signal/antenna_pattern.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/named.hpp"

namespace canyon::signal {
namespace {

constexpr double kDeaf = -200;
constexpr double kMax = 300;

/// A row whose LHCP gain follows from the axial ratio.
PatternPoint row(double elevation_deg, double rhcp_dbic, double axial_ratio) {
  return {elevation_deg, rhcp_dbic, rhcp_dbic - cross_polar_discrimination_db(axial_ratio)};
}

std::vector<PatternPoint> weaker(std::vector<PatternPoint> points, double by_db) {
  for (PatternPoint& point : points) {
    point.rhcp_dbic -= by_db;
    point.lhcp_dbic -= by_db;
  }
  return points;
}

void check(const std::vector<PatternPoint>& points, const std::string& name) {
  double last = -1000;
  for (const PatternPoint& point : points) {
    if (!(point.elevation_deg >= -90 && point.elevation_deg <= 90 && point.elevation_deg > last))
      throw InputError(fmt::format("antenna pattern '{}': elevation {} deg", name, point.elevation_deg),
                       "give strictly increasing elevations from -90 to 90");
    if (!(std::abs(point.rhcp_dbic) <= kMax && std::abs(point.lhcp_dbic) <= kMax))
      throw InputError(fmt::format("antenna pattern '{}': gains {} and {} dBic at {} deg", name,
                                   point.rhcp_dbic, point.lhcp_dbic, point.elevation_deg),
                       "give gains within 300 dB");
    last = point.elevation_deg;
  }
}

}  // namespace

AntennaPattern::AntennaPattern(std::string name, std::vector<PatternPoint> upper,
                               std::vector<PatternPoint> lower)
    : name_(std::move(name)), upper_(std::move(upper)), lower_(std::move(lower)) {
  if (upper_.empty())
    throw InputError(fmt::format("antenna pattern '{}' has no rows", name_), "give at least one elevation");
  for (const std::vector<PatternPoint>* points : {&upper_, &lower_}) check(*points, name_);
}

AntennaGain AntennaPattern::gain(double elevation_rad, double carrier_hz) const {
  if (std::isnan(elevation_rad)) throw InputError("elevation of NaN rad at the antenna", "give a direction");
  const std::vector<PatternPoint>& points = this->points(band_of(carrier_hz));
  if (points.empty()) {
    throw InputError(fmt::format("antenna '{}' has no pattern for {:.2f} MHz", name_, carrier_hz / 1e6),
                     "choose dual_patch, survey, phone or isotropic, or give antenna_lower_rows");
  }
  const double elevation = geodesy::degrees(elevation_rad);
  const auto above = std::upper_bound(points.begin(), points.end(), elevation,
                                      [](double e, const PatternPoint& p) { return e < p.elevation_deg; });
  if (above == points.begin()) return {points.front().rhcp_dbic, points.front().lhcp_dbic};
  if (above == points.end()) return {points.back().rhcp_dbic, points.back().lhcp_dbic};
  const PatternPoint &a = *(above - 1), &b = *above;
  const double t = (elevation - a.elevation_deg) / (b.elevation_deg - a.elevation_deg);
  return {a.rhcp_dbic + t * (b.rhcp_dbic - a.rhcp_dbic), a.lhcp_dbic + t * (b.lhcp_dbic - a.lhcp_dbic)};
}

AntennaPattern isotropic_antenna() {
  return {"isotropic", {{0, 0, kDeaf}}, {{0, 0, kDeaf}}};
}

AntennaPattern patch_antenna() {
  // Above the horizon the axial ratio grows from 2 dB as the ground plane shorts the horizontal component.
  // Below it the wave creeps around the plane's rim and both hands are equal; the back lobe is left-handed.
  return {"patch",
          {{-90, -16, -12},
           {-60, -15, -12},
           {-30, -12.5, -12},
           {-10, -8.5, -12},
           row(0, -6, 10),
           row(10, -3.5, 8),
           row(20, -1.5, 6),
           row(30, 0, 5),
           row(45, 1.5, 4),
           row(60, 2.5, 3),
           row(90, 3, 2)}};
}

AntennaPattern dual_patch_antenna() {
  const std::vector<PatternPoint> points = patch_antenna().points(Band::Upper);
  return {"dual_patch", points, weaker(points, 1)};
}

AntennaPattern survey_antenna() {
  const std::vector<PatternPoint> points{{-90, -26, -20}, {-60, -24, -20}, {-30, -19, -19},  {-10, -11, -18},
                                         row(0, -7.5, 5), row(5, -5.5, 4), row(10, -3.5, 2), row(20, -1, 2),
                                         row(30, 1, 2),   row(45, 3, 2),   row(60, 4.2, 1),  row(90, 5, 1)};
  return {"survey", points, points};
}

AntennaPattern phone_antenna() {
  return {"phone", {{0, -5, -5}}, {{0, -10, -10}}};
}

std::span<const std::string_view> antenna_names() {
  static constexpr std::string_view kNames[]{"isotropic", "patch", "dual_patch", "survey", "phone"};
  return kNames;
}

AntennaPattern antenna_by_name(std::string_view name) {
  if (name == "isotropic") return isotropic_antenna();
  if (name == "patch") return patch_antenna();
  if (name == "dual_patch") return dual_patch_antenna();
  if (name == "survey") return survey_antenna();
  if (name == "phone") return phone_antenna();
  throw unknown_name("antenna", name, {antenna_names().begin(), antenna_names().end()});
}

double cross_polar_discrimination_db(double axial_ratio_db) {
  if (!(axial_ratio_db >= 0))
    throw InputError(fmt::format("axial ratio of {} dB", axial_ratio_db), "give 0 dB or more");
  const double ratio = std::pow(10.0, axial_ratio_db / 20);
  return 20 * std::log10((ratio + 1) / (ratio - 1));
}

}  // namespace canyon::signal
