#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "canyon/validation/figures.hpp"

namespace canyon::validation {

/// A figure that a simulation of a recorded drive should reach, and what it reached. The bounds are Canyon's
/// own goals of realism, stated in docs/results.md: all in one place, targets().
struct Target {
  std::string name;    ///< "NLOS pseudorange error, KS distance"
  std::string wanted;  ///< "at most 0.15"
  double low = 0;      ///< reached within [low, high]
  double high = std::numeric_limits<double>::infinity();
  std::optional<double> value;  ///< empty: the recording or the model gives none
  int decimals = 3;             ///< that the value is written with
  double factor = 1;            ///< of the value where it is written: 100 for shares in per cent
  std::string unit;             ///< behind the written value: "", " %", " m"

  [[nodiscard]] bool reached() const { return value && *value >= low && *value <= high; }
  /// "0.912", "83.1 %"; "no value".
  [[nodiscard]] std::string value_text() const;
};

/// All targets, in the order of reports.
[[nodiscard]] std::vector<Target> targets(const Figures& figures);

}  // namespace canyon::validation
