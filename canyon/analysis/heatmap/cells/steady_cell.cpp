#include "canyon/analysis/heatmap/cells/steady_cell.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/paths/signal/path_strength.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/tracking/channel_fading.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Vector3d;
using propagation::Path;
using propagation::PathKind;

std::complex<double> phasor(double cycles) {
  return std::polar(1.0, -2 * geodesy::kPi * (cycles - std::trunc(cycles)));
}

/// Steps of directions of computed obstacles: 1.4 deg; obstacles are equal over tens of degrees of azimuth.
constexpr double kArrivalSteps = 40;

}  // namespace

SteadyCell::SteadyCell(const SteadySky& sky, const propagation::Propagator& propagator,
                       const receiver::ReceiverOptions& options, const LimitOptions& limits,
                       const Eigen::Matrix3d& ecef_from_enu, bool moves)
    : sky_(sky),
      propagator_(propagator),
      options_(options),
      limits_(limits),
      ecef_from_enu_(ecef_from_enu),
      noise_sigma_m_(options.reported_noise_m()),
      moves_(moves),
      fix_(sky.fix_satellites(), options.fix),
      skylines_(sky.skylines()),
      traced_(sky.satellites().size()),
      delay_m_(sky.padded()),
      power_(sky.padded()),
      tracked_(sky.padded()),
      ranges_(static_cast<std::size_t>(sky.lanes())) {
  for (const SteadySatellite& satellite : sky.satellites())
    direct_factors_.emplace_back(satellite.direct_factor.begin(), satellite.direct_factor.end());
}

PathNode SteadyCell::trace(const Vector3d& point) {
  propagation::TracedPoint found;
  propagator_.trace(point, sky_.directions(), traced_, &found);
  PathNode node;
  node.position = point;
  node.edges.assign(found.edges.begin(), found.edges.end());
  std::sort(node.edges.begin(), node.edges.end());
  for (std::uint32_t i = 0; i < traced_.size(); ++i) {
    const SteadySatellite& satellite = sky_.satellites()[i];
    for (const Path& path : traced_[i].paths) {
      if (path.kind != PathKind::Diffuse && path.order < 2) continue;
      NodePath& far = node.paths.emplace_back();
      far.satellite = i;
      far.diffuse = path.kind == PathKind::Diffuse;
      far.excess_m = path.excess_m;
      far.rate_mps = tracking::path_rate_mps(satellite.line, Vector3d::Zero(), path, ecef_from_enu_);
      far.amplitude = signal::path_amplitude(path, satellite.line.elevation_rad, satellite.carrier_hz,
                                             options_.signal.antenna, options_.signal.strength);
      far.reflector = path.reflector;
      far.arrival = path.arrival.cast<float>();
    }
  }
  return node;
}

std::pair<SteadyCell::Reflector&, bool> SteadyCell::reflector(std::uint64_t key, std::size_t satellite,
                                                              std::uint64_t name) {
  const auto [found, made] = reflectors_.try_emplace(mix64(key + kGolden64 * (satellite + 1)));
  Reflector& r = found->second;
  if (!made) return {r, false};
  r.re.resize(sky_.padded());
  r.im.resize(sky_.padded());
  sky_.phases_of(satellite, name, r.re.data(), r.im.data());
  return {r, true};
}

const SteadyCell::Reflector& SteadyCell::reflector(std::size_t satellite, const Path& path) {
  std::uint64_t key = path.reflector;
  for (int i = 0; i < path.incidence_count; ++i)
    key = mix64(key + static_cast<std::uint64_t>(path.incidences[static_cast<std::size_t>(i)].material) + 1);
  const auto [r, made] = reflector(key, satellite, path.reflector);
  if (!made) return r;
  const SteadySatellite& s = sky_.satellites()[satellite];
  Path without_detour = path;
  without_detour.excess_m = 0;
  r.amplitude = signal::path_amplitude(without_detour, s.line.elevation_rad, s.carrier_hz,
                                       options_.signal.antenna, options_.signal.strength);
  return r;
}

