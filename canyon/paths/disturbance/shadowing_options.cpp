#include "canyon/paths/disturbance/shadowing_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::disturbance {

namespace {

/// One elevation of the tables in docs/shadowing.md: states 1 (clear) and 2 (moderate shadow).
struct Row {
  double elevation_deg;
  double mean1_db, sigma1_db, mean2_db, sigma2_db;
  double p11, p12, p21, p22;
};
constexpr std::array<Row, 3> kUrban{{{40, -0.3, 0.73, -8.0, 4.5, 0.8628, 0.0737, 0.1247, 0.8214},
                                     {60, -0.35, 0.26, -6.3, 1.4, 0.8681, 0.0952, 0.1300, 0.8429},
                                     {80, -0.25, 0.87, -6.6, 2.3, 0.8870, 0.0562, 0.1489, 0.8039}}};
constexpr std::array<Row, 3> kSuburban{{{40, -1.0, 0.5, -3.7, 0.98, 0.8177, 0.1715, 0.1544, 0.7997},
                                        {60, -0.3, 0.91, -2.0, 0.5, 0.8177, 0.1715, 0.1544, 0.7997},
                                        {80, -0.4, 0.58, -2.5, 0.2, 0.8177, 0.1715, 0.1544, 0.7997}}};

ShadowingParameters parameters_of_row(const Row& row) {
  return {row.mean1_db,
          row.sigma1_db,
          row.mean2_db,
          row.sigma2_db,
          row.p12 / (row.p11 + row.p12),
          row.p21 / (row.p21 + row.p22)};
}

ShadowingParameters between(const ShadowingParameters& a, const ShadowingParameters& b, double fraction) {
  const auto mix = [fraction](double from, double to) { return from + fraction * (to - from); };
  return {mix(a.clear_mean_db, b.clear_mean_db),
          mix(a.clear_sigma_db, b.clear_sigma_db),
          mix(a.shadowed_mean_db, b.shadowed_mean_db),
          mix(a.shadowed_sigma_db, b.shadowed_sigma_db),
          mix(a.enter, b.enter),
          mix(a.leave, b.leave)};
}

ShadowingParameters interpolated(std::span<const Row> rows, double elevation_deg) {
  if (elevation_deg <= rows.front().elevation_deg) return parameters_of_row(rows.front());
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const double low = rows[i - 1].elevation_deg;
    const double high = rows[i].elevation_deg;
    if (elevation_deg <= high)
      return between(parameters_of_row(rows[i - 1]), parameters_of_row(rows[i]),
                     (elevation_deg - low) / (high - low));
  }
  return parameters_of_row(rows.back());
}

}  // namespace

ShadowingParameters shadowing_parameters(const ShadowingOptions& options, double elevation_rad) {
  const double elevation_deg = geodesy::degrees(elevation_rad);
  if (options.numbers) return *options.numbers;
  const bool suburban = options.environment == ShadowingEnvironment::Suburban;
  return suburban ? interpolated(kSuburban, elevation_deg) : interpolated(kUrban, elevation_deg);
}

ShadowingEnvironment environment_for(double closed_sky) {
  if (closed_sky < 0.02) return ShadowingEnvironment::Open;
  if (closed_sky < 0.07) return ShadowingEnvironment::Suburban;
  return closed_sky < 0.15 ? ShadowingEnvironment::Urban : ShadowingEnvironment::Dense;
}

void ShadowingOptions::validate() const {
  options::check(*this, "shadowing");
}

void SkylineOptions::validate() const {
  options::check(*this, "skyline");
}

double SkylineOptions::fraction_above(double above_m) const {
  const double x = 2 * std::max(0.0, above_m - kBase_m) / height_m;
  return (1 + x) * std::exp(-x);
}

std::pair<double, double> obstacle_fractions(ShadowingEnvironment environment) {
  switch (environment) {
    case ShadowingEnvironment::Urban:
      return {0, 0.5};
    case ShadowingEnvironment::Suburban:
      return {0, 0.2};
    case ShadowingEnvironment::Dense:
      return {0.25, 0.75};
    case ShadowingEnvironment::Open:
      return {0, 0};
    case ShadowingEnvironment::Auto:
      break;
  }
  return {0, 0.75};
}

SkylineOptions skyline_numbers(const ShadowingOptions& options) {
  SkylineOptions o = options.skyline;
  const auto [low, high] = obstacle_fractions(options.environment);
  if (!o.fraction) o.fraction = (low + high) / 2;
  return o;
}

