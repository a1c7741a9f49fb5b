// Declared in canyon/heatmap/cells/cell_solution.hpp.
// Places found by the solutions of a tile.

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <string>

#include "canyon/base/simd_clones.hpp"
#include "canyon/heatmap/cells/cell_solution.hpp"
#include "canyon/positioning/fix.hpp"
#include "canyon/positioning/protection_level.hpp"
#include "canyon/positioning/pseudorange_model.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A change of the place that counts as none [m].
constexpr double kConverged_m = 1e-6;
/// A change after which the next one is none.
constexpr double kNearlyConverged_m = 0.02;
/// Corrections of the atmosphere move a place by less than this [m]; only the end of the move is known.
constexpr double kCorrected_m = 500;
constexpr int kMostPasses = 30;

Eigen::Matrix<double, 6, 1> monomials(const Vector3d& p) {
  Eigen::Matrix<double, 6, 1> m;
  m << p.x() * p.x(), p.y() * p.y(), p.z() * p.z(), p.x() * p.y(), p.x() * p.z(), p.y() * p.z();
  return m;
}

/// Satellites as seen from a tile: valid near its time, at every place in it.
class LinesSky final : public orbit::Sky {
 public:
  /// @param lines must outlive it
  explicit LinesSky(const std::vector<orbit::LineOfSight>& lines) : lines_(lines) {}

  [[nodiscard]] std::vector<gnss::SatelliteId> satellites() const override {
    std::vector<gnss::SatelliteId> ids;
    for (const orbit::LineOfSight& line : lines_) ids.push_back(line.id);
    return ids;
  }
  [[nodiscard]] std::optional<orbit::SatelliteState> state(gnss::SatelliteId id,
                                                           geodesy::GpsTime t) const override {
    const auto line = std::find_if(lines_.begin(), lines_.end(), [id](const auto& l) { return l.id == id; });
    if (line == lines_.end()) return std::nullopt;
    orbit::SatelliteState state = line->state;
    positioning::carry(state, t - line->transmit_time);
    return state;
  }
  [[nodiscard]] std::string source(gnss::SatelliteId, geodesy::GpsTime) const override { return "a tile"; }

 private:
  const std::vector<orbit::LineOfSight>& lines_;
};

struct Extremes {
  double change_m = std::numeric_limits<double>::infinity();  ///< in the largest component
  double length_m = 0;                                        ///< in the largest sum of components
};

/// One pass of TileSolutions::converge() over all draws: x = constant + noise + linear x - curvature(x).
/// Matrices by columns; noise and x [axis][draw].
CANYON_CLONES Extremes improve(const double* constant, const double* linear, const double* curvature,
                               const double* noise, std::size_t draws, double* x) {
  double* const xs = x;
  double* const ys = x + draws;
  double* const zs = x + 2 * draws;
  double change[4] = {0, 0, 0, 0}, length[4] = {0, 0, 0, 0};
  const auto axis = [&](std::size_t k, std::size_t draw, double u, double v, double w) {
    return constant[k] + noise[k * draws + draw] + (linear[k] - curvature[k] * u) * u +
           (linear[3 + k] - curvature[3 + k] * v - curvature[9 + k] * u) * v +
           (linear[6 + k] - curvature[6 + k] * w - curvature[12 + k] * u - curvature[15 + k] * v) * w;
  };
  const auto one = [&](std::size_t draw, std::size_t lane) {
    const double u = xs[draw], v = ys[draw], w = zs[draw];
    const double east = axis(0, draw, u, v, w), north = axis(1, draw, u, v, w), up = axis(2, draw, u, v, w);
    const double changed = std::abs(east - u) + std::abs(north - v) + std::abs(up - w);
    const double far = std::abs(east) + std::abs(north) + std::abs(up);
    change[lane] = changed > change[lane] ? changed : change[lane];
    length[lane] = far > length[lane] ? far : length[lane];
    xs[draw] = east;
    ys[draw] = north;
    zs[draw] = up;
  };
  std::size_t draw = 0;
  for (; draw + 4 <= draws; draw += 4) {
    for (std::size_t lane = 0; lane < 4; ++lane) one(draw + lane, lane);
  }
  for (; draw < draws; ++draw) one(draw, 0);
  return {*std::max_element(change, change + 4), *std::max_element(length, length + 4)};
}

/// TileSolutions::at_vertical() of all draws.
CANYON_CLONES void measure(const double* x, std::size_t draws, double east, double north,
                           double* horizontal_m, double* vertical_m) {
  for (std::size_t draw = 0; draw < draws; ++draw) {
    const double u = x[draw], v = x[draws + draw], w = x[2 * draws + draw];
    const double e = u - east * w, n = v - north * w;
    horizontal_m[draw] = std::sqrt(e * e + n * n);
    vertical_m[draw] = std::abs(w + east * u + north * v);
  }
}

}  // namespace

