// Places found by the solutions of a tile; declared in cell_solution.hpp.

#include <algorithm>
#include <cmath>
#include <limits>

#include "canyon/heatmap/engine/cell_solution.hpp"
#include "canyon/positioning/pseudorange_model.hpp"
#include "canyon/propagation/index/simd_clones.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// After so many looks at mask and atmosphere positioning::solve_fix() keeps satellites out that were below
/// the mask, and the troposphere within its heights.
constexpr int kFreeLooks = 3;
constexpr int kMostLooks = 12;  ///< 20 iterations, of which 7 or 8 lead from the Earth's centre to the place
/// A change of the place that counts as none [m].
constexpr double kSettled_m = 1e-6;
/// A change after which the next one is none.
constexpr double kNearlySettled_m = 0.02;
/// More than corrections of the atmosphere move a place, of which only the end is known.
constexpr double kCorrected_m = 500;
constexpr int kMostPasses = 30;

Eigen::Matrix<double, 6, 1> monomials(const Vector3d& p) {
  Eigen::Matrix<double, 6, 1> m;
  m << p.x() * p.x(), p.y() * p.y(), p.z() * p.z(), p.x() * p.y(), p.x() * p.z(), p.y() * p.z();
  return m;
}

struct Extremes {
  double change_m = std::numeric_limits<double>::infinity();  ///< in the largest component
  double length_m = 0;                                        ///< in the largest sum of components
};

/// One pass of TileSolutions::settle() over all draws: x = constant + noise + linear x - curvature(x).
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

Vector3d TileSolutions::atmosphere_in_signal(const SetSolution& set, const Vector3d& place) const {
  Vector3d error = Vector3d::Zero();
  if (options_.ionosphere) error += set.ionosphere + set.ionosphere_slope * place;
  if (options_.troposphere) {
    error += (*zenith_)(height_m(place), false) * (set.troposphere + set.troposphere_slope * place);
  }
  return error;
}

TileSolutions::Terms TileSolutions::terms(const SetSolution& set, const Vector3d& error,
                                          const SetSolution::Column& sums, const Vector3d& place,
                                          bool corrected) const {
  // Of x = error + bend (place + x) - turning x - (curvature(place + x) - curvature(place)).
  Terms terms;
  terms.linear = Eigen::Map<const Matrix3d>(sums.data() + 3);
  terms.constant = error + terms.linear * place;
  const auto& c = set.curvature;
  terms.linear -= set.turning;
  terms.linear.col(0) -= 2 * place.x() * c.col(0) + place.y() * c.col(3) + place.z() * c.col(4);
  terms.linear.col(1) -= 2 * place.y() * c.col(1) + place.x() * c.col(3) + place.z() * c.col(5);
  terms.linear.col(2) -= 2 * place.z() * c.col(2) + place.x() * c.col(4) + place.y() * c.col(5);
  if (corrected && options_.fix.correct_ionosphere) {
    terms.constant -= set.ionosphere + set.ionosphere_slope * place;
    terms.linear -= set.ionosphere_slope;
  }
  return terms;
}

template <class Zenith>
std::optional<Vector3d> TileSolutions::settle(const SetSolution& set, const Terms& terms,
                                              const Vector3d& place, Vector3d x, Zenith&& zenith_m) const {
  double before = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < kMostPasses; ++pass) {
    Vector3d next = terms.constant + terms.linear * x - set.curvature * monomials(x);
    const std::optional<double> zenith = zenith_m(place + x);
    if (!zenith) return std::nullopt;
    if (*zenith != 0) next -= *zenith * (set.troposphere + set.troposphere_slope * (place + x));
    const double change = (next - x).norm();
    x = next;
    // Each pass shrinks the change by some 1e-3 (PDOP 100 and 1 km: 1e-2).
    if (change <= kSettled_m || (change <= kNearlySettled_m && change * change <= kSettled_m * x.norm())) {
      const double height = height_m(place + x);
      if (!(height >= positioning::kLowest_m && height <= positioning::kHighest_m)) return std::nullopt;
      return x;
    }
    if (!(change < before) && pass > 2) return std::nullopt;
    before = change;
  }
  return std::nullopt;
}

std::optional<Vector3d> TileSolutions::settle_within(const SetSolution& set, const Terms& terms,
                                                     const Vector3d& place, const Vector3d& x) const {
  return settle(set, terms, place, x, [&](const Vector3d& y) -> std::optional<double> {
    if (!options_.fix.correct_troposphere) return 0;
    const double height = height_m(y);
    if (!(height > ZenithDelay::kLowest_m && height < ZenithDelay::kHighest_m)) return std::nullopt;
    return (*zenith_)(height, true);
  });
}

