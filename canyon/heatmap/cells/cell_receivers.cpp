#include "canyon/heatmap/cells/cell_receivers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/heatmap/kernels/tile_tasks.hpp"
#include "canyon/positioning/fix.hpp"
#include "canyon/tracking/noise.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;
using propagation::Visibility;

/// Removes signals beyond the first where no fix takes them: the first signal's measurement does not depend
/// on them.
void leave_out_unused_signals(receiver::ReceiverOptions& options) {
  if (options.ranging.combination != receiver::Combination::First || !options.ranging.uses.empty()) return;
  const std::vector<std::string> tracks = options.tracks;
  std::erase_if(options.tracks, [&](const std::string& name) {
    return std::all_of(gnss::kAllSystems.begin(), gnss::kAllSystems.end(), [&](gnss::System system) {
      const auto tracked = receiver::tracked_signals(tracks, system);
      // All satellites send the signal near L1; another first signal may be the first of some satellites
      // alone.
      const bool near_l1 = !tracked.empty() && tracked.front() == &gnss::signals_of(system).front();
      return std::none_of(tracked.begin(), tracked.end(), [&](const gnss::Signal* signal) {
        return signal->name == name && (signal == tracked.front() || !near_l1);
      });
    });
  });
}

/// East, north, up [m].
Vector3d error_of(const positioning::Fix& fix, const Vector3d& truth_ecef) {
  return geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(truth_ecef)) *
         (fix.position_ecef - truth_ecef);
}

}  // namespace

propagation::Arrival with_space(propagation::Arrival arrival, std::span<const errors::SpaceErrors> space,
                                std::size_t draw, const propagation::Antenna& antenna) {
  for (propagation::SatelliteView& view : arrival.views) view.space.reset();
  if (space.empty()) return arrival;
  const auto reception = space[draw].reception(antenna.time, antenna.position_ecef);
  for (propagation::SatelliteView& view : arrival.views) view.space = space[draw].at(view.line, reception);
  return arrival;
}

std::uint64_t seed_of(const DrawOptions& draws, geodesy::GpsTime time, int draw) {
  return RandomStream(draws.seed, fmt::format("heatmap/{}/{}", time.nanoseconds(), draw)).next();
}

std::vector<errors::SpaceErrors> space_of_draws(const simulation::Environment& environment,
                                                const DrawOptions& draws, geodesy::GpsTime time, int count,
                                                std::span<const gnss::SatelliteId> satellites) {
  std::vector<errors::SpaceErrors> space;
  if (!environment.errors()) return space;
  space.reserve(static_cast<std::size_t>(count));
  for (int d = 0; d < count; ++d) {
    space.push_back(environment.errors()->drawn_by(seed_of(draws, time, d), satellites));
  }
  return space;
}

CellReceivers::CellReceivers(const simulation::Environment& environment,
                             const propagation::Propagator& propagator,
                             const simulation::ReceiverConfig& receiver, const DrawOptions& draws,
                             const LimitOptions& limits)
    : environment_(&environment),
      propagator_(&propagator),
      options_(receiver.options),
      disturbances_(receiver.disturbances),
      streets_(simulation::streets_of(receiver, environment.city(), nullptr)),
      draws_(draws),
      limits_(limits) {
  options_.validate();
  draws_.validate();
  limits_.validate();
  options_.signal.lock.warm_start = true;
  leave_out_unused_signals(options_);
}

receiver::ReceiverEpoch CellReceivers::observe(const receiver::ReceiverOptions& options, int draw,
                                               std::span<const disturbance::Source> disturbances,
                                               const propagation::Antenna& antenna,
                                               propagation::Arrival arrival) const {
  receiver::Receiver receiver(options, seed_of(draws_, antenna.time, draw), disturbances);
  return receiver.observe({antenna, arrival, environment_->sky(), environment_->klobuchar()});
}

