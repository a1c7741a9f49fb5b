#include "canyon/disturbance/street_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/options/values.hpp"

namespace canyon::disturbance {
namespace {

// Length, width, height, sill; shares in Europe, the Americas, East Asia, TR 37.885.
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
  if (n.vehicles_per_km > 0) {
    n.speed_mps = std::min(n.speed_mps, kWave_mps * (kJam_per_km / n.vehicles_per_km - 1));
  }
  n.trees_per_km = o.trees_per_km.value_or(by_class.trees_per_km * by_region.trees);
  n.signs_per_km = o.signs_per_km.value_or(by_class.signs_per_km * by_region.signs);
  n.awnings_per_km = o.awnings_per_km.value_or(by_class.awnings_per_km * by_region.awnings);
  n.footbridges_per_km = o.footbridges_per_km.value_or(by_class.footbridges_per_km * by_region.footbridges);
  n.antenna_height_m = o.antenna_height_m.value_or(StreetOptions::kAntennaHeight_m);
  n.left = by_region.left;
  double sum = 0;
  for (std::size_t i = 0; i < kVehicles.size(); ++i) {
    const auto given = o.vehicle_shares.find(std::string(kVehicles.at(i).name));
    if (!o.vehicle_shares.empty()) {
      sum += given != o.vehicle_shares.end() ? given->second : 0;
    } else {
      sum += kVehicles.at(i).shares.at(static_cast<std::size_t>(o.region));
    }
    n.shares.at(i) = sum;
  }
  for (double& share : n.shares) share /= sum;
  return n;
}

void StreetOptions::validate() const {
  options::check(*this, "streets");
  if (red_s > cycle_s) {
    throw InputError(fmt::format("red_s of the streets is {}", red_s),
                     fmt::format("it runs from 0 s to one cycle, {:g} s", cycle_s));
  }
  if (vehicle_shares.empty()) return;
  double sum = 0;
  std::vector<std::string_view> names;
  for (const VehicleClass& each : kVehicles) names.push_back(each.name);
  for (const auto& [name, share] : vehicle_shares) {
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      throw InputError(fmt::format("the class of vehicles '{}' is not known", name),
                       fmt::format("write {}", fmt::join(names, ", ")));
    }
    sum += share;
  }
  if (!(sum > 0)) throw InputError("vehicle_shares are all 0", "give at least one above 0");
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
  v.named_numbers({"vehicle_shares", "",
                   "shares of vehicles instead of the region's, divided by their sum: [car=80, bus=20]"},
                  o.vehicle_shares, {0, 100}, "CLASS=SHARE");
  v.number({"speed_mps", "m/s", "speed of traffic on a free road", "by class: 13.9, 11.1 or 8.3"},
           o.speed_mps, {0, 50, true});
  v.number({"cycle_s", "s", "period of the traffic lights"}, o.cycle_s, {1, 1000});
  v.number({"red_s", "s", "red part of each period, in which traffic waits"}, o.red_s, {0, 1000});
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
            "the host's yaw, else drawn"},
           o.azimuth_deg, {0, 360, false, true});
}

}  // namespace canyon::disturbance
