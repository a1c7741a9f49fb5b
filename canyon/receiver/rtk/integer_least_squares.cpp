#include "canyon/receiver/rtk/integer_least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "canyon/base/arithmetic.hpp"

namespace canyon::rtk {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A search skips decorrelation at this success rate, and with at most this many steps per variable.
constexpr double kSure = 0.999;
constexpr Index kShortSearch = 20;
/// Beyond this, doubles lose the fractional part.
constexpr double kMax = 1e12;
/// Larger multiples would grow without bound.
constexpr double kLargeMultiple = 100;

/// A change of variables in progress.
struct Basis {
  Triangular factors;
  VectorXd z;
  MatrixXd a_from_z;

  /// Subtracts integer multiples of column i from column j, so that |L(i, j)| <= 1/2.
  void reduce(Index i, Index j) {
    MatrixXd& l = factors.l;
    const double multiple = std::round(l(i, j));
    if (multiple == 0) return;
    l.col(j).tail(l.rows() - i) -= multiple * l.col(i).tail(l.rows() - i);
    z(j) -= multiple * z(i);
    a_from_z.col(i) += multiple * a_from_z.col(j);
  }

  /// Exchanges variables j and j + 1. @param swapped_d D of j + 1 after it
  void exchange(Index j, double swapped_d) {
    auto& [l, d] = factors;
    const double eta = d(j) / swapped_d;
    const double lambda = d(j + 1) * l(j + 1, j) / swapped_d;
    d(j) = eta * d(j + 1);
    d(j + 1) = swapped_d;
    for (Index k = 0; k < j; ++k) {
      const double upper = l(j, k), lower = l(j + 1, k);
      l(j, k) = lower - l(j + 1, j) * upper;
      l(j + 1, k) = eta * upper + lambda * lower;
    }
    l(j + 1, j) = lambda;
    const Index below = l.rows() - j - 2;
    l.col(j).tail(below).swap(l.col(j + 1).tail(below));
    std::swap(z(j), z(j + 1));
    a_from_z.col(j).swap(a_from_z.col(j + 1));
  }

  /// Decorrelates the variables from `first` on, of which those after `done` are already decorrelated.
  void decorrelate(Index first, Index done) {
    auto& [l, d] = factors;
    for (Index j = done - 1; j >= first;) {
      const double apart = l(j + 1, j) - std::round(l(j + 1, j));
      const double swapped = d(j) + apart * apart * d(j + 1);
      if (swapped * (1 + 1e-9) >= d(j + 1)) {
        --j;
        continue;
      }
      // Only the element of L next to the diagonal determines an exchange: others are reduced once large.
      reduce(j + 1, j);
      const Index below = l.rows() - j - 2;
      if (below > 0 && l.col(j).tail(below).cwiseAbs().maxCoeff() > kLargeMultiple)
        for (Index i = j + 2; i < l.rows(); ++i) reduce(i, j);
      exchange(j, swapped);
      j = std::min(j + 1, l.rows() - 2);
    }
  }
};

/// Integers on one level of the search: nearest first, then alternately on both sides.
struct Level {
  double centre = 0;    // conditional mean
  double whole = 0;     // current integer
  double step = 0;      // to the next one
  double distance = 0;  // of the finished levels
  void begin(double mean) {
    centre = mean;
    whole = std::round(mean);
    step = mean < whole ? -1 : 1;
  }
  void next() {
    whole += step;
    step = -step - (step > 0 ? 1 : -1);
  }
};

/// Depth first, from the last variable, with the smallest variance, downwards.
class Search {
 public:
  Search(const VectorXd& z, const Triangular& factors)
      : z_(z), l_(factors.l), d_(factors.d), n_(z_.size()), shifts_(ByRows::Zero(n_ + 1, n_)), whole_(n_) {
    levels_.resize(static_cast<std::size_t>(n_));
  }

  /// Sequential rounding, and variants with one integer moved to its neighbour: two are mostly the nearest.
  void begin() {
    for (Index other = -1; other < n_; ++other) {
      Index k = other < 0 ? n_ - 1 : other;
      if (other < 0) {
        level(k).begin(z_(k));
      } else {
        // Levels above have the integers of rounding.
        level(k).begin(z_(k) + shifts_(k + 1, k));
        level(k).next();
      }
      for (;; --k) {
        if (reached(k) >= distance[1]) break;
        whole_(k) = level(k).whole;
        if (k == 0) {
          keep(reached(0));
          break;
        }
        descend(k);
      }
      if (other < 0) continue;
      // Back to rounding at this level, for those above it.
      level(other).begin(z_(other) + shifts_(other + 1, other));
      whole_(other) = level(other).whole;
      descend(other);
    }
  }