void SteadyCell::move_to(const Vector3d& point, const raytrace::RayScene& scene) {
  obstacles_.clear();
  const double height_m = scene.height_above_ground(point);
  for (disturbance::Skyline& each : skylines_) each.go_to(point.head<2>(), height_m);
  for (std::size_t k = 0; k < direct_factors_.size(); ++k) {
    const SteadySatellite& satellite = sky_.satellites()[k];
    for (std::size_t d = 0; d < skylines_.size(); ++d) {
      const double level_db = skylines_[d].level_db(satellite.direction);
      direct_factors_[k][d + 1] =
          static_cast<float>(satellite.direct_factor[d + 1] * std::pow(10, level_db / 20));
    }
  }
}

const float* SteadyCell::obstacles(const Vector3d& arrival) {
  if (skylines_.empty()) return nullptr;
  std::uint64_t key = 0;
  Vector3d rounded;
  for (int axis = 0; axis < 3; ++axis) {
    rounded[axis] = std::round(arrival[axis] * kArrivalSteps);
    key = 128 * key + static_cast<std::uint64_t>(rounded[axis] + kArrivalSteps);
  }
  const auto [found, made] = obstacles_.try_emplace(key);
  if (made) {
    found->second.resize(sky_.padded(), 1);
    for (std::size_t d = 0; d + 1 < static_cast<std::size_t>(sky_.lanes()); ++d) {
      found->second[d + 1] =
          static_cast<float>(std::pow(10, skylines_[d].level_db(rounded.normalized()) / 20));
    }
  }
  return found->second.data();
}

/// The paths of one satellite.
void SteadyCell::gather(std::size_t satellite, std::span<const NodePath> far, const Vector3d& from_node) {
  const SteadySatellite& s = sky_.satellites()[satellite];
  paths_.clear();
  for (const Path& path : traced_[satellite].paths) {
    CellPath& p = paths_.emplace_back();
    p.excess_m = path.excess_m;
    p.rate_mps = tracking::path_rate_mps(s.line, Vector3d::Zero(), path, ecef_from_enu_);
    if (path.kind == PathKind::Reflected) {
      const Reflector& r = reflector(satellite, path);
      p.amplitude = r.amplitude * phasor(path.excess_m / s.wavelength_m);
      p.re = r.re.data();
      p.im = r.im.data();
    } else {
      p.amplitude = signal::path_amplitude(path, s.line.elevation_rad, s.carrier_hz, options_.signal.antenna,
                                           options_.signal.strength);
    }
    p.factor = path.kind == PathKind::Direct ? direct_factors_[satellite].data() : obstacles(path.arrival);
  }
  std::size_t bundles = 0;
  for (const NodePath& path : far) {
    CellPath& p = paths_.emplace_back();
    const Vector3d arrival = path.arrival.cast<double>();
    // Exact over planes, of first order over facades that scatter (antenna_image()).
    const double longer_m = (s.direction - arrival).dot(from_node);
    p.excess_m = std::max(0.0, path.excess_m + longer_m);
    p.rate_mps = path.rate_mps;
    p.amplitude = path.amplitude * phasor(longer_m / s.wavelength_m);
    p.diffuse = path.diffuse;
    p.factor = obstacles(arrival);
    if (path.diffuse) {
      const std::size_t at = bundles++ * sky_.padded();
      assert(at < s.fade_re.size());
      p.re = s.fade_re.data() + at;
      p.im = s.fade_im.data() + at;
      p.power = s.fade_power.data() + at;
    } else {
      const Reflector& r = reflector(path.reflector, satellite, path.reflector).first;
      p.re = r.re.data();
      p.im = r.im.data();
    }
  }
}

/// Each lane tracks the carrier of its strongest path.
void SteadyCell::follow_strongest() {
  const auto lanes = static_cast<std::size_t>(sky_.lanes());
  std::array<float, 64> strongest;
  std::vector<float> many;
  float* best = strongest.data();
  if (lanes > strongest.size()) {
    many.resize(lanes);
    best = many.data();
  }
  std::fill(best, best + lanes, -1.0F);
  for (std::size_t p = 0; p < paths_.size(); ++p) {
    const auto size = static_cast<float>(std::abs(paths_[p].amplitude));
    const float* factor = paths_[p].factor;
    for (std::size_t i = 0; i < lanes; ++i) {
      const float here = factor != nullptr ? size * factor[i] : size;
      if (here > best[i]) {
        best[i] = here;
        tracked_[i] = p;
      }
    }
  }
}