double TileSolutions::sine(const TileSatellite& satellite, const Vector3d& place) const {
  const Vector3d towards = satellite.range_m * satellite.direction - place;
  const Vector3d up(place.x() * curvature_east_, place.y() * curvature_north_, 1);
  return towards.dot(up) / std::sqrt(towards.squaredNorm() * up.squaredNorm());
}

SetSolution::Column TileSolutions::sum(const SetSolution& set, const CellErrors& cell) const {
  SetSolution::Column sums = set.constant;
  for (int i = 0; i < cell.excesses; ++i) {
    const auto k = static_cast<std::size_t>(i);
    sums += cell.excess_m[k] * set.columns[cell.satellite[k]];
  }
  return sums;
}

Vector3d TileSolutions::error(const SetSolution& set, const SetSolution::Column& sums,
                              const Vector3d& place) const {
  Vector3d error = sums.head<3>();
  if (options_.ionosphere) error += shift_by_ionosphere(set, place);
  if (options_.troposphere) error += shift_by_troposphere(set, (*zenith_)(height_m(place)), place);
  return error;
}

TileSolutions::Terms TileSolutions::terms(const SetSolution& set, const Vector3d& error,
                                          const SetSolution::Column& sums, const Vector3d& place,
                                          bool corrected) const {
  // Terms of x = error + bend (place + x) - turning x - (curvature(place + x) - curvature(place)).
  Terms terms;
  terms.linear = Eigen::Map<const Matrix3d>(sums.data() + 3);
  terms.constant = error + terms.linear * place;
  const auto& c = set.curvature;
  terms.linear -= set.turning;
  terms.linear.col(0) -= 2 * place.x() * c.col(0) + place.y() * c.col(3) + place.z() * c.col(4);
  terms.linear.col(1) -= 2 * place.y() * c.col(1) + place.x() * c.col(3) + place.z() * c.col(5);
  terms.linear.col(2) -= 2 * place.z() * c.col(2) + place.x() * c.col(4) + place.y() * c.col(5);
  if (corrected && options_.fix.correct_ionosphere) {
    terms.constant -= shift_by_ionosphere(set, place);
    terms.linear -= set.ionosphere_slope;
  }
  return terms;
}

std::optional<Vector3d> TileSolutions::converge(const SetSolution& set, const Terms& terms,
                                                const Vector3d& place, Vector3d x, Vector3d* delay) const {
  double before = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < kMostPasses; ++pass) {
    Vector3d next = terms.constant + terms.linear * x - set.curvature * monomials(x);
    if (delay != nullptr) {
      *delay = shift_by_troposphere(set, (*zenith_)(height_m(place + x)), place + x);
      next -= *delay;
    }
    const double change = (next - x).norm();
    x = next;
    // Each pass shrinks the change by some 1e-3 (PDOP 100 and 1 km: 1e-2).
    if (change <= kConverged_m ||
        (change <= kNearlyConverged_m && change * change <= kConverged_m * x.norm())) {
      if (!positioning::is_near_ground(height_m(place + x))) return std::nullopt;
      return x;
    }
    if (!(change < before) && pass > 2) return std::nullopt;
    before = change;
  }
  return std::nullopt;
}

bool TileSolutions::each_clear_of_mask(const SatelliteSet& received, const Vector3d& place,
                                       double around_m) const {
  bool above = true;
  received.for_each([&](std::size_t i) {
    above = above && sine(satellites_[i], place) - sine_of_mask_ > around_m * sine_change_per_m_;
  });
  return above;
}

std::optional<Vector3d> TileSolutions::end_of_looks(const SetSolution& set, const SatelliteSet& received,
                                                    const Terms& terms, const Vector3d& place,
                                                    const Vector3d& x) const {
  const bool troposphere = options_.fix.correct_troposphere;
  Vector3d delay = Vector3d::Zero();
  std::optional<Vector3d> end = converge(set, terms, place, x, troposphere ? &delay : nullptr);
  if (!end) return std::nullopt;
  const Vector3d last = place + *end;
  Vector3d shift = delay;
  if (options_.fix.correct_ionosphere) shift += shift_by_ionosphere(set, last);
  const double shift_m = shift.lpNorm<1>();
  return clear_of_mask(set, received, last, shift_m) ? end : std::nullopt;
}

std::optional<CellFix> TileSolutions::locate(const CellErrors& cell, int draw) {
  const SetSolution& set = solution(cell.received);
  if (!set.solved) return std::nullopt;
  if (set.doubtful) return solve_alone(cell, draw);
  const SetSolution::Column sums = sum(set, cell);
  Vector3d by_ranges = error(set, sums, cell.place);
  if (draw != kNoDraw) by_ranges += noise(set, draw);
  const Terms plain = terms(set, by_ranges, sums, cell.place, false);
  std::optional<Vector3d> x = converge(set, plain, cell.place, plain.constant, nullptr);
  if (x && corrects_) {
    x = end_of_looks(set, cell.received, terms(set, by_ranges, sums, cell.place, true), cell.place, *x);
  } else if (x && !clear_of_mask(set, cell.received, cell.place + *x, 0)) {
    x.reset();
  }
  if (!x) return solve_alone(cell, draw);
  return CellFix{set.used, set.dop, set.spread_m, *x, true};
}