  /// Visits all within the second best distance and highest ratio times the best; false after `max_nodes`.
  bool run(int max_nodes, RatioLimits ratios) {
    distance[1] = std::min(distance[1], ratios.highest * distance[0]);
    // If the two nearest so far are too close to each other, only a much nearer one helps.
    const auto is_close = [&] { return distance[1] < ratios.lowest * distance[0]; };
    const auto radius = [&] { return is_close() ? distance[1] / ratios.lowest : distance[1]; };
    const auto from_top = [&] {
      level(n_ - 1).distance = 0;
      level(n_ - 1).begin(z_(n_ - 1));
      return n_ - 1;
    };
    double within = radius();
    Index k = from_top();
    for (int nodes = 0; nodes < max_nodes; ++nodes) {
      if (reached(k) < within) {
        whole_(k) = level(k).whole;
        if (k > 0) {
          descend(k);
          --k;
          continue;
        }
        const bool was_close = is_close();
        keep(reached(0));
        within = radius();
        if (was_close)
          k = from_top();  // candidates too far for that radius may be the second best
        else
          level(0).next();
      } else {
        if (++k == n_) return true;
        level(k).next();
      }
    }
    return false;
  }

  VectorXd found[2];
  double distance[2] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};

 private:
  Level& level(Index k) { return levels_[static_cast<std::size_t>(k)]; }
  double reached(Index k) {
    const double error = level(k).centre - level(k).whole;
    return level(k).distance + error * error / d_(k);
  }
  /// Starts the level below k.
  void descend(Index k) {
    if (k == 0) return;
    const double error = level(k).centre - level(k).whole;
    shifts_.row(k).head(k) = shifts_.row(k + 1).head(k) - error * l_.row(k).head(k);
    level(k - 1).distance = reached(k);
    level(k - 1).begin(z_(k - 1) + shifts_(k, k - 1));
  }
  void keep(double at) {
    if (found[0].size() != 0 && (whole_ == found[0] || (found[1].size() != 0 && whole_ == found[1]))) return;
    const bool nearest = at < distance[0];
    if (nearest) {
      found[1].swap(found[0]);
      distance[1] = distance[0];
    }
    found[nearest ? 0 : 1] = whole_;
    distance[nearest ? 0 : 1] = at;
  }

  using ByRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  const VectorXd& z_;
  const ByRows l_;
  const VectorXd& d_;
  Index n_;
  ByRows shifts_;  // row k: shifts of the means of the levels below by the errors of the levels from k on
  std::vector<Level> levels_;
  VectorXd whole_;
};

bool are_usable(const VectorXd& real, const MatrixXd& covariance) {
  return covariance.allFinite() && real.allFinite() && real.cwiseAbs().maxCoeff() < kMax;
}

}  // namespace

double IntegerSolution::ratio() const {
  return best_distance > 0 ? second_distance / best_distance : std::numeric_limits<double>::infinity();
}

std::vector<std::optional<Decorrelation>> decorrelate(const VectorXd& real, const MatrixXd& covariance,
                                                      std::span<const Index> sizes) {
  std::vector<std::optional<Decorrelation>> result(sizes.size());
  if (!are_usable(real, covariance)) return result;
  // The integer part has no effect; removing it keeps the digits of the fraction.
  const VectorXd origin = real.array().round();
  Triangular factors = triangular(covariance);
  const Index n = factors.d.size();
  Basis basis{std::move(factors), (real - origin).tail(n), MatrixXd::Identity(n, n)};
  Index done = n - 1;
  for (std::size_t k = 0; k < sizes.size() && sizes[k] <= n; ++k) {
    const Index size = sizes[k];
    basis.decorrelate(n - size, done);
    done = n - size;
    result[k] = {{basis.factors.l.bottomRightCorner(size, size), basis.factors.d.tail(size)},
                 origin.tail(size),
                 basis.z.tail(size),
                 basis.a_from_z.bottomRightCorner(size, size)};
  }
  return result;
}