/// A path relative to the tracked one of a channel, as in Channel::gather().
SteadyCell::PathSum SteadyCell::path_sum(const SteadySatellite& s, const CellPath& path,
                                         const CellPath& tracked) const {
  PathSum result;
  const double power = std::norm(path.amplitude);
  const double fading_hz = tracking::fading_rate_hz(path.rate_mps - tracked.rate_mps, s.wavelength_m);
  if (!path.diffuse) {
    const tracking::BatchCodeLock::CoherenceWeights weights = s.code->average(fading_hz);
    result.re = static_cast<float>(path.amplitude.real() * weights.coherent);
    result.im = static_cast<float>(path.amplitude.imag() * weights.coherent);
    result.incoherent = static_cast<float>(power * weights.incoherent);
    return result;
  }
  const tracking::DllOptions& dll = s.code->tracker().options();
  const double coherence_m = tracking::kCoherenceWavelengths * s.wavelength_m;
  const std::complex<double> rate(path.excess_m * s.direction_rate_radps / coherence_m,
                                  -2 * geodesy::kPi * fading_hz);
  const tracking::ClusterWeight bundle =
      tracking::cluster_weight(rate, dll.loop_bandwidth_hz, dll.integration_s);
  const std::complex<double> unit = path.amplitude / std::sqrt(power) * std::sqrt(bundle.coherent);
  result.re = static_cast<float>(unit.real());
  result.im = static_cast<float>(unit.imag());
  // The fraction already contains the integration's loss once.
  result.coherent = static_cast<float>(bundle.coherent);
  result.incoherent = 1 - result.coherent;
  result.mean = static_cast<float>(power * bundle.integrated);
  return result;
}

/// Channel::gather() at a receiver's first epoch, for all lanes.
void SteadyCell::fill_lanes(const SteadySatellite& s) {
  const auto lanes = static_cast<std::size_t>(sky_.lanes());
  const double chip_m = s.code->tracker().correlation().chip_m();
  lanes_.clear(lanes);
  for (const CellPath& p : paths_) {
    const std::size_t at = lanes_.add(p.excess_m / chip_m);
    sums_.assign(paths_.size(), std::nullopt);
    for (std::size_t i = 0; i < lanes; ++i) {
      std::optional<PathSum>& known = sums_[tracked_[i]];
      if (!known) known = path_sum(s, p, paths_[tracked_[i]]);
      const PathSum& c = *known;
      const float factor = p.factor != nullptr ? p.factor[i] : 1;
      float re = c.re, im = c.im;
      if (p.re != nullptr) {
        re = c.re * p.re[i] - c.im * p.im[i];
        im = c.re * p.im[i] + c.im * p.re[i];
      }
      float size = factor, spread = c.incoherent * factor * factor;
      if (p.diffuse) {
        const float now = c.mean * factor * factor * (c.coherent * p.power[i] + (1 - c.coherent));
        size = std::sqrt(now);
        spread = now * c.incoherent;
      }
      lanes_.re[at + i] = re * size;
      lanes_.im[at + i] = im * size;
      lanes_.incoherent[at + i] = spread;
    }
  }
}

