#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "canyon/validation/figures.hpp"

// Private to canyon/validation.

namespace canyon::validation {

/// At kQuantiles; 0 of nothing.
[[nodiscard]] std::array<double, 5> five_quantiles(std::span<const double> values);
[[nodiscard]] DistributionPair pair_of(std::span<const double> measured, std::span<const double> simulated);
/// Sorted into LOS [0] and NLOS [1].
struct ByView {
  std::array<std::vector<double>, 2> of;
  void add(bool nlos, double value) { of[nlos ? 1 : 0].push_back(value); }
  [[nodiscard]] const std::vector<double>& los() const { return of[0]; }
  [[nodiscard]] const std::vector<double>& nlos() const { return of[1]; }
};

/// Observations of one signal by both receivers.
struct ObservationSample {
  std::array<TrackedShare, 2> tracked;  ///< LOS, NLOS
  ByView error, cn0, simulated_error, simulated_cn0;

  void add_measured(bool nlos, const ComparedSignal& s);
  void add_simulated(bool nlos, const ComparedSignal& s);
  /// @param runs that the simulated values are of
  void write(ObservationFigures& to, std::size_t runs) const;
};

/// Figures of every signal of a comparison's epochs [first, first + count), simulated values those of `runs`
/// (not empty). figures() puts them into Figures::signals.
[[nodiscard]] std::vector<SignalFigures> signal_figures(const Comparison& comparison, std::size_t first,
                                                        std::size_t count, std::span<const Comparison> runs);

}  // namespace canyon::validation
