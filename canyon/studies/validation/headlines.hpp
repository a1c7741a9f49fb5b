#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/studies/validation/figures.hpp"

// The figures that stand for a recording: one table has their names, values and ranges. Tables of recordings
// and models and the score card read it.

namespace canyon::validation {

/// Where a simulated figure should lie.
struct FigureRange {
  enum class Of { Nothing, Value, Difference, Ratio };  ///< the figure, less the recorded one, or over it

  Of of = Of::Nothing;
  double low = 0;  ///< of a ratio; of a value that of a perfect simulation
  double end = 0;
  std::string_view unit = {};  ///< behind a number: " m"

  /// The value, difference or ratio; empty where there is no range or a figure is missing.
  [[nodiscard]] std::optional<double> compared(const std::optional<double>& measured,
                                               const std::optional<double>& simulated) const;
  /// Distance of a compared() value from a perfect simulation, in units of the range: within it from -1 to 1.
  /// Signed for differences and ratios (of their logarithm), for others from 0.
  [[nodiscard]] double distance(double compared) const;
  /// "at most 0.2", "0.7 to 1.4", "at least 80 %".
  [[nodiscard]] std::string text() const;
};

/// A figure, and the range that the score card compares it with (docs/results.md).
struct FigureInfo {
  enum class Kind {
    OfModel,  ///< stands in the table of models alone, and has no headline
    Both,     ///< one value of measured and simulated together, such as a distance
    Pair,     ///< one value of the measured, one of the simulated
    OwnFixes  ///< as Pair, in recordings that have fixes of their own
  };
  using Value = std::optional<double> (*)(const ModelFigures& figures, Side side);

  std::string_view key, title;
  int decimals = 1;
  Kind kind = Kind::Both;
  Value value = nullptr;
  FigureRange range = {};
};
/// All, in the order of tables.
[[nodiscard]] std::span<const FigureInfo> figure_infos();
/// Null where there is no such figure.
[[nodiscard]] const FigureInfo* figure_info(std::string_view key);

/// One of the figures that stand for a recording in a table of several.
struct Headline {
  FigureInfo info;
  std::optional<double> measured, simulated;  ///< without pair() `simulated` is of both together
  std::optional<Interval> measured_interval, simulated_interval;  ///< 95 %, blocks of time

  /// Whether recorded and simulated have one each.
  [[nodiscard]] bool pair() const {
    return info.kind == FigureInfo::Kind::Pair || info.kind == FigureInfo::Kind::OwnFixes;
  }
  /// FigureRange::distance() of it; empty without a range, and where a value is missing.
  [[nodiscard]] std::optional<double> distance() const;
  /// Whether it lies in its range (docs/results.md has them); empty as distance().
  [[nodiscard]] std::optional<bool> within() const;
};
[[nodiscard]] Headline headline(const FigureInfo& info, const ModelFigures& figures);
/// Headlines without intervals, always the same ones in the same order; those of own fixes, if any, come
/// last.
[[nodiscard]] std::vector<Headline> headlines(const ModelFigures& figures);
/// headlines() of figures() of these epochs, without the figures that have no headline.
[[nodiscard]] std::vector<Headline> headlines(const Comparison& comparison, std::size_t first,
                                              std::size_t count);
/// The recording's own epochs [other_first, other_first + other_count) in the place of the simulated ones:
/// what a part of a recording says of another, as a bound of what can be learnt from it. Without explanations
/// of single errors.
[[nodiscard]] std::vector<Headline> headlines_by_other_part(const Comparison& comparison, std::size_t first,
                                                            std::size_t count, std::size_t other_first,
                                                            std::size_t other_count);
/// Their intervals: the figures anew from blocks of epochs drawn with replacement. Own fixes get none. @param
/// headlines_of_all of these epochs and runs, as for figures()
void add_intervals(std::vector<Headline>& headlines_of_all, const Comparison& comparison, std::size_t first,
                   std::size_t count, const FigureOptions& options, std::span<const Comparison> runs = {});
/// The headline with that key; null where there is none.
[[nodiscard]] const Headline* headline_with(const std::vector<Headline>& headlines, std::string_view key);
/// "2.3 (8.5)": simulated, with measured in brackets; "-" for missing values. Interval: "1.9 to 3.1 (6.0 to
/// 9.2)".
[[nodiscard]] std::string value_text(const Headline& headline);
[[nodiscard]] std::string interval_text(const Headline& headline);

}  // namespace canyon::validation
