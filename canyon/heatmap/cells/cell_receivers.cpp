#include "canyon/heatmap/cells/cell_receivers.hpp"

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

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;
using propagation::Visibility;

/// The receiver without signals beyond the first where no fix takes them: the first signal's measurement does
/// not depend on them.
simulation::ReceiverConfig with_used_signals(simulation::ReceiverConfig receiver) {
  receiver::ReceiverOptions& options = receiver.options;
  if (options.ranging.combination != receiver::Combination::First || !options.ranging.uses.empty()) {
    return receiver;
  }
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
  return receiver;
}

bool of_first_fix(Layer layer) {
  return layer == Layer::TimeToFirstFix;
}

/// East, north, up [m].
Vector3d error_of(const positioning::Fix& fix, const Vector3d& truth_ecef) {
  return geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(truth_ecef)) *
         (fix.position_ecef - truth_ecef);
}

}  // namespace

CellReceivers::CellReceivers(const simulation::Environment& environment,
                             const propagation::Propagator& propagator,
                             const simulation::ReceiverConfig& receiver, const DrawOptions& draws,
                             const LimitOptions& limits)
    : receivers_(environment, propagator, with_used_signals(receiver), draws), limits_(limits) {
  limits_.validate();
}

void CellReceivers::solve_without_noise(const ReceiverDraws::Scene& scene, CellValues& values) const {
  const receiver::ReceiverOptions& options = receivers_.options();
  const simulation::Environment& environment = receivers_.environment();
  receiver::ReceiverOptions quiet = options;
  quiet.signal.cn0_sigma_db = 0;
  quiet.signal.satellite_sigma_db = quiet.signal.installation_sigma_db = 0;
  quiet.signal.shadowing.enabled = false;
  receiver::Receiver receiver(quiet, receivers_.seed(scene.antenna.time, 0), receivers_.disturbances());
  receiver::ReceiverEpoch epoch = receivers_.observe(receiver, scene, {}, 0);
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
          signal.noise_m - (options.noise.enabled ? options.noise.ou.mu_m : 0);
    };
    without_noise(satellite);
    for (receiver::SignalObservation& signal : satellite.more) without_noise(signal);
    if (satellite.measurement) {
      nlos += satellite.visibility == Visibility::NLOS;
      largest_excess_m = std::max(largest_excess_m, satellite.excess_m);
    }
    const auto view =
        std::find_if(scene.arrival.views.begin(), scene.arrival.views.end(),
                     [&](const propagation::SatelliteView& each) { return each.line.id == satellite.id; });
    assert(view != scene.arrival.views.end());
    if (const auto ranged = ranging.next(satellite, view->line.state, scene.antenna.time, 0)) {
      measurements.push_back(ranged->measurement);
    }
  }
  values.set_satellites(los, epoch.visible, epoch.blocked, nlos, largest_excess_m);
  const positioning::Fix fix = positioning::solve_fix(epoch.receiver_time, measurements, environment.sky(),
                                                      options.fix, environment.klobuchar());
  values.set(Layer::Availability, fix.solved() ? 1 : 0);
  values.set(Layer::SatellitesUsed, static_cast<double>(fix.used.size()));
  if (!fix.solved()) return;
  values.set_fix(error_of(fix, scene.antenna.position_ecef), fix.dop,
                 positioning::horizontal_protection_level_m(fix.covariance_enu, limits_.protection_factor));
}

void CellReceivers::draw(const ReceiverDraws::Scene& scene, std::span<const errors::SpaceErrors> space,
                         bool statistics, CellValues& values) const {
  DrawnFixes fixes;
  const std::vector<disturbance::Source> disturbances = receivers_.disturbances_at(scene.arrival.antenna_enu);
  for (int d = 0; d < receivers_.count(); ++d) {
    receiver::Receiver receiver(receivers_.options(), receivers_.seed(scene.antenna.time, d), disturbances);
    const receiver::ReceiverEpoch epoch =
        receivers_.observe(receiver, scene, space, static_cast<std::size_t>(d));
    if (!epoch.fix.solved()) continue;
    fixes.add(error_of(epoch.fix, scene.antenna.position_ecef), epoch.fix.covariance_enu, limits_);
  }
  if (receivers_.options().signal.enabled) {
    values.set(Layer::Availability, static_cast<double>(fixes.horizontal_m.size()) / receivers_.count());
  }
  if (statistics) fixes.describe(limits_, receivers_.count(), values);
}

bool CellReceivers::solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                          std::span<const std::span<float>> layers,
                          const std::function<bool()>& /*stop*/) const {
  assert(wanted.size() == layers.size());
  const bool statistics = std::any_of(wanted.begin(), wanted.end(), over_draws);
  const bool draws =
      statistics || (receivers_.options().signal.enabled &&
                     std::find(wanted.begin(), wanted.end(), Layer::Availability) != wanted.end());
  const auto space = receivers_.space(time, draws ? receivers_.count() : 0);
  return solve_rows<of_solver>(cells, wanted, layers, {}, [&](const Vector3d& place, CellValues& values) {
    const ReceiverDraws::Scene scene =
        receivers_.look(time, place, receivers_.environment().city().frame.ecef_from_local(place));
    solve_without_noise(scene, values);
    if (draws) draw(scene, space, statistics, values);
  });
}

CellStarts::CellStarts(const simulation::Environment& environment, const propagation::Propagator& propagator,
                       const simulation::ReceiverConfig& receiver, const DrawOptions& draws,
                       const LimitOptions& limits)
    : receivers_(environment, propagator, with_used_signals(receiver), draws),
      starting_(receivers_.options()),
      limits_(limits) {
  limits_.validate();
  tracking::SignalLockOptions& lock = starting_.signal.lock;
  lock.warm_start = false;
  if (limits_.start == StartKind::Hot) lock.cold_acquisition_s = lock.reacquisition_s;
}

double CellStarts::first_fix_s(geodesy::GpsTime time, const Vector3d& place,
                               std::span<const errors::SpaceErrors> space) const {
  auto starting = receivers_.receivers_at(time, place, starting_);
  const Vector3d place_ecef = receivers_.environment().city().frame.ecef_from_local(place);
  // The median is known as soon as more than half of them have a fix.
  const std::size_t half = starting.size() / 2;
  std::vector<double> times_s;
  for (int second = 0; second <= limits_.first_fix_s && times_s.size() <= half; ++second) {
    const ReceiverDraws::Scene scene = receivers_.look(time + static_cast<double>(second), place, place_ecef);
    for (std::size_t d = 0; d < starting.size(); ++d) {
      if (!starting[d] || !receivers_.observe(*starting[d], scene, space, d).fix.solved()) continue;
      times_s.push_back(second);
      starting[d].reset();
    }
  }
  if (times_s.size() <= half) return std::numeric_limits<double>::quiet_NaN();
  // Receivers without a fix so far find theirs after the others.
  times_s.resize(starting.size(), times_s.back());
  return *median(times_s);
}

bool CellStarts::solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                       std::span<const std::span<float>> layers, const std::function<bool()>& stop) const {
  const auto space = receivers_.space(time, receivers_.count());
  return solve_rows<of_first_fix>(cells, wanted, layers, stop,
                                  [&](const Vector3d& place, CellValues& values) {
                                    values.set(Layer::TimeToFirstFix, first_fix_s(time, place, space));
                                  });
}

}  // namespace canyon::heatmap
