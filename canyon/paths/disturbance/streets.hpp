#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/paths/disturbance/body.hpp"
#include "canyon/paths/disturbance/disturbance.hpp"
#include "canyon/paths/disturbance/shadowing_options.hpp"
#include "canyon/paths/propagation/paths.hpp"

namespace canyon::disturbance {

/// The route of an antenna's vehicle through a city [m, east and north]: the lane of the vehicle, extended
/// straight beyond both ends. Filled once from a trajectory, or during a drive by a host. Const calls are
/// thread-safe.
class Road {
 public:
  /// A point of the route.
  struct Point {
    Eigen::Vector2d point;
    Eigen::Vector2d ahead;  ///< unit: its direction, over 10 m
  };

  /// Adds the vehicle's position at a time; times that are not later than the last one change nothing.
  void add(geodesy::GpsTime time, const Eigen::Vector2d& point);
  /// Sets the vehicle's direction (unit), which is the road's until the vehicle moves.
  void face(const Eigen::Vector2d& ahead) { facing_ = ahead; }
  void clear();

  /// Whether the vehicle has moved far enough to give the direction of the road.
  [[nodiscard]] bool leads() const { return vertices_.size() > 1; }
  [[nodiscard]] const std::optional<Eigen::Vector2d>& facing() const { return facing_; }
  /// Travelled distance [m] up to a time, linear between the added times, constant outside.
  [[nodiscard]] double along_m(geodesy::GpsTime time) const;
  /// Precondition: leads().
  [[nodiscard]] Point at(double along_m) const;

 private:
  struct Vertex {
    double along_m;
    Eigen::Vector2d point;
  };
  struct Knot {
    geodesy::GpsTime time;
    double along_m;
  };
  [[nodiscard]] Eigen::Vector2d point_at(double along_m) const;

  std::vector<Vertex> vertices_;  // at least kStep_m apart
  std::vector<Knot> knots_;
  std::optional<Eigen::Vector2d> facing_;
};

/// Traffic and furniture of one street. Depends only on seed, time and position.
///
/// Each lane, and each line of trees, signs or awnings, is a row of slots of equal length. Each slot has
/// an object, of random class and position, with a probability that follows from the density. Rows of
/// vehicles move as a whole:
/// - the lane of the antenna's vehicle moves with it (equilibrium of car following: G. F. Newell, Transp.
///   Res. B 36(3), 2002, p. 195-205), with a gap around it, and with new vehicles after each 300 m of travel;
/// - other lanes of its direction are 10 % faster for each lane towards the middle of the road and 10 %
///   slower towards the kerb, so they stop when it stops;
/// - oncoming lanes, and all lanes if the antenna does not move, have StreetNumbers::speed_mps during their
///   green light and 0 during the red one.
class Street {
 public:
  Street(const StreetOptions& options, std::uint64_t seed);

  /// Bodies within kReach_m of the vehicle along the road. @param road may be null
  /// @param antenna of the receiver: its height, and the vehicle's position if not road->leads()
  /// @param above_point_m height of the antenna over the trajectory's point
  void near(geodesy::GpsTime time, const Road* road, const Eigen::Vector3d& antenna, double above_point_m,
            std::vector<Body>& bodies) const;

  /// At this distance the roof of a double-decker has an elevation of 3 deg.
  static constexpr double kReach_m = 50;

 private:
  struct Frame;
  struct Row;
  void lanes(const Frame& frame, std::vector<Body>& bodies) const;
  void furniture(const Frame& frame, std::vector<Body>& bodies) const;
  void fill(const Frame& frame, const Row& row, std::vector<Body>& bodies) const;
  [[nodiscard]] double travelled_m(geodesy::GpsTime time, std::uint64_t direction) const;

  StreetOptions options_;
  StreetNumbers numbers_;
  std::uint64_t seed_;
  int vehicle_lane_;  // counted from the middle of the road
  Eigen::Vector2d heading_at_rest_;
};

struct StreetsOptions {
  StreetOptions street;
  std::shared_ptr<const Road> road;  ///< null: the antenna is stationary
  double above_point_m = 0;          ///< of the antenna over the road's points (its lever arm)
  /// True: the remainder of a path that bodies cut stays as a Diffracted one, and weak reflections are added.
  /// False, for receivers without signal strength: cut paths are removed, and a side reflects only if it
  /// contains the mirror point.
  bool strength = true;
};

/// Bodies of a street between antenna and signals. Each path is attenuated by the bodies on its last leg
/// (blockage(), crown_depth_m()). A direct path that a body cuts becomes a Diffracted one, longer by the
/// detour around the nearest edge. Satellites in direct view by the map are reflected by vehicles' sides
/// (side_reflection()). At 1575.42 MHz, for all signals. A moving body changes the phase of its reflection
/// from epoch to epoch; its speed is not in the path's Doppler shift.
class Streets : public Disturbance {
 public:
  /// Throws InputError if StreetOptions::validate() does.
  Streets(const StreetsOptions& options, std::uint64_t seed);
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  void pass(const Eigen::Vector3d& antenna, propagation::SatelliteView& view,
            const Eigen::Vector3d& satellite);

  StreetsOptions options_;
  Street street_;
  std::vector<Body> bodies_;  // of the current epoch
};

/// The same numbers for all receivers of a seed, whatever their name.
[[nodiscard]] DisturbanceSource streets_source(const StreetsOptions& options);

}  // namespace canyon::disturbance
