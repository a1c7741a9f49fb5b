#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/kernels/layers.hpp"

namespace canyon::heatmap {

/// The layer that best shows whether a cell has a fix: Availability, else an error or a DOP (NaN without),
/// else SatellitesUsed (0 without). Index into `layers`; empty if there is none of them.
[[nodiscard]] std::optional<std::size_t> fix_layer(std::span<const Layer> layers);
/// The fraction of the time with a fix [1] according to a value of such a layer.
[[nodiscard]] double fix_fraction(Layer layer, float value);

/// Counts values in bounded memory (2 MiB) and computes quantiles: each value is rounded to ten significant
/// bits, so that whole numbers up to 1,024 are exact and others within 1/2048 of their magnitude.
class ValueCounts {
 public:
  ValueCounts();
  /// Ignores NaN; infinities count.
  void add(float value);
  [[nodiscard]] std::size_t count() const { return count_; }
  /// NaN if there is no value.
  [[nodiscard]] double mean() const;
  [[nodiscard]] double least() const { return least_; }
  [[nodiscard]] double greatest() const { return greatest_; }
  /// The least value with at least p of all at or below it (definition 1 of Hyndman and Fan, The American
  /// Statistician 50, 1996), rounded as above. NaN if there is no value. @param p in [0, 1] (asserted)
  [[nodiscard]] double quantile(double p) const;

 private:
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::size_t> bins_;
  std::size_t count_ = 0;
  double sum_ = 0, least_ = kNone, greatest_ = kNone;
};

struct LayerSummary {
  Layer layer = Layer::HorizontalError;
  std::size_t values = 0;                                         ///< that are not NaN
  double mean = 0, least = 0, median = 0, p95 = 0, greatest = 0;  ///< NaN without values
};

/// A map in a few metrics. Cells count once for each altitude; values once for each time as well.
struct MapSummary {
  std::size_t cells = 0;
  std::array<std::size_t, 5> states{};  ///< cells by CellState, of tiles that were computed
  std::size_t missing = 0;              ///< cells times times of tiles that were not computed
  std::size_t values = 0;               ///< cells times times in CellState::Computed
  std::optional<double> availability;   ///< mean of fix_fraction() over them; empty if no layer shows it
  std::vector<LayerSummary> layers;     ///< in the request's order

  [[nodiscard]] std::size_t in_state(CellState state) const {
    return states[static_cast<std::size_t>(state)];
  }
};

/// Reads every slice once, tile by tile; passes its exceptions on. Memory: a slice and 2 MiB a layer.
[[nodiscard]] MapSummary summarize(const MapSource& source);

}  // namespace canyon::heatmap
