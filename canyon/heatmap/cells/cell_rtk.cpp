#include "canyon/heatmap/cells/cell_rtk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/receiver/corrections.hpp"
#include "canyon/relative/correction_link.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;

}  // namespace

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