std::optional<CellFix> TileSolutions::solve_alone(const CellErrors& cell, int draw) const {
  const LinesSky sky(lines_);
  const Vector3d antenna = centre_ecef_ + enu_from_ecef_.transpose() * cell.place;
  const geodesy::Geodetic place = geodesy::geodetic_from_ecef(antenna);
  const orbit::Observer observer(antenna);
  std::vector<positioning::Measurement> measurements;
  int excess = 0;
  cell.received.for_each([&](std::size_t i) {
    const std::optional<orbit::LineOfSight> line = orbit::line_of_sight(sky, lines_[i].id, time_, observer);
    assert(line);
    const auto k = static_cast<std::size_t>(excess);
    const bool detour = excess < cell.excesses && cell.satellite[k] == i;
    if (detour) ++excess;
    double noise_m = options_.noise.enabled ? options_.noise.ou.mu_m : 0;
    if (draw != kNoDraw) noise_m += drawn_noise_m(i, static_cast<std::size_t>(draw), cell.received.drifting);
    positioning::Measurement measured;
    measured.id = line->id;
    measured.carrier_frequency_hz = line->state.carrier_frequency_hz;
    measured.pseudorange_m = positioning::pseudorange_m(
        *line, detour ? cell.excess_m[k] : 0, 0,
        positioning::atmosphere_m(options_.ionosphere, options_.troposphere, klobuchar_, line->id.system,
                                  line->state.carrier_frequency_hz, time_, place,
                                  {line->azimuth_rad, line->elevation_rad}),
        noise_m);
    measurements.push_back(measured);
  });
  const positioning::Fix fix = positioning::solve_fix(time_, measurements, sky, options_.fix, klobuchar_);
  if (!fix.solved()) return std::nullopt;
  return CellFix{static_cast<int>(fix.used.size()), fix.dop.value_or(kNoDop),
                 positioning::horizontal_protection_level_m(variance_m2_ * fix.covariance_enu, 1),
                 enu_from_ecef_ * (fix.position_ecef - antenna), false};
}

bool TileSolutions::converge_draws(const SetSolution& set, const Terms& terms, const CellErrors& cell,
                                   const CellFix& undisturbed) {
  const auto draws = static_cast<std::size_t>(draws_);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double start = undisturbed.error(static_cast<Index>(axis));
    const double* drawn = set.noise.data() + axis * draws;
    double* x = drawn_m_.data() + axis * draws;
    for (std::size_t draw = 0; draw < draws; ++draw) x[draw] = start + drawn[draw];
  }
  Extremes extremes;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    extremes = improve(terms.constant.data(), terms.linear.data(), set.curvature.data(), set.noise.data(),
                       draws, drawn_m_.data());
    if (extremes.change_m <= kNearlyConverged_m) break;
  }
  if (!(extremes.change_m <= kNearlyConverged_m)) return false;
  const double farthest = cell.place.lpNorm<1>() + extremes.length_m;
  return (farthest + kCorrected_m) * sine_change_per_m_ < set.margin &&
         positioning::is_near_ground(height_m_ - farthest) &&
         positioning::is_near_ground(height_m_ + 2 * farthest);
}

void TileSolutions::locate_draws(const CellErrors& cell, const CellFix& undisturbed,
                                 std::vector<double>& horizontal_m, std::vector<double>& vertical_m) {
  const auto draws = static_cast<std::size_t>(draws_);
  horizontal_m.clear();
  vertical_m.clear();
  const auto keep = [&](const Vector3d& error) {
    const Vector3d here = at_vertical(cell.place, error);
    horizontal_m.push_back(here.head<2>().norm());
    vertical_m.push_back(std::abs(here.z()));
  };
  const SetSolution& set = solution(cell.received);
  if (!set.solved) return;
  const SetSolution::Column sums = sum(set, cell);
  const Terms shared = terms(set, error(set, sums, cell.place), sums, cell.place, true);
  if (undisturbed.shared && !options_.fix.correct_troposphere &&
      converge_draws(set, shared, cell, undisturbed)) {
    horizontal_m.resize(draws);
    vertical_m.resize(draws);
    measure(drawn_m_.data(), draws, cell.place.x() * curvature_east_, cell.place.y() * curvature_north_,
            horizontal_m.data(), vertical_m.data());
    return;
  }
  Terms own = shared;
  for (int draw = 0; draw < draws_; ++draw) {
    if (undisturbed.shared && corrects_) {
      const Vector3d drawn = noise(set, draw);
      own.constant = shared.constant + drawn;
      if (const auto x = end_of_looks(set, cell.received, own, cell.place, undisturbed.error + drawn)) {
        keep(*x);
        continue;
      }
    }
    if (const std::optional<CellFix> fix = locate(cell, draw)) keep(fix->error);
  }
}

}  // namespace canyon::heatmap
