#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::positioning {

enum class Smoothing : std::uint8_t {
  None,
  /// Smooths by the signal's own carrier (Hatch, The synergism of GPS code and carrier measurements, 1982):
  /// the ionosphere, which delays codes and advances carriers, leaves 2 (window_s) dI/dt behind.
  Hatch,
  /// Smooths by a combination of two carriers that has the code's delay: no divergence. Where only one
  /// carrier goes on: as Hatch.
  DivergenceFree,
};

struct SmoothingOptions {
  Smoothing smoothing = Smoothing::None;
  double window_s = 100;  ///< time constant [s], [1, 3600]; 100 of aviation receivers (RTCA DO-229)
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
/// Visits its fields.
void visit(options::Visitor& v, SmoothingOptions& o);

/// A part of a code's error: correlated in time by e^(-dt rate_per_s).
struct CodeNoise {
  double sigma_m = 0;
  double rate_per_s = 0;  ///< >= 0; infinite: white
};

/// A pseudorange smoothed by the way that a carrier went:
///   S_k = a P_k + (1 - a) (S_k-1 + L_k - L_k-1),  a = max(dt / window, 1 / k)
/// so that the first epochs after a slip are plain averages. Its deviation is followed exactly for codes
/// whose errors are sums of two first-order processes (CodeNoise) of constant deviation; the carrier's noise
/// is left out.
class CodeSmoother {
 public:
  struct Smoothed {
    double pseudorange_m = 0;
    double sigma_m = 0;  ///< of what CodeNoise says alone
  };
  /// The smoothed pseudorange of the next epoch.
  /// @param carrier_step_m L_k - L_k-1; empty: begins anew
  [[nodiscard]] Smoothed next(geodesy::GpsTime time, double pseudorange_m,
                              std::optional<double> carrier_step_m, const std::array<CodeNoise, 2>& noise,
                              const SmoothingOptions& options);

 private:
  std::optional<geodesy::GpsTime> last_;
  int count_ = 0;
  double smoothed_m_ = 0;
  // Variance of the smoothed error and its covariance with the code's, over each part's own.
  std::array<double, 2> variance_{}, covariance_{};
};

}  // namespace canyon::positioning
