#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "canyon/receiver/rtk/baseline_state.hpp"
#include "canyon/receiver/rtk/integer_least_squares.hpp"
#include "canyon/receiver/rtk/rtk_filter.hpp"

namespace canyon::rtk {

struct AmbiguitySolution {
  Eigen::Vector3d position_error = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double ratio = 0;
  bool accepted = false;
  double squares = 0;  ///< of residuals over their deviations, sum
  int redundant = 0;   ///< number of terms in it
};

/// Resolves the integer ambiguities of one epoch: selects candidates, searches, validates.
class AmbiguitySearch {
 public:
  /// @param state stores held and found integers; like `options` and `differences` it must outlive this
  /// @param echoes covariance of the position by echoes of codes, which the state's lacks
  /// @param ionosphere whether its delays are states
  /// @param consecutive_fixed_epochs number of successive fixed epochs up to the last one
  AmbiguitySearch(const RtkOptions& options, BaselineState& state, std::span<const Difference> differences,
                  const Eigen::Matrix3d& echoes, bool ionosphere, int consecutive_fixed_epochs)
      : options_(options),
        state_(state),
        differences_(differences),
        echoes_(echoes),
        ionosphere_(ionosphere),
        fixed_in_a_row_(consecutive_fixed_epochs) {}
  /// Empty if there are too few. Integers that need confirmation are stored for the next epoch.
  [[nodiscard]] std::optional<AmbiguitySolution> find();

 private:
  /// Sum of squared residuals of phases at a state, each signal's clock estimated, over their variances.
  [[nodiscard]] double squares_of_residuals(std::span<const std::size_t> among,
                                            const Eigen::VectorXd& x) const;
  /// Candidates by certainty of their phase, best first.
  [[nodiscard]] std::vector<std::size_t> candidates() const;
  /// Indices of two ambiguities of a signal in the state's slots; the second is the signal's reference.
  using SlotPair = std::pair<std::size_t, std::size_t>;
  /// Differences of two ambiguities of a signal, those of the less certain satellites first.
  struct Pairs {
    std::vector<std::size_t> among;   // differences; the last one of each signal is its reference
    std::vector<std::size_t> before;  // number of pairs of the earlier differences, for each
    std::vector<SlotPair> slots;      // of an ambiguity and its reference
    Eigen::VectorXd real;
    /// Includes the effect of a position error by echoes of codes on all ambiguities: without it the filter
    /// would be certain of wrong integers.
    Eigen::MatrixXd covariance;
    Eigen::Matrix3Xd gradients;  // of the ambiguities by that error [cycles/m]
  };
  /// The last part of Pairs.
  struct Set {
    std::size_t begin = 0;  // its first difference
    std::size_t pairs = 0;
  };
  /// Accepted integers of an epoch that the previous epoch did not find.
  struct Unconfirmed {
    std::vector<SlotPair> slots;
    Eigen::VectorXd whole;
  };
  Pairs pairs_of(std::vector<std::size_t> among);
  /// Error of a difference's ambiguity by that of the position [cycles/m].
  [[nodiscard]] Eigen::Vector3d cycles_of(std::size_t difference) const;
  /// Whether integers equal those of the last fixed position, of all common ambiguities, which must be most.
  [[nodiscard]] bool are_kept(std::span<const SlotPair> slots, const Eigen::VectorXd& whole) const;
  void keep(std::span<const SlotPair> slots, const Eigen::VectorXd& whole);
  /// Of all; if that fails without GLONASS, because wrong biases may spoil it.
  std::optional<AmbiguitySolution> find_with_glonass_or_without();
  /// Of these, best first; if that fails of the more certain ones. Empty if they are too few.
  std::optional<AmbiguitySolution> find_among(std::vector<std::size_t> among);
  /// Validates the integers that were found for a set.
  AmbiguitySolution solution_of(const Pairs& pairs, const Set& set,
                                const std::optional<IntegerSolution>& found);
  /// Sets the result at accepted integers.
  void fix_at(const Pairs& pairs, const Set& set, const Eigen::VectorXd& whole, AmbiguitySolution& fixed);

  const RtkOptions& options_;
  BaselineState& state_;
  std::span<const Difference> differences_;
  Eigen::Matrix3d echoes_;
  bool ionosphere_;
  int fixed_in_a_row_;
  std::optional<Unconfirmed> unconfirmed_;
};

}  // namespace canyon::rtk
