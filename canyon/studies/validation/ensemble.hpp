#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "canyon/studies/validation/headlines.hpp"

// Recorded figures beside the distribution of simulated ones, over draws of what is unknown.

namespace canyon::validation {

/// A recording and its simulations.
struct EnsembleRow {
  std::string name;
  std::string part;                   ///< describe_part()
  std::vector<std::string> unknowns;  ///< what is drawn: "level: -10 to 6 dB, uniform"
  std::vector<Headline> point;        ///< by the settings as they are
  struct Draw {
    std::map<std::string, double> values;  ///< of the unknowns
    std::vector<Headline> headlines;       ///< the same as `point`
  };
  std::vector<Draw> draws;
};

/// A figure that recordings and simulations both have.
struct EnsembleFigure {
  FigureInfo info;
  double recorded = 0;
  std::optional<double> point;  ///< simulated by the settings as they are
  double median = 0;
  Interval half, most;  ///< 50 and 90 %
  /// Weighted interval scores of the draws' distribution and of the point, in units of the figure's range
  /// (Headline::distance()); empty for a figure without a range.
  std::optional<double> score, point_score;

  [[nodiscard]] bool within_half() const { return half.low <= recorded && recorded <= half.high; }
  [[nodiscard]] bool within_most() const { return most.low <= recorded && recorded <= most.high; }
};
/// The figures of a row; one that is not recorded or that fewer than two draws have is left out.
///
/// Quantiles are predictive_quantile(): an n + 1st draw lies within an interval with its probability.
///
/// Weighted interval score (Bracher et al., PLOS Computational Biology 17(2), 2021) of median and both
/// intervals:
///   (|x - m| / 2 + sum over a in {0.5, 0.1} of a / 2 (u - l) + max(l - x, 0) + max(x - u, 0)) / 2.5.
/// A point forecast scores its distance |x - m|; less is better.
[[nodiscard]] std::vector<EnsembleFigure> ensemble_figures(const EnsembleRow& row);

/// Sums over figures of all rows.
struct Coverage {
  std::size_t figures = 0, within_half = 0, within_most = 0;
  double score = 0, point_score = 0;  ///< means; 0 without figures
  std::size_t scored = 0;
  double widest_p50 = 0;  ///< largest ratio of the ends of the 90 % interval of horizontal p50; 0: none
};
[[nodiscard]] Coverage coverage(const std::vector<EnsembleRow>& rows);

/// For terminals: for each row what is drawn and a table of its figures, then the coverage with its goals.
[[nodiscard]] std::string ensemble_text(const std::vector<EnsembleRow>& rows);
/// The figures, the values of all draws, and the coverage.
[[nodiscard]] std::string ensemble_json(const std::vector<EnsembleRow>& rows);

}  // namespace canyon::validation