void CellReceivers::solve_without_noise(const propagation::Antenna& antenna,
                                        const propagation::Arrival& arrival, CellValues& values) const {
  receiver::ReceiverOptions quiet = options_;
  quiet.signal.cn0_sigma_db = 0;
  quiet.signal.satellite_sigma_db = quiet.signal.installation_sigma_db = 0;
  quiet.signal.shadowing.enabled = false;
  receiver::ReceiverEpoch epoch =
      observe(quiet, 0, disturbances_, antenna, with_space(arrival, {}, 0, antenna));
  std::vector<positioning::Measurement> measurements;
  receiver::Ranging ranging(quiet);
  int los = 0, nlos = 0;
  double largest_excess_m = 0;
  for (receiver::SatelliteObservation& satellite : epoch.satellites) {
    if (!satellite.above_mask) continue;
    los += satellite.visibility == Visibility::LOS || satellite.visibility == Visibility::LOSMultipath;
    const auto without_noise = [&](receiver::SignalObservation& signal) {
      if (!signal.measurement) return;
      signal.measurement->pseudorange_m -=
          signal.noise_m - (options_.noise.enabled ? options_.noise.ou.mu_m : 0);
    };
    without_noise(satellite);
    for (receiver::SignalObservation& signal : satellite.more) without_noise(signal);
    if (satellite.measurement) {
      nlos += satellite.visibility == Visibility::NLOS;
      largest_excess_m = std::max(largest_excess_m, satellite.excess_m);
    }
    const auto view =
        std::find_if(arrival.views.begin(), arrival.views.end(),
                     [&](const propagation::SatelliteView& each) { return each.line.id == satellite.id; });
    assert(view != arrival.views.end());
    if (const auto ranged = ranging.next(satellite, view->line.state, antenna.time, 0)) {
      measurements.push_back(ranged->measurement);
    }
  }
  values.set_satellites(los, epoch.visible, epoch.blocked, nlos, largest_excess_m);
  const positioning::Fix fix = positioning::solve_fix(epoch.receiver_time, measurements, environment_->sky(),
                                                      options_.fix, environment_->klobuchar());
  values.set(Layer::Availability, fix.solved() ? 1 : 0);
  values.set(Layer::SatellitesUsed, static_cast<double>(fix.used.size()));
  if (!fix.solved()) return;
  values.set_fix(error_of(fix, antenna.position_ecef), fix.dop,
                 positioning::horizontal_protection_level_m(fix.covariance_enu, limits_.protection_factor));
}

std::vector<disturbance::Source> CellReceivers::disturbances_at(const Vector3d& place) const {
  std::vector<disturbance::Source> disturbances = disturbances_;
  if (streets_) {
    disturbance::StreetsOptions streets = *streets_;
    streets.above_point_m = 0;
    if (const auto terrain = environment_->scene().terrain_height(place.x(), place.y())) {
      streets.street.antenna_height_m = std::clamp(place.z() - *terrain, 0.0, 1000.0);
    }
    disturbances.insert(disturbances.begin(), disturbance::streets_source(streets));
  }
  return disturbances;
}

void CellReceivers::draw(const propagation::Antenna& antenna, const propagation::Arrival& arrival,
                         std::span<const errors::SpaceErrors> space, bool statistics,
                         CellValues& values) const {
  DrawnFixes fixes;
  const std::vector<disturbance::Source> disturbances = disturbances_at(arrival.antenna_enu);
  for (int d = 0; d < draws_.draws; ++d) {
    const receiver::ReceiverEpoch epoch = observe(
        options_, d, disturbances, antenna, with_space(arrival, space, static_cast<std::size_t>(d), antenna));
    if (!epoch.fix.solved()) continue;
    fixes.add(error_of(epoch.fix, antenna.position_ecef), epoch.fix.covariance_enu, limits_);
  }
  if (options_.signal.enabled) {
    values.set(Layer::Availability, static_cast<double>(fixes.horizontal_m.size()) / draws_.draws);
  }
  if (statistics) fixes.describe(limits_, draws_.draws, values);
}

