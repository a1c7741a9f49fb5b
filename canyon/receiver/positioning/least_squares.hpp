#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::positioning {

/// Dilutions of precision: square roots of traces of the cofactor matrix (unit variance) in local ENU. GDOP^2
/// = PDOP^2 + TDOP^2 with all clocks of the solution in TDOP. (The paper prints squares of D's diagonal; the
/// root of the diagonal is meant, see Langley 1999.)
struct Dop {
  double gdop = 0, pdop = 0, hdop = 0, vdop = 0, tdop = 0;
};

/// The paper's table of DOP ratings.
enum class DopRating : std::uint8_t { Ideal, Excellent, Good, Moderate, Fair, Poor };
[[nodiscard]] std::string_view name(DopRating rating);
/// < 1 Ideal, 1 to 2 Excellent, 2 to 5 Good, 5 to 10 Moderate, 10 to 20 Fair, above Poor; a bound belongs to
/// the worse class. Canyon rates PDOP. NaN is Poor.
[[nodiscard]] DopRating rate_dop(double dop);

/// Pivots below this fraction of the largest count as 0: a PDOP of about 1e6.
inline constexpr double kRankThreshold = 1e-6;
inline constexpr int kMaxRows = 100 * static_cast<int>(gnss::kSystemCount);  ///< each satellite once
/// Throws InputError if there are more rows than the matrices below have.
void check_rows(std::size_t rows);
/// A design matrix, one row for each satellite, and its right side, without allocation.
using Design = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, 8>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxRows, 1>;
/// Cofactor matrix (A^T A)^-1, by QR with column pivoting. Empty if the rank, at pivots above `threshold` of
/// the largest, is below the number of columns.
using Cofactor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 8, 8>;
[[nodiscard]] std::optional<Cofactor> cofactor(const Design& design, double threshold = kRankThreshold);

/// @param cofactor_enu (3 + clocks) square: east, north, up, then every clock (in units of length)
[[nodiscard]] Dop dop_from_cofactor(const Cofactor& cofactor_enu);

/// DOP of satellites of one system in directions (unit, ENU, antenna to satellite), without measurements.
/// Empty if they do not determine position and clock.
[[nodiscard]] std::optional<Dop> dop_of_directions(std::span<const Eigen::Vector3d> directions);

/// Horizontal protection level [m] that a receiver may report with a fix: K d_major, d_major the semi-major
/// axis of the ellipse of its reported standard deviations,
///   d_major^2 = (d_E^2 + d_N^2) / 2 + sqrt(((d_E^2 - d_N^2) / 2)^2 + d_EN^2)
/// (RTCA DO-229D, appendix J.1: HPL_SBAS). It bounds errors that are normal with the reported covariance,
/// which reflections are not.
/// @param covariance_enu [m^2], east, north, up: Fix::covariance_enu @param factor K: 6.0 for precision
/// approaches (K_H,PA), 6.18 for en route to non-precision approaches (K_H,NPA)
[[nodiscard]] inline double horizontal_protection_level_m(const Eigen::Matrix3d& covariance_enu,
                                                          double factor) {
  const double middle = 0.5 * (covariance_enu(0, 0) + covariance_enu(1, 1));
  const double half = 0.5 * (covariance_enu(0, 0) - covariance_enu(1, 1));
  return factor * std::sqrt(middle + std::hypot(half, covariance_enu(0, 1)));
}

/// Row with the largest residual relative to its standard deviation: |w_i| = |r_i| / (sigma_i sqrt(q_ii)),
/// with Q = I - A (A^T A)^-1 A^T (Baarda's w-test; Kuusniemi 2005). Skips rows without redundancy (q_ii below
/// 1e-6: a lone satellite of its clock); empty if all rows are such. Of equal ones the first.
/// @param design whitened: each row divided by its sigma; full column rank
/// @param residual whitened residuals of the least-squares solution, one per row
[[nodiscard]] std::optional<Eigen::Index> largest_normalised_residual(const Design& design,
                                                                      const Rows& residual);

/// Variance of errors over that of their weights, 1 or more [1], from `squares`, the sum of the squared
/// whitened residuals of least squares: s^2 n / (n - 2), with s^2 = squares / n, n the degrees of freedom.
/// The ratio of an error to its deviation by the residuals has Student's distribution, of that variance; up
/// to two degrees, where the variance is undefined, 5 s^2. Without redundancy (n < 1) it is 1.
[[nodiscard]] inline double excess_variance(double squares, std::ptrdiff_t redundancy) {
  if (redundancy < 1) return 1;
  const auto n = static_cast<double>(redundancy);
  return std::max(1.0, squares / n * (n > 2 ? n / (n - 2) : 5));
}

/// Least squares min |A x - b| by Householder's QR with column pivoting, without allocation.
/// @tparam MaxRows largest number of rows; Eigen::Dynamic: any number, and the matrix is allocated
template <int MaxRows>
class BasicLeastSquares {
 public:
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, MaxRows, 8>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, MaxRows, 1>;
  using Unknowns = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 8, 1>;

  BasicLeastSquares() = default;
  /// @param a rows x unknowns; at most 8 unknowns
  explicit BasicLeastSquares(const Matrix& a) { compute(a); }
  void compute(const Matrix& a);
  [[nodiscard]] Eigen::Index unknowns() const { return qr_.cols(); }
  /// Number of pivots above `threshold` of the largest.
  [[nodiscard]] Eigen::Index rank(double threshold) const;
  /// x for the right side b, as long as A has rows; a basic solution if A is rank-deficient.
  [[nodiscard]] Unknowns solve(const Vector& b) const;
  /// (A^T A)^-1 = P R^-1 R^-T P^T. A has full rank and at least as many rows as columns.
  [[nodiscard]] Cofactor cofactor() const;
  /// Covariance of x for independent elements of b.
  /// @param sigma standard deviation of each element of b
  [[nodiscard]] Cofactor covariance(const Vector& sigma) const;
  /// The diagonal of the projection onto A's columns.
  [[nodiscard]] Vector leverages() const;

 private:
  // Of Eigen::ColPivHouseholderQR, whose class takes seconds to compile in each file that includes it.
  Matrix qr_;                     // R, and the essential parts of the reflections
  Unknowns reflections_;          // their coefficients
  std::array<int, 8> columns_{};  // column of A for each column of R
  Eigen::Index nonzero_pivots_ = 0;
  double max_pivot_ = 0;
};
extern template class BasicLeastSquares<kMaxRows>;
extern template class BasicLeastSquares<Eigen::Dynamic>;
using LeastSquares = BasicLeastSquares<kMaxRows>;
using LeastSquaresOfAnySize = BasicLeastSquares<Eigen::Dynamic>;

}  // namespace canyon::positioning
