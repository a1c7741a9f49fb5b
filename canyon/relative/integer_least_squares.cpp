#include "canyon/relative/integer_least_squares.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace canyon::relative {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// With this success rate, and within so many steps for each variable, the search goes without decorrelation.
constexpr double kSure = 0.999;
constexpr Index kShortSearch = 20;

/// Takes whole multiples of column i off column j, so that |L(i, j)| <= 1/2.
void reduce(MatrixXd& l, MatrixXd& z, Index i, Index j) {
  const double multiple = std::round(l(i, j));
  if (multiple == 0) return;
  l.col(j).tail(l.rows() - i) -= multiple * l.col(i).tail(l.rows() - i);
  z.col(j) -= multiple * z.col(i);
}

/// Exchanges variables j and j + 1. @param swapped_d D of j + 1 behind it
void exchange(Triangular& f, MatrixXd& z, Index j, double swapped_d) {
  MatrixXd& l = f.l;
  const double eta = f.d(j) / swapped_d;
  const double lambda = f.d(j + 1) * l(j + 1, j) / swapped_d;
  f.d(j) = eta * f.d(j + 1);
  f.d(j + 1) = swapped_d;
  for (Index k = 0; k < j; ++k) {
    const double upper = l(j, k), lower = l(j + 1, k);
    l(j, k) = lower - l(j + 1, j) * upper;
    l(j + 1, k) = eta * upper + lambda * lower;
  }
  l(j + 1, j) = lambda;
  const Index below = l.rows() - j - 2;
  l.col(j).tail(below).swap(l.col(j + 1).tail(below));
  z.col(j).swap(z.col(j + 1));
}

/// Whole numbers on one level of the search: nearest first, then alternately on both sides.
struct Level {
  double centre = 0;    // conditional mean
  double whole = 0;     // in hand
  double step = 0;      // to the next one
  double distance = 0;  // of the levels behind
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

/// Depth first, from the last and best known variable down.
class Search {
 public:
  Search(VectorXd z, const Triangular& factors)
      : z_(std::move(z)),
        l_(factors.l),
        d_(factors.d),
        n_(z_.size()),
        shifts_(MatrixXd::Zero(n_ + 1, n_)),
        whole_(n_) {
    levels_.resize(static_cast<std::size_t>(n_));
  }

  /// Rounding one after the other, and the same with one of the numbers next to it: among these the two
  /// nearest are seldom beaten.
  void begin() {
    for (Index other = -1; other < n_; ++other) {
      Index k = other < 0 ? n_ - 1 : other;
      if (other < 0) {
        level(k).begin(z_(k));
      } else {
        // Levels above have the numbers of rounding.
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

  /// All within the second best distance, and within `ratio_limit` times the best; false after `max_nodes`.
  bool run(int max_nodes, double ratio_limit) {
    distance[1] = std::min(distance[1], ratio_limit * distance[0]);
    Index k = n_ - 1;
    level(k).distance = 0;
    level(k).begin(z_(k));
    for (int nodes = 0; nodes < max_nodes; ++nodes) {
      if (reached(k) < distance[1]) {
        whole_(k) = level(k).whole;
        if (k > 0) {
          descend(k);
          --k;
          continue;
        }
        keep(reached(0));
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
  /// Begins the level below k.
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

  VectorXd z_;
  const MatrixXd& l_;
  const VectorXd& d_;
  Index n_;
  // Row k: what the errors of the levels from k on shift the means of those below by.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> shifts_;
  std::vector<Level> levels_;
  VectorXd whole_;
};

}  // namespace

double IntegerSolution::ratio() const {
  return best_distance > 0 ? second_distance / best_distance : std::numeric_limits<double>::infinity();
}

std::optional<Triangular> triangular(const MatrixXd& covariance) {
  const Index n = covariance.rows();
  MatrixXd rest = covariance;
  Triangular f{MatrixXd::Zero(n, n), VectorXd(n)};
  for (Index i = n - 1; i >= 0; --i) {
    const double d = rest(i, i);
    // What rounding leaves of a variance that others explain is no variance.
    if (!(d > 1e-14 * covariance(i, i)) || !std::isfinite(d)) return std::nullopt;
    f.d(i) = d;
    f.l.row(i).head(i) = rest.row(i).head(i) / d;
    f.l(i, i) = 1;
    for (Index j = 0; j < i; ++j) {
      rest.row(j).head(j + 1) -= f.l(i, j) * d * f.l.row(i).head(j + 1);
    }
  }
  return f;
}

std::optional<Decorrelation> decorrelate(const MatrixXd& covariance) {
  std::optional<Triangular> factors = triangular(covariance);
  if (!factors) return std::nullopt;
  const Index n = covariance.rows();
  MatrixXd z = MatrixXd::Identity(n, n);
  for (Index j = n - 2; j >= 0;) {
    const double apart = factors->l(j + 1, j) - std::round(factors->l(j + 1, j));
    double swapped = factors->d(j) + apart * apart * factors->d(j + 1);
    if (swapped * (1 + 1e-9) >= factors->d(j + 1)) {
      --j;
      continue;
    }
    for (Index i = j + 1; i < n; ++i) reduce(factors->l, z, i, j);
    swapped = factors->d(j) + std::pow(factors->l(j + 1, j), 2) * factors->d(j + 1);
    exchange(*factors, z, j, swapped);
    j = std::min(j + 1, n - 2);
  }
  return Decorrelation{std::move(*factors), z.transpose()};
}

double bootstrapped_success(const Triangular& factors) {
  double success = 1;
  for (Index i = 0; i < factors.d.size(); ++i) success *= std::erf(1 / std::sqrt(8 * factors.d(i)));
  return success;
}

std::optional<IntegerSolution> integer_least_squares(const VectorXd& real, const MatrixXd& covariance,
                                                     double ratio_limit, int max_nodes) {
  constexpr double kLargest = 1e12;  // beyond, doubles lose what is behind the point
  if (!covariance.allFinite() || !real.allFinite() || real.cwiseAbs().maxCoeff() >= kLargest) return {};
  // The whole part changes nothing, and keeps what is behind the point.
  const VectorXd offset = real.array().round();
  const Index n = real.size();

  // Where all are known well, the search is short without decorrelation: the best known last.
  Eigen::PermutationMatrix<Eigen::Dynamic> order(n);
  order.setIdentity();
  std::sort(order.indices().data(), order.indices().data() + n,
            [&](int a, int b) { return covariance(a, a) > covariance(b, b); });
  const std::optional<Triangular> plain = triangular(order.transpose() * covariance * order);
  if (!plain) return std::nullopt;
  if (const double success = bootstrapped_success(*plain); success > kSure) {
    Search search(order.transpose() * (real - offset), *plain);
    search.begin();
    if (search.run(static_cast<int>(kShortSearch * n), ratio_limit)) {
      return IntegerSolution{offset + order * search.found[0], offset + order * search.found[1],
                             search.distance[0], search.distance[1], success};
    }
  }
  const std::optional<Decorrelation> by = decorrelate(covariance);
  if (!by) return std::nullopt;
  Search search(by->z_from_a * (real - offset), by->factors);
  search.begin();
  if (!search.run(max_nodes, ratio_limit)) return std::nullopt;
  const Eigen::PartialPivLU<MatrixXd> back(by->z_from_a);
  const auto a_of = [&](const VectorXd& of_z) -> VectorXd {
    return offset + back.solve(of_z).array().round().matrix();
  };
  return IntegerSolution{a_of(search.found[0]), a_of(search.found[1]), search.distance[0], search.distance[1],
                         bootstrapped_success(by->factors)};
}

}  // namespace canyon::relative