double bootstrapped_success(const Triangular& factors) {
  double success = 1;
  for (Index i = 0; i < factors.d.size(); ++i) success *= std::erf(1 / std::sqrt(8 * factors.d(i)));
  return success;
}

std::optional<IntegerSolution> integer_least_squares(const Decorrelation& by, RatioLimits ratios,
                                                     int max_nodes) {
  Search search(by.z, by.factors);
  search.begin();
  if (!search.run(max_nodes, ratios)) return std::nullopt;
  return IntegerSolution{by.origin + by.a_from_z * search.found[0], by.origin + by.a_from_z * search.found[1],
                         search.distance[0], search.distance[1], bootstrapped_success(by.factors)};
}

std::optional<IntegerSolution> short_search(const VectorXd& real, const MatrixXd& covariance,
                                            RatioLimits ratios) {
  if (!are_usable(real, covariance)) return std::nullopt;
  const VectorXd origin = real.array().round();
  const Index n = real.size();
  // The success rate is at most that of the integer with the smallest variance.
  if (std::erf(1 / std::sqrt(8 * covariance.diagonal().minCoeff())) <= kSure) return std::nullopt;
  // Smallest variance last.
  std::vector<Index> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), Index{0});
  std::sort(order.begin(), order.end(),
            [&](Index a, Index b) { return covariance(a, a) > covariance(b, b); });
  const auto index = [&](Index i) { return order[static_cast<std::size_t>(i)]; };
  MatrixXd ordered(n, n);
  VectorXd z(n);
  for (Index i = 0; i < n; ++i) {
    z(i) = real(index(i)) - origin(index(i));
    for (Index j = 0; j < n; ++j) ordered(i, j) = covariance(index(i), index(j));
  }
  const Triangular factors = triangular(ordered);
  if (factors.d.size() < n) return std::nullopt;
  const double success = bootstrapped_success(factors);
  if (success <= kSure) return std::nullopt;
  Search search(z, factors);
  search.begin();
  if (!search.run(static_cast<int>(kShortSearch * n), ratios)) return std::nullopt;
  VectorXd found[] = {origin, origin};
  for (Index i = 0; i < n; ++i)
    for (int k = 0; k < 2; ++k) found[k](index(i)) += search.found[k](i);
  return IntegerSolution{found[0], found[1], search.distance[0], search.distance[1], success};
}

std::optional<IntegerSolution> integer_least_squares(const VectorXd& real, const MatrixXd& covariance,
                                                     RatioLimits ratios, int max_nodes) {
  if (auto found = short_search(real, covariance, ratios)) return found;
  const Index all[] = {real.size()};
  const auto by = std::move(decorrelate(real, covariance, all).front());
  return by ? integer_least_squares(*by, ratios, max_nodes) : std::nullopt;
}

CANYON_CLONES void add_multiple(double factor, const double* __restrict from, std::ptrdiff_t n,
                                double* __restrict to) {
  for (std::ptrdiff_t i = 0; i < n; ++i) to[i] += factor * from[i];
}

Triangular triangular(const MatrixXd& covariance) {
  const Index n = covariance.rows();
  MatrixXd rest = covariance;
  Triangular f{MatrixXd::Identity(n, n), Eigen::VectorXd(n)};
  for (Index i = n - 1; i >= 0; --i) {
    const double d = rest(i, i);
    // Rounding leaves this fraction of a variance that other variables explain.
    if (!(d > 1e-14 * covariance(i, i)) || !std::isfinite(d))
      return {f.l.bottomRightCorner(n - 1 - i, n - 1 - i), f.d.tail(n - 1 - i)};
    f.d(i) = d;
    for (Index j = 0; j < i; ++j) f.l(i, j) = rest(j, i) / d;
    for (Index j = 0; j < i; ++j) add_multiple(-f.l(i, j), &rest(0, i), j + 1, &rest(0, j));
  }
  return f;
}

MatrixXd times_inverse(MatrixXd b, const Triangular& q) {
  q.l.triangularView<Eigen::UnitLower>().solveInPlace<Eigen::OnTheRight>(b);
  b *= q.d.cwiseInverse().asDiagonal();
  q.l.transpose().triangularView<Eigen::UnitUpper>().solveInPlace<Eigen::OnTheRight>(b);
  return b;
}

}  // namespace canyon::rtk
