#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "canyon/receiver/relative/baseline_state.hpp"
#include "canyon/receiver/relative/integer_least_squares.hpp"
#include "canyon/receiver/relative/rtk_filter.hpp"

namespace canyon::relative {

/// Result of a search for whole numbers of cycles.
struct WholeNumbers {
  Eigen::Vector3d position_error = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double ratio = 0;
  bool accepted = false;
  double squares = 0;  ///< of residuals over their deviations, a sum
  int redundant = 0;   ///< how many of them
};

/// Looks for the whole numbers of one epoch: candidates, search, acceptance.
class WholeNumberSearch {
 public:
  /// @param state takes numbers that are held, and remembers those found; like `options` and `differences` it
  /// must outlive this
  /// @param echoes covariance of the position by echoes of codes, which the state's lacks
  /// @param ionosphere whether its delays are states
  /// @param fixed_in_a_row epochs up to the last one whose numbers were found one after the other
  WholeNumberSearch(const RtkOptions& options, BaselineState& state, std::span<const Difference> differences,
                    const Eigen::Matrix3d& echoes, bool ionosphere, int fixed_in_a_row)
      : options_(options),
        state_(state),
        differences_(differences),
        echoes_(echoes),
        ionosphere_(ionosphere),
        fixed_in_a_row_(fixed_in_a_row) {}
  /// Empty where there are too few. Numbers that wait for the next epoch's are kept for it.
  [[nodiscard]] std::optional<WholeNumbers> find();

 private:
  /// Sum of squares of phases' residuals at a state, each signal's clock estimated, over their variances.
  [[nodiscard]] double squares_of_residuals(std::span<const std::size_t> among,
                                            const Eigen::VectorXd& x) const;
  /// Candidates by certainty of their phase, best first.
  [[nodiscard]] std::vector<std::size_t> candidates() const;
  /// Places of two ambiguities of a signal among the state's slots; the second is the signal's reference.
  using SlotPair = std::pair<std::size_t, std::size_t>;
  /// Differences of two ambiguities of a signal, those of the less certain satellites first.
  struct Pairs {
    std::vector<std::size_t> among;   // differences; the last one of each signal is its reference
    std::vector<std::size_t> before;  // of each difference, how many pairs are of those before it
    std::vector<SlotPair> slots;      // an ambiguity's and its reference's
    Eigen::VectorXd real;
    /// With what an error of the position by echoes of codes does to all ambiguities at once: the filter
    /// lacks it, so that it is sure of wrong numbers.
    Eigen::MatrixXd covariance;
    Eigen::Matrix3Xd gradients;  // of the ambiguities by that error [cycles/m]
  };
  /// The last part of Pairs.
  struct Set {
    std::size_t begin = 0;  // its first difference
    std::size_t pairs = 0;
  };
  /// Whole numbers of an epoch that pass, and that the epoch before did not find.
  struct Unconfirmed {
    std::vector<SlotPair> slots;
    Eigen::VectorXd whole;
  };
  Pairs pairs_of(std::vector<std::size_t> among);
  /// Error of a difference's ambiguity by that of the position [cycles/m].
  [[nodiscard]] Eigen::Vector3d cycles_of(std::size_t difference) const;
  /// Whether whole numbers are those of the last fixed position, as far as that had them, and that is most.
  [[nodiscard]] bool are_kept(std::span<const SlotPair> slots, const Eigen::VectorXd& whole) const;
  void keep(std::span<const SlotPair> slots, const Eigen::VectorXd& whole);
  /// Among all; where that fails without GLONASS, as biases that are stated wrongly spoil it.
  std::optional<WholeNumbers> find_with_glonass_or_without();
  /// Among these, best first; where that fails among the more certain ones. Empty where they are too few.
  std::optional<WholeNumbers> find_among(std::vector<std::size_t> among);
  /// Tests the whole numbers that were found of a set.
  WholeNumbers answer(const Pairs& pairs, const Set& set, const std::optional<IntegerSolution>& found);
  /// The answer at whole numbers that are accepted.
  void fix_at(const Pairs& pairs, const Set& set, const Eigen::VectorXd& whole, WholeNumbers& fixed);

  const RtkOptions& options_;
  BaselineState& state_;
  std::span<const Difference> differences_;
  Eigen::Matrix3d echoes_;
  bool ionosphere_;
  int fixed_in_a_row_;
  std::optional<Unconfirmed> unconfirmed_;
};

}  // namespace canyon::relative