/// Adds each lane's measurement of one satellite, and counts the satellite in the lane without noise.
void SteadyCell::measure(std::size_t satellite) {
  const SteadySatellite& s = sky_.satellites()[satellite];
  const tracking::SignalLockOptions& lock = options_.signal.lock;
  const bool direct =
      !traced_[satellite].paths.empty() && traced_[satellite].paths.front().kind == PathKind::Direct;
  if (paths_.empty()) {
    std::fill(power_.begin(), power_.end(), 0.0F);
  } else {
    follow_strongest();
    fill_lanes(s);
    s.code->lock(lanes_, delay_m_, power_);
  }
  positioning::Measurement m;
  m.sigma_factor = s.sigma_factor;
  bool tracks = false, keeps_track = false;
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    if (!(power_[i] > 0)) continue;
    const double ratio_hz = s.clear_cn0_hz[i] * static_cast<double>(power_[i]) / s.peak_power;
    const double cn0_dbhz = 10 * std::log10(ratio_hz);
    if (i == 0) {
      tracks = cn0_dbhz >= lock.acquisition_threshold_dbhz;
      keeps_track = cn0_dbhz >= lock.tracking_threshold_dbhz;
    }
    if (cn0_dbhz < lock.acquisition_threshold_dbhz) continue;
    const double jitter_m = s.noise ? s.noise->sigma_m(ratio_hz) : 0;
    double reported_dbhz = cn0_dbhz + s.cn0_noise_db[i];
    const double step_db = options_.signal.cn0_step_db;
    if (step_db > 0) reported_dbhz = step_db * std::round(reported_dbhz / step_db);
    if (reported_dbhz < options_.fix.cn0_mask_dbhz) continue;
    m.cn0_dbhz = reported_dbhz;
    m.sigma_m = std::hypot(noise_sigma_m_, jitter_m);
    if (m.sigma_m == 0) m.sigma_m = 1;
    m.sigma_m *= s.sigma_factor;
    const double error_m = static_cast<double>(delay_m_[i]) + s.error_m[i] + s.code_normal[i] * jitter_m;
    ranges_[i].push_back(cell_range(satellite, error_m, m, s.line.elevation_rad, options_.fix.weights));
  }
  los_ += direct ? 1 : 0;
  ++(tracks ? visible_ : blocked_);
  if (!tracks) return;
  nlos_ += !direct && keeps_track ? 1 : 0;
  largest_excess_m_ = std::max(largest_excess_m_, static_cast<double>(delay_m_[0]));
}

void SteadyCell::locate(bool statistics, CellValues& values) {
  values.set_satellites(los_, visible_, blocked_, nlos_, largest_excess_m_);
  const CellFix::CellSolution quiet = fix_.solve(ranges_[0], true);
  values.set(Layer::Availability, quiet.solved ? 1 : 0);
  values.set(Layer::SatellitesUsed, quiet.used);
  if (quiet.solved) {
    values.set_fix(quiet.error, quiet.dop,
                   positioning::horizontal_protection_level_m(quiet.covariance, limits_.protection_factor));
  }
  if (moves_) {
    fixes_.clear();
    for (const std::vector<CellRange>& ranges : ranges_) fixes_.push_back(fix_.solve(ranges, true));
    return;
  }
  if (ranges_.size() == 1) return;
  SampledFixes fixes;
  for (std::size_t i = 1; i < ranges_.size(); ++i) {
    const CellFix::CellSolution result = fix_.solve(ranges_[i], statistics);
    if (result.solved) fixes.add(result.error, result.covariance, limits_);
  }
  const auto sample_count = static_cast<int>(ranges_.size()) - 1;
  values.set(Layer::Availability, static_cast<double>(fixes.horizontal_m.size()) / sample_count);
  if (statistics) fixes.describe(limits_, sample_count, values);
}

void SteadyCell::solve(const Vector3d& point, std::span<const propagation::KnownEdge> edges,
                       const PathNode& node, bool statistics, CellValues& values) {
  position_ = point;
  propagator_.trace_first_order(point, sky_.directions(), edges, traced_);
  compute(point - node.position, node, statistics, values);
}

void SteadyCell::solve(const Vector3d& point, bool statistics, CellValues& values) {
  position_ = point;
  const PathNode node = trace(point);
  for (propagation::SatellitePaths& satellite : traced_)
    std::erase_if(satellite.paths,
                  [](const Path& path) { return path.kind == PathKind::Diffuse || path.order >= 2; });
  compute(Vector3d::Zero(), node, statistics, values);
}

/// Solves a cell whose first-order paths are traced.
void SteadyCell::compute(const Vector3d& from_node, const PathNode& node, bool statistics,
                         CellValues& values) {
  const std::span<const NodePath> far = node.paths;
  for (std::vector<CellRange>& ranges : ranges_) ranges.clear();
  los_ = nlos_ = visible_ = blocked_ = 0;
  largest_excess_m_ = 0;
  std::size_t first = 0;
  for (std::size_t k = 0; k < traced_.size(); ++k) {
    std::size_t last = first;
    while (last < far.size() && far[last].satellite == k) ++last;
    gather(k, far.subspan(first, last - first), from_node);
    first = last;
    measure(k);
  }
  locate(statistics, values);
}

}  // namespace canyon::heatmap
