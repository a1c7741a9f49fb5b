#pragma once

#include <Eigen/Core>
#include <optional>

#include "canyon/positioning/dop.hpp"

namespace canyon::positioning {

/// Row whose residual is largest beside its own standard deviation: |w_i| = |r_i| / (sigma_i sqrt(q_ii)),
/// with Q = I - A (A^T A)^-1 A^T (Baarda's w-test; Kuusniemi 2005). Rows that nothing checks (q_ii below
/// 1e-6: a lone satellite of its clock) are passed over; empty where all are such. Ties go to the first.
/// @param design whitened: each row divided by its sigma; full column rank
/// @param residual whitened residuals of the least-squares solution, one per row
[[nodiscard]] std::optional<Eigen::Index> largest_normalised_residual(const Design& design,
                                                                      const Eigen::VectorXd& residual);

}  // namespace canyon::positioning