void visit(options::Visitor& v, SkylineOptions& o) {
  v.number({"obstacle_fraction", "", "fraction of azimuths with an obstacle on the ground that the map lacks",
            "dense 0.5, urban 0.25, suburban 0.1; random by the seed if surroundings are auto"},
           o.fraction, {0, 1});
  v.former_name("share", "obstacle_fraction");
  v.number({"height_m", "m", "mean height of these obstacles above 2 m"}, o.height_m, {0, 100, true});
}

void visit_environment(options::Visitor& v, std::string_view key, ShadowingEnvironment& environment) {
  static constexpr std::string_view kEnvironments[]{"urban", "suburban", "dense", "open", "auto"};
  v.choice(
      {key, "",
       "statistics of shadows: urban, suburban, dense (urban, with more obstacles that the map lacks) or "
       "open (none); auto: one of them by the city"},
      environment, kEnvironments);
}

void visit(options::Visitor& v, ShadowingOptions& o) {
  v.boolean({"enabled", "", "shadows on the direct signal by objects that maps lack: vehicles, trees, signs"},
            o.enabled);
  visit_environment(v, "environment", o.environment);
  v.part("skyline", o.skyline);
  v.replaced("blockage",
             "obstacles that maps lack are now 'skyline': write skyline: {share: S}, S twice the share of "
             "blockages");
  v.number({"frame_m", "m", "length of a frame; states have a whole number of frames"}, o.frame_m,
           {2.2, 1000});
}

namespace {

// Length, width, height, sill; fractions in Europe, the Americas, East Asia, TR 37.885.
constexpr std::array<VehicleClass, 8> kVehicles{{
    {"car", 4.5, 1.8, 1.5, 0.95, {0.76, 0.50, 0.60, 0}},
    {"light_truck", 5.3, 2.0, 1.85, 1.15, {0.10, 0.36, 0.06, 0}},  // SUVs and pickups
    {"van", 5.9, 2.0, 2.4, 1.25, {0.09, 0.07, 0.17, 0}},           // and minibuses
    {"bus", 12.0, 2.55, 3.2, 1.2, {0.025, 0.02, 0.03, 0}},
    {"double_decker", 12.0, 2.5, 4.4, 1.2, {0.005, 0, 0.08, 0}},
    {"truck", 9.0, 2.5, 3.6, 3.6, {0.02, 0.05, 0.06, 0}},
    {"tr37885_passenger", 5.0, 2.0, 1.6, 0.95, {0, 0, 0, 0.8}},
    {"tr37885_bus", 13.0, 2.6, 3.0, 1.2, {0, 0, 0, 0.2}},
}};

struct ClassNumbers {
  int lanes;
  double vehicles_per_km, speed_mps, trees_per_km, signs_per_km, awnings_per_km, footbridges_per_km;
};
constexpr std::array<ClassNumbers, 3> kClasses{{
    {3, 25, 13.9, 50, 20, 20, 1},
    {2, 25, 11.1, 60, 30, 40, 0.3},
    {1, 10, 8.3, 80, 5, 5, 0},
}};

struct RegionFactors {
  bool left;
  double trees, signs, awnings, footbridges;
};
constexpr std::array<RegionFactors, 4> kRegions{{
    {false, 1, 0.2, 0.5, 0.2},
    {false, 1, 0.2, 0.5, 0.2},
    {true, 0.4, 1, 1, 1},
    {false, 0, 0, 0, 0},  // vehicles alone
}};

constexpr double kWave_mps = 5, kJam_per_km = 140;

}  // namespace

std::span<const VehicleClass> vehicle_classes() {
  return kVehicles;
}

StreetNumbers street_numbers(const StreetOptions& o) {
  const ClassNumbers& by_class = kClasses.at(static_cast<std::size_t>(o.street));
  const RegionFactors& by_region = kRegions.at(static_cast<std::size_t>(o.region));
  StreetNumbers n;
  n.lanes = o.lanes > 0 ? o.lanes : by_class.lanes;
  n.vehicles_per_km = o.vehicles_per_km.value_or(by_class.vehicles_per_km);
  n.speed_mps = o.speed_mps.value_or(by_class.speed_mps);
  if (n.vehicles_per_km > 0)
    n.speed_mps = std::min(n.speed_mps, kWave_mps * (kJam_per_km / n.vehicles_per_km - 1));
  n.trees_per_km = o.trees_per_km.value_or(by_class.trees_per_km * by_region.trees);
  n.signs_per_km = o.signs_per_km.value_or(by_class.signs_per_km * by_region.signs);
  n.awnings_per_km = o.awnings_per_km.value_or(by_class.awnings_per_km * by_region.awnings);
  n.footbridges_per_km = o.footbridges_per_km.value_or(by_class.footbridges_per_km * by_region.footbridges);
  n.antenna_height_m = o.antenna_height_m.value_or(StreetOptions::kAntennaHeight_m);
  n.left = by_region.left;
  double sum = 0;
  for (std::size_t i = 0; i < kVehicles.size(); ++i) {
    const auto given = o.vehicle_fractions.find(std::string(kVehicles.at(i).name));
    if (!o.vehicle_fractions.empty())
      sum += given != o.vehicle_fractions.end() ? given->second : 0;
    else
      sum += kVehicles.at(i).weights.at(static_cast<std::size_t>(o.region));
    n.weights.at(i) = sum;
  }
  for (double& fraction : n.weights) fraction /= sum;
  return n;
}

