#include "canyon/heatmap/cells/cell_rtk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <limits>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/heatmap/cells/cell_receivers.hpp"
#include "canyon/heatmap/kernels/tile_tasks.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/relative/correction_link.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;

simulation::ReceiverConfig warm(simulation::ReceiverConfig receiver) {
  receiver.options.validate();
  receiver.options.signal.lock.warm_start = true;
  return receiver;
}

std::vector<receiver::Receiver> receivers_of(const simulation::ReceiverConfig& config,
                                             const DrawOptions& draws, geodesy::GpsTime time) {
  std::vector<receiver::Receiver> receivers;
  for (int d = 0; d < draws.draws; ++d) {
    receivers.emplace_back(config.options, seed_of(draws, time, d), config.disturbances);
  }
  return receivers;
}

}  // namespace

CellRtk::CellRtk(const simulation::Environment& environment, const propagation::Propagator& propagator,
                 const simulation::ReceiverConfig& receiver, const simulation::ReceiverConfig& base,
                 const DrawOptions& draws, const LimitOptions& limits)
    : environment_(&environment),
      propagator_(&propagator),
      receiver_(warm(receiver)),
      base_(warm(base)),
      base_propagator_(environment.make_propagator(base.propagation)),
      draws_(draws),
      limits_(limits) {
  assert(base_.fixed);
  draws_.validate();
  limits_.validate();
  // An epoch takes some kilobytes, and all are kept for the cells of a tile.
  constexpr std::int64_t kMostEpochs = 100'000;
  const std::int64_t epochs = std::int64_t{draws_.draws} * (limits_.rtk_s + 1);
  if (epochs > kMostEpochs) {
    throw InputError(
        fmt::format("{} draws of {} s are {} epochs of the base", draws_.draws, limits_.rtk_s, epochs),
        fmt::format("layers of RTK take {} at most: fewer draws, or a shorter time", kMostEpochs));
  }
}

std::vector<std::vector<CellRtk::Corrections>> CellRtk::corrections(
    geodesy::GpsTime time, std::span<const errors::SpaceErrors> space) const {
  const Vector3d place_ecef = geodesy::ecef_from_geodetic(base_.fixed->place);
  const Vector3d place = environment_->city().frame.local_from_geodetic(base_.fixed->place);
  std::vector<receiver::Receiver> stations = receivers_of(base_, draws_, time);
  std::vector<std::vector<Corrections>> sent(static_cast<std::size_t>(limits_.rtk_s) + 1);
  for (std::size_t second = 0; second < sent.size(); ++second) {
    const geodesy::GpsTime now = time + static_cast<double>(second);
    const propagation::Arrival arrival = environment_->arrival(now, place, base_propagator_);
    const propagation::Antenna antenna{now, place_ecef, Vector3d::Zero()};
    for (std::size_t d = 0; d < stations.size(); ++d) {
      propagation::Arrival own = with_space(arrival, space, d, antenna);
      sent[second].push_back(receiver::corrections_of(
          stations[d].observe({antenna, own, environment_->sky(), environment_->klobuchar()}), place_ecef));
    }
  }
  return sent;
}

void CellRtk::solve_cell(geodesy::GpsTime time, const Vector3d& place,
                         std::span<const errors::SpaceErrors> space,
                         std::span<const std::vector<Corrections>> sent, CellValues& values) const {
  const Vector3d place_ecef = environment_->city().frame.ecef_from_local(place);
  const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(place_ecef));
  std::vector<receiver::Receiver> rovers = receivers_of(receiver_, draws_, time);
  std::vector<relative::CorrectionLink> links;
  for (std::size_t d = 0; d < rovers.size(); ++d) {
    links.emplace_back(receiver_.options.corrections, seed_of(draws_, time, static_cast<int>(d)),
                       receiver_.options.name);
  }
  std::vector<double> first_s(rovers.size(), std::numeric_limits<double>::infinity()), fixed_m;
  for (std::size_t second = 0; second < sent.size(); ++second) {
    const geodesy::GpsTime now = time + static_cast<double>(second);
    const propagation::Arrival arrival = environment_->arrival(now, place, *propagator_);
    const propagation::Antenna antenna{now, place_ecef, Vector3d::Zero()};
    for (std::size_t d = 0; d < rovers.size(); ++d) {
      if (sent[second][d]) links[d].send(now, sent[second][d], place_ecef);
      const Corrections came = links[d].take(now);
      propagation::Arrival own = with_space(arrival, space, d, antenna);
      const positioning::Fix fix =
          rovers[d].observe({antenna, own, environment_->sky(), environment_->klobuchar(), came.get()}).fix;
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

void CellRtk::solve(const TileCells& cells, geodesy::GpsTime time, std::span<const Layer> wanted,
                    std::span<const std::span<float>> layers, const std::function<bool()>& stop) const {
  assert(wanted.size() == layers.size());
  const auto space =
      space_of_draws(*environment_, draws_, time, draws_.draws, environment_->sky().satellites());
  const std::vector<std::vector<Corrections>> sent = corrections(time, space);
  spread(cells.tile.rows, [&](std::size_t row) {
    if (stop()) return;
    for (std::size_t i = row * cells.tile.columns; i < (row + 1) * cells.tile.columns; ++i) {
      CellValues values;
      if (cells.state[i] == CellState::Computed) solve_cell(time, cells.place(i), space, sent, values);
      values.store<of_rtk>(wanted, layers, i);
    }
  });
}

}  // namespace canyon::heatmap
