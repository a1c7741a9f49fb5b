#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "canyon/options/fwd.hpp"

namespace canyon::disturbance {

/// Region: its vehicles, and the side of the road on which they drive.
enum class StreetRegion : std::uint8_t {
  Europe,
  Americas,
  EastAsia,  ///< Hong Kong: on the left, with double-deckers
  Tr37885,   ///< the vehicles of 3GPP TR 37.885 V15.3.0, table 6.1.2-1 and option B of 6.1.2: on the right
};

/// Class of a street, for the numbers that are not given.
enum class StreetClass : std::uint8_t { Arterial, Street, Residential };

/// Vehicles of one kind: a box, sheet metal below the sill of its windows and glass above.
struct VehicleClass {
  std::string_view name;
  double length_m, width_m, height_m, sill_m;
  std::array<double, 4> shares;  ///< by StreetRegion, each region's sum is 1
};
/// All that there are; docs/shadowing.md has the source or the range of each number.
[[nodiscard]] std::span<const VehicleClass> vehicle_classes();

/// Objects of a street that are in no map: traffic and, along the kerbs, trees, signs, awnings
/// and footbridges. docs/shadowing.md tells physics from assumptions.
struct StreetOptions {
  bool enabled = false;
  StreetRegion region = StreetRegion::Europe;
  StreetClass street = StreetClass::Street;
  int lanes = 0;                          ///< each way, [0, 6]; 0: by class
  std::optional<double> vehicles_per_km;  ///< of each lane, [0, 65]; empty: by class
  std::map<std::string, double>
      vehicle_shares;               ///< of VehicleClass::name, over their sum; empty: the region's
  std::optional<double> speed_mps;  ///< where nothing is in the way, (0, 50]; empty: by class
  double cycle_s = 90;              ///< of traffic lights, [1, 1000]
  double red_s = 40;                ///< of each cycle, [0, cycle_s]
  /// Shares of each side, by class and region where empty: crowns, signs above the road, awnings; and
  /// footbridges across; [0, 200], footbridges [0, 20].
  std::optional<double> trees_per_km, signs_per_km, awnings_per_km, footbridges_per_km;
  /// Height of the trajectory over the road [m], [0, 1000]; empty: height_above_terrain_m of the trajectory,
  /// else kAntennaHeight_m.
  std::optional<double> antenna_height_m;
  /// The street's direction where the antenna does not move [deg], clockwise from north, [0, 360); empty: the
  /// host's, else drawn by the seed.
  std::optional<double> azimuth_deg;

  /// The roof of a car and a magnetic mount: assumed, 1.5 to 2.2 m.
  static constexpr double kAntennaHeight_m = 1.8;

  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, StreetOptions& o);

/// A street in numbers: what StreetOptions says, and of its class and region what it leaves open.
struct StreetNumbers {
  int lanes = 2;
  double vehicles_per_km = 0;
  double speed_mps = 0;  ///< of vehicles that run: the free one, or what the density leaves of it
  double trees_per_km = 0, signs_per_km = 0, awnings_per_km = 0, footbridges_per_km = 0;
  double antenna_height_m = StreetOptions::kAntennaHeight_m;
  bool left = false;             ///< vehicles drive on the left
  std::array<double, 8> shares;  ///< of vehicle_classes(), summed up: the last one that counts is 1
};
/// Speeds by the triangular fundamental diagram: min(free, w (k_j / k - 1)) with the backward wave w = 5 m/s
/// and the jam density k_j = 140 vehicles/km (G. F. Newell, Transp. Res. B 27(4), 1993, p. 281-313; numbers
/// assumed, w 4 to 6 m/s, k_j 120 to 150).
[[nodiscard]] StreetNumbers street_numbers(const StreetOptions& options);

}  // namespace canyon::disturbance