void StreetOptions::validate() const {
  options::check(*this, "streets");
  if (red_s > cycle_s) {
    throw InputError(fmt::format("red_phase_s of the streets is {}", red_s),
                     fmt::format("give 0 s to one cycle, {:g} s", cycle_s));
  }
  if (vehicle_fractions.empty()) return;
  double sum = 0;
  std::vector<std::string_view> names;
  names.reserve(kVehicles.size());
  for (const VehicleClass& each : kVehicles) names.push_back(each.name);
  for (const auto& [name, fraction] : vehicle_fractions) {
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      throw InputError(fmt::format("unknown class of vehicles '{}'", name),
                       fmt::format("write {}", fmt::join(names, ", ")));
    }
    sum += fraction;
  }
  if (!(sum > 0)) throw InputError("vehicle_fractions are all 0", "give at least one above 0");
}

void visit(options::Visitor& v, StreetOptions& o) {
  static constexpr std::string_view kRegionWords[]{"europe", "americas", "east_asia", "tr37885"};
  static constexpr std::string_view kClassWords[]{"arterial", "street", "residential"};
  v.boolean({"enabled", "",
             "objects that maps lack: traffic that blocks and reflects, trees, signs, awnings, footbridges; "
             "equal for all receivers of a seed"},
            o.enabled);
  v.choice({"region", "", "mix of vehicles: europe, americas, east_asia (Hong Kong), tr37885 (3GPP's)"},
           o.region, kRegionWords);
  v.choice({"class", "",
            "class of the street, which gives the defaults of the keys below: arterial, street, residential"},
           o.street, kClassWords);
  v.integer({"lanes", "lanes", "lanes in each direction; 0: by class, 3, 2 or 1"}, o.lanes, 0, 6);
  v.number({"vehicles_per_km", "1/km", "vehicles of each lane", "by class: 25, 25 or 10"}, o.vehicles_per_km,
           {0, 65});
  v.named_numbers({"vehicle_fractions", "",
                   "fractions of vehicles instead of the region's, divided by their sum: [car=80, bus=20]"},
                  o.vehicle_fractions, {0, 100}, "CLASS=SHARE");
  v.former_name("vehicle_shares", "vehicle_fractions");
  v.number({"speed_mps", "m/s", "speed of traffic on a free road", "by class: 13.9, 11.1 or 8.3"},
           o.speed_mps, {0, 50, true});
  v.number({"cycle_s", "s", "period of the traffic lights"}, o.cycle_s, {1, 1000});
  v.number({"red_phase_s", "s", "red part of each period, in which traffic waits"}, o.red_s, {0, 1000});
  v.former_name("red_s", "red_phase_s");
  v.number({"trees_per_km", "1/km", "trees on each side", "by class and region"}, o.trees_per_km, {0, 200});
  v.number({"signs_per_km", "1/km", "boards over the road, on each side", "by class and region"},
           o.signs_per_km, {0, 200});
  v.number({"awnings_per_km", "1/km", "canopies over the pavement, on each side", "by class and region"},
           o.awnings_per_km, {0, 200});
  v.number({"footbridges_per_km", "1/km", "footbridges across the street", "by class and region"},
           o.footbridges_per_km, {0, 20});
  v.number({"antenna_height_m", "m", "height of the trajectory's point above the road",
            "trajectory.height_above_terrain_m, else 1.8"},
           o.antenna_height_m, {0, 1000});
  v.number({"azimuth_deg", "deg", "azimuth of the street if the antenna does not move, from north, clockwise",
            "the host's yaw, else random"},
           o.azimuth_deg, {0, 360, false, true});
}

}  // namespace canyon::disturbance
