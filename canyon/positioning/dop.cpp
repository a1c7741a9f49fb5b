#include "canyon/positioning/dop.hpp"

#include <cassert>
#include <cmath>

#include "canyon/positioning/least_squares.hpp"

namespace canyon::positioning {

std::string_view name(DopRating rating) {
  constexpr std::string_view kNames[]{"Ideal", "Excellent", "Good", "Moderate", "Fair", "Poor"};
  return kNames[static_cast<std::size_t>(rating)];
}

DopRating rate_dop(double dop) {
  if (dop < 1) return DopRating::Ideal;
  if (dop < 2) return DopRating::Excellent;
  if (dop < 5) return DopRating::Good;
  if (dop < 10) return DopRating::Moderate;
  if (dop < 20) return DopRating::Fair;
  return DopRating::Poor;
}

std::optional<Cofactor> cofactor(const Design& design, double threshold) {
  const Eigen::Index unknowns = design.cols();
  if (design.rows() < unknowns) return std::nullopt;
  const LeastSquares least_squares(design);
  if (least_squares.rank(threshold) < unknowns) return std::nullopt;
  return least_squares.cofactor();
}

Dop dop_from_cofactor(const Cofactor& cofactor_enu) {
  assert(cofactor_enu.rows() == cofactor_enu.cols() && cofactor_enu.rows() >= 4);
  const double horizontal = cofactor_enu(0, 0) + cofactor_enu(1, 1);
  const double vertical = cofactor_enu(2, 2);
  const double all = cofactor_enu.trace();
  Dop dop;
  dop.gdop = std::sqrt(all);
  dop.pdop = std::sqrt(horizontal + vertical);
  dop.hdop = std::sqrt(horizontal);
  dop.vdop = std::sqrt(vertical);
  dop.tdop = std::sqrt(cofactor_enu.diagonal().tail(cofactor_enu.rows() - 3).sum());
  return dop;
}

std::optional<Dop> dop_of_directions(std::span<const Eigen::Vector3d> directions) {
  Design design(static_cast<Eigen::Index>(directions.size()), 4);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    design.row(row).head<3>() = -directions[i].transpose();
    design(row, 3) = 1;
  }
  const std::optional<Cofactor> q = cofactor(design);
  if (!q) return std::nullopt;
  return dop_from_cofactor(*q);
}

}  // namespace canyon::positioning
