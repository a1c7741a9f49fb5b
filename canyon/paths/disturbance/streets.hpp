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

/// The way of an antenna's vehicle through a city [m, east and north]: the lane that it drives in, straight
/// on beyond both ends. Filled once from a trajectory, or as a host drives; const calls are thread-safe.
class Road {
 public:
  /// A place on it.
  struct Point {
    Eigen::Vector2d place;
    Eigen::Vector2d ahead;  ///< unit: its direction, over 10 m
  };

  /// The vehicle's place at a time; times that are not later than the last one change nothing.
  void add(geodesy::GpsTime time, const Eigen::Vector2d& place);
  /// Sets the vehicle's direction (unit), which is the road's while it has not moved.
  void face(const Eigen::Vector2d& ahead) { facing_ = ahead; }
  void clear();

  /// The vehicle has gone far enough to say where the road leads.
  [[nodiscard]] bool leads() const { return vertices_.size() > 1; }
  [[nodiscard]] const std::optional<Eigen::Vector2d>& facing() const { return facing_; }
  /// Way [m] up to a time, linear between those that were added, held beyond.
  [[nodiscard]] double along_m(geodesy::GpsTime time) const;
  /// Precondition: leads().
  [[nodiscard]] Point at(double along_m) const;

 private:
  struct Vertex {
    double along_m;
    Eigen::Vector2d place;
  };
  struct Knot {
    geodesy::GpsTime time;
    double along_m;
  };
  [[nodiscard]] Eigen::Vector2d place(double along_m) const;

  std::vector<Vertex> vertices_;  // at least kStep_m apart
  std::vector<Knot> knots_;
  std::optional<Eigen::Vector2d> facing_;
};

/// Traffic and furniture of one street. A function of seed, time and place: the order of calls and their
/// number do not matter.
///
/// Each lane, and each line of trees, signs or awnings, is a row of slots of one length, every one of which
/// is taken with the probability that the density asks for, by something of a class that is drawn, anywhere
/// in its slot. Rows of vehicles move as a whole:
/// - the lane of the antenna's vehicle with it (equilibrium of car following: G. F. Newell, Transp. Res. B
///   36(3), 2002, p. 195-205), with a gap about it, and with new vehicles after each 300 m of way;
/// - other lanes of its direction 10 % faster for each lane towards the middle of the road, 10 % slower
/// towards
///   the kerb, so that they stand where it stands;
/// - oncoming ones, and all where the antenna does not move, at StreetNumbers::speed_mps while their light is
///   green, and not at all while it is red.
class Street {
 public:
  Street(const StreetOptions& options, std::uint64_t seed);

  /// Bodies within kReach_m of the vehicle along the road. @param road may be null
  /// @param antenna of the receiver: the vehicle's place where the road leads nowhere; its height
  /// @param above_point_m height of the antenna over the trajectory's point
  void near(geodesy::GpsTime time, const Road* road, const Eigen::Vector3d& antenna, double above_point_m,
            std::vector<Body>& bodies) const;

  /// A double-decker's roof stands 3 deg high there.
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
  int own_lane_;  // counted from the middle of the road
  Eigen::Vector2d standing_ahead_;
};

struct StreetsOptions {
  StreetOptions street;
  std::shared_ptr<const Road> road;  ///< null: the antenna stands
  double above_point_m = 0;          ///< of the antenna over the road's points (its lever arm)
  /// The rest of a path that bodies cut stays as a Diffracted one, and weak reflections are added. False,
  /// for receivers to whom strength means nothing: what is cut is gone, and sides reflect where the mirror
  /// point lies on them.
  bool strength = true;
};

/// Bodies of a street between antenna and signals. All paths lose what the bodies on their last leg take
/// (blockage(), crown_depth_m()); a direct path that a body cuts becomes a Diffracted one, longer by the
/// detour around the nearest edge. Satellites in direct view, by the map's word, are reflected by vehicles'
/// sides (side_reflection()). At 1575.42 MHz, for all signals. A moving body changes the phase of its
/// reflection from epoch to epoch; its speed is not in the path's Doppler shift.
class Streets : public Disturbance {
 public:
  /// Throws InputError where StreetOptions::validate() does.
  Streets(const StreetsOptions& options, std::uint64_t seed);
  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override;

 private:
  void pass(const Eigen::Vector3d& antenna, propagation::SatelliteView& view,
            const Eigen::Vector3d& satellite);

  StreetsOptions options_;
  Street street_;
  std::vector<Body> bodies_;  // of the epoch in hand
};

/// The same numbers for all receivers of a seed, whatever their name.
[[nodiscard]] DisturbanceSource streets_source(const StreetsOptions& options);

}  // namespace canyon::disturbance
