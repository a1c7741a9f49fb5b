#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>

#include "canyon/simulation/simulator.hpp"
#include "cli/arguments.hpp"

namespace canyon::cli {

/// Arguments of commands for one position and time of a scenario.
struct SiteArguments {
  std::string scenario;
  std::string area;      ///< --at
  std::string enu;       ///< --enu
  std::string time;      ///< --time
  std::string receiver;  ///< --receiver
};

/// Adds SCENARIO, --at, --enu, --time and --receiver.
void add_site_options(Command& command, SiteArguments& arguments);

/// A scenario with its city and sky, and an antenna position: --at, --enu, or the scenario's trajectory. The
/// time is --time, or the scenario's first epoch.
class Site {
 public:
  /// Checks the arguments before it loads the city. Prints the simulation's warnings. Throws InputError with
  /// the option's name for an invalid position, time or receiver.
  explicit Site(const SiteArguments& arguments);
  Site(const Site&) = delete;
  Site& operator=(const Site&) = delete;

  [[nodiscard]] const simulation::Simulation& simulation() const { return *simulation_; }
  [[nodiscard]] const simulation::Environment& environment() const {
    return wider_ ? *wider_ : simulation_->environment();
  }
  [[nodiscard]] std::size_t receiver() const { return receiver_; }
  [[nodiscard]] const simulation::ReceiverConfig& receiver_config() const;
  /// --time, or the first epoch.
  [[nodiscard]] geodesy::GpsTime time() const { return time_; }
  /// ENU of the city [m]: the given position, or the trajectory's antenna at `t`.
  [[nodiscard]] Eigen::Vector3d antenna(geodesy::GpsTime t) const;
  [[nodiscard]] bool is_position_given() const { return enu_.has_value() || position_.has_value(); }
  [[nodiscard]] propagation::Propagator make_propagator() const;

  /// First and last epoch of the scenario.
  [[nodiscard]] geodesy::GpsTime begin() const { return simulation_->begin(); }
  [[nodiscard]] geodesy::GpsTime end() const;

  /// Extends nominal constellations, which cover the scenario's time, to [from, to]. Does nothing to other
  /// skies. Throws InputError if the span is longer than 60 days.
  void cover(geodesy::GpsTime from, geodesy::GpsTime to);
  /// Throws InputError, naming `option`, if no satellite has an ephemeris at `t`; warns if the trajectory
  /// ends before `t` or begins after it and no position was given.
  void check_time(geodesy::GpsTime t, const std::string& option) const;

 private:
  std::optional<Eigen::Vector3d> enu_;
  std::optional<geodesy::Geodetic> position_;
  std::size_t receiver_ = 0;
  geodesy::GpsTime time_;
  std::unique_ptr<simulation::Simulation> simulation_;
  std::optional<simulation::Environment> wider_;  ///< after cover(), if needed
};

}  // namespace canyon::cli
