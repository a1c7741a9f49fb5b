#include "canyon/relative/integer_least_squares.hpp"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace canyon::relative {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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
  Index j = n - 2, reduced = n - 2;
  while (j >= 0) {
    if (j <= reduced) {
      for (Index i = j + 1; i < n; ++i) reduce(factors->l, z, i, j);
    }
    const double swapped = factors->d(j) + std::pow(factors->l(j + 1, j), 2) * factors->d(j + 1);
    if (swapped * (1 + 1e-9) < factors->d(j + 1)) {
      exchange(*factors, z, j, swapped);
      reduced = j;
      j = n - 2;
    } else {
      --j;
    }
  }
  return Decorrelation{std::move(*factors), z.transpose()};
}

double bootstrapped_success(const Triangular& factors) {
  double success = 1;
  for (Index i = 0; i < factors.d.size(); ++i) success *= std::erf(1 / std::sqrt(8 * factors.d(i)));
  return success;
}

std::optional<IntegerSolution> integer_least_squares(const VectorXd& real, const MatrixXd& covariance,
                                                     int max_nodes) {
  constexpr double kLargest = 1e12;  // beyond, doubles lose what is behind the point
  if (!covariance.allFinite() || !(real.cwiseAbs().maxCoeff() < kLargest)) return std::nullopt;
  const std::optional<Decorrelation> by = decorrelate(covariance);
  if (!by) return std::nullopt;
  // The whole part changes nothing, and keeps what is behind the point.
  const VectorXd offset = real.array().round();
  const VectorXd z = by->z_from_a * (real - offset);
  const MatrixXd& l = by->factors.l;
  const VectorXd& d = by->factors.d;
  const Index n = real.size();

  std::vector<Level> levels(static_cast<std::size_t>(n));
  const auto level = [&](Index k) -> Level& { return levels[static_cast<std::size_t>(k)]; };
  // Row k: what the errors of the levels above k shift the means of those below it by.
  MatrixXd shifts = MatrixXd::Zero(n + 1, n);
  VectorXd whole(n), found[2];
  double distance[2] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  Index k = n - 1;
  level(k).begin(z(k));
  for (int nodes = 0;; ++nodes) {
    if (nodes >= max_nodes) return std::nullopt;
    Level& here = level(k);
    const double error = here.centre - here.whole;
    const double reached = here.distance + error * error / d(k);
    if (reached < distance[1]) {
      whole(k) = here.whole;
      if (k > 0) {
        // Those above k that came before, and k itself.
        shifts.row(k).head(k) = shifts.row(k + 1).head(k) - error * l.row(k).head(k);
        --k;
        level(k).distance = reached;
        level(k).begin(z(k) + shifts(k + 1, k));
        continue;
      }
      const bool nearest = reached < distance[0];
      if (nearest) {
        found[1].swap(found[0]);
        distance[1] = distance[0];
      }
      found[nearest ? 0 : 1] = whole;
      distance[nearest ? 0 : 1] = reached;
      here.next();
      continue;
    }
    if (++k == n) break;
    level(k).next();
  }
  const Eigen::PartialPivLU<MatrixXd> back(by->z_from_a);
  const auto a_of = [&](const VectorXd& of_z) -> VectorXd {
    return offset + back.solve(of_z).array().round().matrix();
  };
  return IntegerSolution{a_of(found[0]), a_of(found[1]), distance[0], distance[1]};
}

}  // namespace canyon::relative