double CellReceivers::first_fix_at(geodesy::GpsTime time, const Vector3d& place,
                                   std::span<const errors::SpaceErrors> space) const {
  receiver::ReceiverOptions options = options_;
  tracking::SignalLockOptions& lock = options.signal.lock;
  lock.warm_start = false;
  if (limits_.start == StartKind::Hot) lock.cold_acquisition_s = lock.reacquisition_s;
  const std::vector<disturbance::Source> disturbances = disturbances_at(place);
  std::vector<std::unique_ptr<receiver::Receiver>> starting;
  starting.reserve(static_cast<std::size_t>(draws_.draws));
  for (int d = 0; d < draws_.draws; ++d) {
    starting.push_back(std::make_unique<receiver::Receiver>(options, seed_of(draws_, time, d), disturbances));
  }
  // The median is known as soon as more than half of them have a fix.
  const std::size_t half = starting.size() / 2;
  std::vector<double> times_s;
  for (int second = 0; second <= limits_.first_fix_s && times_s.size() <= half; ++second) {
    const geodesy::GpsTime now = time + static_cast<double>(second);
    const propagation::Arrival arrival = environment_->arrival(now, place, *propagator_);
    const propagation::Antenna antenna{now, environment_->city().frame.ecef_from_local(place),
                                       Vector3d::Zero()};
    for (std::size_t d = 0; d < starting.size(); ++d) {
      std::unique_ptr<receiver::Receiver>& one = starting[d];
      if (!one) continue;
      propagation::Arrival own = with_space(arrival, space, d, antenna);
      if (!one->observe({antenna, own, environment_->sky(), environment_->klobuchar()}).fix.solved())
        continue;
      times_s.push_back(second);
      one.reset();
    }
  }
  if (times_s.size() <= half) return std::numeric_limits<double>::quiet_NaN();
  // Receivers without a fix so far find theirs after the others.
  times_s.resize(starting.size(), times_s.back());
  return *median(times_s);
}

void CellReceivers::first_fix(const TileCells& cells, geodesy::GpsTime time, std::span<float> seconds,
                              const std::function<bool()>& stop) const {
  const auto space =
      space_of_draws(*environment_, draws_, time, draws_.draws, environment_->sky().satellites());
  spread(cells.tile.rows, [&](std::size_t row) {
    if (stop()) return;
    for (std::size_t i = row * cells.tile.columns; i < (row + 1) * cells.tile.columns; ++i) {
      if (cells.state[i] != CellState::Computed) continue;
      seconds[i] = static_cast<float>(first_fix_at(time, cells.place(i), space));
    }
  });
}

void CellReceivers::solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                          std::span<const std::span<float>> layers) const {
  assert(wanted.size() == layers.size());
  const bool statistics = std::any_of(wanted.begin(), wanted.end(),
                                      [](Layer layer) { return info(layer).draws && of_solver(layer); });
  const bool draws =
      statistics || (options_.signal.enabled &&
                     std::find(wanted.begin(), wanted.end(), Layer::Availability) != wanted.end());
  const auto space =
      space_of_draws(*environment_, draws_, time, draws ? draws_.draws : 0, environment_->sky().satellites());
  spread(cells.tile.rows, [&](std::size_t row) {
    for (std::size_t i = row * cells.tile.columns; i < (row + 1) * cells.tile.columns; ++i) {
      CellValues values;
      if (cells.state[i] == CellState::Computed) {
        const Vector3d place = cells.place(i);
        const propagation::Arrival arrival = environment_->arrival(time, place, *propagator_);
        const propagation::Antenna antenna{time, environment_->city().frame.ecef_from_local(place),
                                           Vector3d::Zero()};
        solve_without_noise(antenna, arrival, values);
        if (draws) draw(antenna, arrival, space, statistics, values);
      }
      values.store(wanted, layers, i);
    }
  });
}

}  // namespace canyon::heatmap
