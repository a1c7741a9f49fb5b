#include "canyon/studies/heatmap/cells/cell_receivers.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/random.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/studies/heatmap/kernels/tile_tasks.hpp"

namespace canyon::heatmap {

namespace {

using Eigen::Vector3d;
using propagation::Visibility;

/// The receiver without signals beyond the first where no fix takes them: the first signal's measurement does
/// not depend on them.
simulation::ReceiverConfig with_used_signals(simulation::ReceiverConfig receiver) {
  receiver::ReceiverOptions& options = receiver.options;
  if (options.fix_input.combination != receiver::Combination::First || !options.fix_input.uses.empty()) {
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
  receiver::FixInput fix_input(quiet);
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
    if (const auto ranged = fix_input.next(satellite, view->line.state, scene.antenna.time, 0)) {
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
  const std::vector<disturbance::DisturbanceSource> disturbances =
      receivers_.disturbances_at(scene.arrival.antenna_enu);
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

ReceiverDraws::ReceiverDraws(const simulation::Environment& environment,
                             const propagation::Propagator& propagator,
                             const simulation::ReceiverConfig& receiver, const DrawOptions& draws)
    : environment_(&environment),
      propagator_(&propagator),
      options_(receiver.options),
      disturbances_(receiver.disturbances),
      streets_(simulation::streets_of(receiver, environment.city(), nullptr)),
      draws_(draws) {
  options_.validate();
  draws_.validate();
  options_.signal.lock.warm_start = true;
}

std::vector<disturbance::DisturbanceSource> ReceiverDraws::disturbances_at(const Vector3d& place) const {
  std::vector<disturbance::DisturbanceSource> disturbances = disturbances_;
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

std::vector<std::unique_ptr<receiver::Receiver>> ReceiverDraws::receivers_at(
    geodesy::GpsTime time, const Vector3d& place, const receiver::ReceiverOptions& options) const {
  const std::vector<disturbance::DisturbanceSource> disturbances = disturbances_at(place);
  std::vector<std::unique_ptr<receiver::Receiver>> receivers;
  receivers.reserve(static_cast<std::size_t>(draws_.draws));
  for (int d = 0; d < draws_.draws; ++d) {
    receivers.push_back(std::make_unique<receiver::Receiver>(options, seed(time, d), disturbances));
  }
  return receivers;
}

ReceiverDraws::Scene ReceiverDraws::look(geodesy::GpsTime now, const Vector3d& place,
                                         const Vector3d& place_ecef) const {
  return {{now, place_ecef, Vector3d::Zero()}, environment_->arrival(now, place, *propagator_)};
}

receiver::ReceiverEpoch ReceiverDraws::observe(receiver::Receiver& receiver, const Scene& scene,
                                               std::span<const errors::SpaceErrors> space, std::size_t draw,
                                               const relative::Corrections* corrections) const {
  propagation::Arrival arrival = scene.arrival;  // a copy, for it is disturbed
  for (propagation::SatelliteView& view : arrival.views) view.space.reset();
  if (!space.empty()) {
    const auto reception = space[draw].reception(scene.antenna.time, scene.antenna.position_ecef);
    for (propagation::SatelliteView& view : arrival.views) view.space = space[draw].at(view.line, reception);
  }
  return receiver.observe(
      {scene.antenna, arrival, environment_->sky(), environment_->klobuchar(), corrections});
}

CellRtk::CellRtk(const simulation::Environment& environment, const propagation::Propagator& propagator,
                 const simulation::ReceiverConfig& receiver, const simulation::ReceiverConfig& base,
                 const DrawOptions& draws, const LimitOptions& limits)
    : base_propagator_(environment.make_propagator(base.propagation)),
      rovers_(environment, propagator, receiver, draws),
      bases_(environment, base_propagator_, base, draws),
      base_place_(base.fixed->place),
      limits_(limits) {
  limits_.validate();
  // An epoch takes some kilobytes, and all are kept for the cells of a tile.
  constexpr std::int64_t kMostEpochs = 100'000;
  const std::int64_t epochs = std::int64_t{draws.draws} * (limits_.rtk_s + 1);
  if (epochs > kMostEpochs) {
    throw InputError(
        fmt::format("{} draws of {} s are {} epochs of the base", draws.draws, limits_.rtk_s, epochs),
        fmt::format("layers of RTK take {} at most: fewer draws, or a shorter time", kMostEpochs));
  }
}

std::vector<std::vector<CellRtk::Corrections>> CellRtk::corrections(
    geodesy::GpsTime time, std::span<const errors::SpaceErrors> space) const {
  const Vector3d place_ecef = geodesy::ecef_from_geodetic(base_place_);
  const Vector3d place = bases_.environment().city().frame.local_from_geodetic(base_place_);
  const auto stations = bases_.receivers_at(time, place, bases_.options());
  std::vector<std::vector<Corrections>> sent(static_cast<std::size_t>(limits_.rtk_s) + 1);
  for (std::size_t second = 0; second < sent.size(); ++second) {
    const ReceiverDraws::Scene scene = bases_.look(time + static_cast<double>(second), place, place_ecef);
    for (std::size_t d = 0; d < stations.size(); ++d) {
      sent[second].push_back(
          receiver::corrections_of(bases_.observe(*stations[d], scene, space, d), place_ecef));
    }
  }
  return sent;
}

void CellRtk::solve_cell(geodesy::GpsTime time, const Vector3d& place,
                         std::span<const errors::SpaceErrors> space,
                         std::span<const std::vector<Corrections>> sent, CellValues& values) const {
  const Vector3d place_ecef = rovers_.environment().city().frame.ecef_from_local(place);
  const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(place_ecef));
  const auto rovers = rovers_.receivers_at(time, place, rovers_.options());
  std::vector<relative::CorrectionLink> links;
  for (std::size_t d = 0; d < rovers.size(); ++d) {
    links.emplace_back(rovers_.options().corrections, rovers_.seed(time, static_cast<int>(d)),
                       rovers_.options().name);
  }
  std::vector<double> first_s(rovers.size(), std::numeric_limits<double>::infinity()), fixed_m;
  for (std::size_t second = 0; second < sent.size(); ++second) {
    const geodesy::GpsTime now = time + static_cast<double>(second);
    const ReceiverDraws::Scene scene = rovers_.look(now, place, place_ecef);
    for (std::size_t d = 0; d < rovers.size(); ++d) {
      if (sent[second][d]) links[d].send(now, sent[second][d], place_ecef);
      const Corrections came = links[d].take(now);
      const positioning::Fix fix = rovers_.observe(*rovers[d], scene, space, d, came.get()).fix;
      if (fix.kind() != positioning::FixKind::Fixed) continue;
      first_s[d] = std::min(first_s[d], static_cast<double>(second));
      fixed_m.push_back((enu * (fix.position_ecef - place_ecef)).head<2>().norm());
    }
  }
  values.set(Layer::RtkFixedShare,
             static_cast<double>(fixed_m.size()) / static_cast<double>(sent.size() * rovers.size()));
  std::sort(first_s.begin(), first_s.end());
  if (first_s[first_s.size() / 2] < std::numeric_limits<double>::infinity()) {
    values.set(Layer::RtkTimeToFix, *median(first_s));
  }
  if (const auto p95 = quantile(fixed_m, 0.95)) values.set(Layer::RtkFixedErrorP95, *p95);
}

bool CellRtk::solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                    std::span<const std::span<float>> layers, const std::function<bool()>& stop) const {
  const auto space = rovers_.space(time, rovers_.count());
  const std::vector<std::vector<Corrections>> sent = corrections(time, space);
  return solve_rows<of_rtk>(cells, wanted, layers, stop, [&](const Vector3d& place, CellValues& values) {
    solve_cell(time, place, space, sent, values);
  });
}

}  // namespace canyon::heatmap