std::optional<CellFix> TileSolutions::locate(const CellErrors& cell) {
  return locate(cell, kNoDraw);
}

std::optional<CellFix> TileSolutions::locate(const CellErrors& cell, int draw) {
  const SetSolution* set = &solution(cell.received);
  if (!set->solved) return std::nullopt;
  SetSolution::Column sums;
  Vector3d error;
  const auto renew = [&] {
    sums = sum(*set, cell);
    error = sums.head<3>() + atmosphere_in_signal(*set, cell.place);
    if (draw != kNoDraw) error += noise(*set, draw);
  };
  renew();
  const auto no_troposphere = [](const Vector3d&) -> std::optional<double> { return 0; };
  const Terms plain = terms(*set, error, sums, cell.place, false);
  std::optional<Vector3d> x = settle(*set, plain, cell.place, plain.constant, no_troposphere);
  if (!x) return std::nullopt;
  if (clear_of_mask(*set, cell.place + *x)) {
    if (!corrects_) return CellFix{set, *x};
    const auto corrected = settle_within(*set, terms(*set, error, sums, cell.place, true), cell.place, *x);
    if (corrected && clear_of_mask(*set, cell.place + *corrected)) return CellFix{set, *corrected};
  }

  // As positioning::solve_fix() from where it first knows the place.
  SatelliteSet above = cell.received;
  for (int look = 0; look < kMostLooks; ++look) {
    const Vector3d y = cell.place + *x;
    SatelliteSet now;
    now.drifting = above.drifting;
    cell.received.for_each([&](std::size_t i) {
      if (sine(satellites_[i], y) >= sine_of_mask_ && (look < kFreeLooks || above.contains(i))) now.insert(i);
    });
    const bool same = now == above;
    if (!same) {
      above = now;
      set = &solution(above);
      if (!set->solved) return std::nullopt;
      renew();
    }
    const double zenith = options_.fix.correct_troposphere ? (*zenith_)(height_m(y), look >= kFreeLooks) : 0;
    const std::optional<Vector3d> next =
        settle(*set, terms(*set, error, sums, cell.place, true), cell.place, *x,
               [&](const Vector3d&) -> std::optional<double> { return zenith; });
    if (!next) return std::nullopt;
    const double step = (*next - *x).norm();
    x = next;
    if (same && step < kSettled_m) return CellFix{set, *x};
  }
  return std::nullopt;
}

bool TileSolutions::settle_draws(const SetSolution& set, const Terms& terms, const CellErrors& cell,
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
    if (extremes.change_m <= kNearlySettled_m) break;
  }
  if (!(extremes.change_m <= kNearlySettled_m)) return false;
  const double farthest = cell.place.lpNorm<1>() + extremes.length_m;
  return (farthest + kCorrected_m) * sine_change_per_m_ < set.margin &&
         height_m_ - farthest > positioning::kLowest_m && height_m_ + 2 * farthest < positioning::kHighest_m;
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
  const Vector3d error = sums.head<3>() + atmosphere_in_signal(set, cell.place);
  const Terms shared = terms(set, error, sums, cell.place, true);
  // Elsewhere each draw finds its own way about the edge.
  const bool no_edge = undisturbed.set == &set;
  if (no_edge && !options_.fix.correct_troposphere && settle_draws(set, shared, cell, undisturbed)) {
    horizontal_m.resize(draws);
    vertical_m.resize(draws);
    measure(drawn_m_.data(), draws, cell.place.x() * curvature_east_, cell.place.y() * curvature_north_,
            horizontal_m.data(), vertical_m.data());
    return;
  }
  for (int draw = 0; draw < draws_; ++draw) {
    if (no_edge && corrects_) {
      const Vector3d drawn = noise(set, draw);
      const Terms own{shared.constant + drawn, shared.linear};
      const std::optional<Vector3d> x = settle_within(set, own, cell.place, undisturbed.error + drawn);
      if (x && (cell.place.lpNorm<1>() + x->lpNorm<1>() + kCorrected_m) * sine_change_per_m_ < set.margin) {
        keep(*x);
        continue;
      }
    }
    if (const std::optional<CellFix> fix = locate(cell, draw)) keep(fix->error);
  }
}

}  // namespace canyon::heatmap
