#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace canyon::positioning {

/// Dilutions of precision: square roots of traces of the cofactor matrix (unit variance) in local ENU.
/// GDOP^2 = PDOP^2 + TDOP^2 where TDOP takes all clocks of the solution. (The paper prints squares of D's
/// diagonal; the root of the diagonal is meant, see Langley 1999.)
struct Dop {
  double gdop = 0, pdop = 0, hdop = 0, vdop = 0, tdop = 0;
};

/// The paper's table of DOP ratings.
enum class DopRating : std::uint8_t { Ideal, Excellent, Good, Moderate, Fair, Poor };
[[nodiscard]] std::string_view name(DopRating rating);
/// < 1 Ideal, 1 to 2 Excellent, 2 to 5 Good, 5 to 10 Moderate, 10 to 20 Fair, above Poor; a bound belongs to
/// the worse class. Rates PDOP everywhere in Canyon. NaN is Poor.
[[nodiscard]] DopRating rate_dop(double dop);

/// Cofactor matrix (A^T A)^-1 of a design matrix with at most 8 columns, one row for each satellite; by QR
/// with column pivoting. Empty where the rank, at pivots above `threshold` of the largest, is below the
/// columns.
using Cofactor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 8, 8>;
using Design = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, Eigen::Dynamic, 8>;
[[nodiscard]] std::optional<Cofactor> cofactor(const Design& design, double threshold = 1e-6);

/// @param cofactor_enu (3 + clocks) square: east, north, up, then every clock (in units of length)
[[nodiscard]] Dop dop_from_cofactor(const Cofactor& cofactor_enu);

/// DOP of satellites of one system in directions (unit, ENU, antenna to satellite): what a place offers,
/// before any measurement. Empty where they do not determine position and clock.
[[nodiscard]] std::optional<Dop> dop_of_directions(std::span<const Eigen::Vector3d> directions);

}  // namespace canyon::positioning
