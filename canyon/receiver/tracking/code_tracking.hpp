#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>

#include "canyon/base/options/fwd.hpp"
#include "canyon/receiver/tracking/correlation.hpp"
#include "canyon/sky/gnss/signal_groups.hpp"

namespace canyon::tracking {

/// A loop whose prompt correlator has less than this fraction of the strongest path's power has no lock.
inline constexpr double kMinPrompt = 1e-3;

/// How a delay lock loop forms its error signal from correlators E (early), P (prompt) and L (late).
enum class Discriminator : std::uint8_t {
  /// Re[(E - L) P*] / |P|: a phase lock loop keeps the carrier on the prompt correlator.
  Coherent,
  /// |E|^2 - |L|^2, non-coherent.
  EarlyLatePower,
  /// Re[(E - L) P*].
  DotProduct,
  /// Re[(2 (E1 - L1) - (E2 - L2)) P*], E2 and L2 at twice the spacing of E1 and L1: double delta, strobe or
  /// high resolution correlator (McGraw & Braasch, ION NTM 1999).
  DoubleDelta,
};

/// "coherent", "early-late power", "dot product", "double delta".
[[nodiscard]] std::string_view name(Discriminator discriminator);

struct DllOptions {
  Discriminator discriminator = Discriminator::EarlyLatePower;
  /// From early to late [chips], (0.001, 1]; of the inner pair for DoubleDelta, (0.001, 0.5]. 1 is the
  /// standard, 0.1 the narrow correlator (van Dierendonck, Fenton & Ford, Navigation 39(3), 1992).
  double spacing_chips = 0.5;
  gnss::SignalValues spacings_chips;  ///< of signals with another spacing
  /// One-sided noise bandwidth Bn [Hz], (0, 50]. Carrier-aided code loops are narrow: Kaplan & Hegarty (2nd
  /// ed. 2006, figure 5.28) use 0.2 and 2 Hz.
  double loop_bandwidth_hz = 1;
  gnss::SignalValues loop_bandwidths_hz;  ///< of signals with another bandwidth
  /// C/N0 [dB-Hz] below which the loop narrows as its discriminator becomes noisier (CodeLoopNoise), [0,
  /// 100]. 0: never; the bandwidth is fixed.
  double narrow_below_dbhz = 0;
  /// Coherent integration T [s], (0, 10]; Bn T below 0.5. A bit of GPS L1 C/A has 20 ms.
  double integration_s = 0.02;
  /// Time for which another peak of the correlation, beyond the discriminator's reach, must be stronger
  /// before the loop jumps to it [s], [0.01, 100]: a side peak of a BOC signal ("bump-jumping", Fine &
  /// Wilson, ION NTM 1999), or an earlier path within a chip and a half. Infinite: never, and a loop stays on
  /// a side peak or an echo while it is tracked.
  double peak_check_s = 1;
  [[nodiscard]] bool operator==(const DllOptions&) const = default;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, DllOptions& o);

/// Throws InputError if one of a loop's bandwidths times its integration is 0.5 or more.
void check_bandwidths(double bandwidth_hz, const gnss::SignalValues& others_hz, double integration_s,
                      std::string_view loop);
/// Options of a code, phase or frequency loop for one signal: spacing and bandwidth are the signal's.
template <typename LoopOptions>
[[nodiscard]] LoopOptions for_signal(LoopOptions options, const gnss::Signal& signal) {
  options.loop_bandwidth_hz = gnss::value_of(options.loop_bandwidths_hz, signal, options.loop_bandwidth_hz);
  options.loop_bandwidths_hz.clear();
  if constexpr (std::is_same_v<LoopOptions, DllOptions>) {
    options.spacing_chips = gnss::value_of(options.spacings_chips, signal, options.spacing_chips);
    options.spacings_chips.clear();
  }
  return options;
}

/// The correlators whose weighted sum, times P*, is the discriminator (EarlyLatePower: E - L).
struct CorrelatorBank {
  int count = 0;
  std::array<double, 4> offset_chips{};  ///< of the replica, negative: early
  std::array<double, 4> weight{};
};
[[nodiscard]] CorrelatorBank correlator_bank(const DllOptions& options);

/// One path from satellite to antenna as seen by a receiver's channel.
struct SignalPath {
  double delay_m = 0;                       ///< relative to the direct path, >= 0 for a detour
  std::complex<double> amplitude = {1, 0};  ///< any common unit; |.|^2 is power, arg the carrier phase
  /// Frequency [Hz] relative to the tracked carrier (either sign), see fading_rate_hz().
  double fading_hz = 0;
  /// Rate of its delay relative to that of the path whose carrier aids the loop [m/s].
  double drift_mps = 0;
  /// A cluster of waves: fading_hz represents its spread, and does not rotate its phase between epochs.
  bool diffuse = false;
};

/// State of a code loop between epochs.
struct CodeLoopState {
  double delay_m = 0;  ///< of the replica relative to the direct path
  /// Time for which the earlier or later peak has been stronger than the tracked one, minus the time for
  /// which it was not [s], >= 0.
  double early_s = 0, late_s = 0;
  bool jumped = false;  ///< to another peak, in the last step
};

/// Equilibrium of a loop.
struct CodeLock {
  double delay_m = 0;  ///< of the replica: the code's error relative to the direct path
  /// Prompt correlator: the paths' coherent sum, in their unit. Its argument is the carrier phase of a locked
  /// PLL.
  std::complex<double> prompt;
  /// Mean power of the prompt correlator over the fading, |.|^2 of the paths' unit. Its ratio to the power of
  /// the direct path alone, R(0)^2 |a|^2, is the change of C/N0 by multipath.
  double prompt_power = 0;
};

/// Code delay of a delay lock loop with any number of paths: noise-free, its equilibrium and its transient.
///
/// The loop moves its replica against the sign of the discriminator D(tau) and rests where D crosses zero
/// upwards. Each path's amplitude is first averaged as in the receiver (docs/tracking.md):
///   over the integration time: a sinc(pi f T);
///   over the loop, the first-order filter of noise bandwidth Bn: the part a / sqrt(1 + (2 pi f / 4 Bn)^2)
///   adds coherently, the rest of the power incoherently.
/// So slow fading moves the code by the multipath error envelope, and fast fading leaves the small bias of
/// the sum of powers.
/// Const, thread-safe.
class CodeTracker {
 public:
  /// Throws InputError if options do not validate(), and if the correlators are so far apart that the
  /// discriminator does not rise through the peak (BOC signals).
  CodeTracker(const CorrelationOptions& signal, const DllOptions& loop);

  [[nodiscard]] const Correlation& correlation() const { return correlation_; }
  [[nodiscard]] const DllOptions& options() const { return options_; }

  /// D at a replica's delay [m]: power in the paths' unit (amplitude for Coherent), positive if the replica
  /// is late. Inputs must be finite (InputError).
  [[nodiscard]] double discriminator(double delay_m, std::span<const SignalPath> paths) const;

  /// The zero that the loop converges to from `prior_m`, its previous delay. Without a prior, or if D has no
  /// pull there, from the delay of the path with the strongest prompt correlator (the result of acquisition).
  /// Zeros are found between the earliest and the latest path, plus a chip on either side, if they are at
  /// least an eighth of the spacing apart (closer pairs may be missed), exact to 1e-9 chips. Empty: no paths,
  /// no power, or no zero with a prompt power above a thousandth of the strongest path's. Inputs must be
  /// finite (InputError). Does not allocate for up to 64 paths; at most 25,000 evaluations of D, typically
  /// some ten (ZeroSearch).
  [[nodiscard]] std::optional<CodeLock> lock(std::span<const SignalPath> paths,
                                             std::optional<double> prior_m = std::nullopt) const;

  /// Weights of a path with fading_hz after integration and loop filter: amplitudes times `coherent` add
  /// coherently, powers times `incoherent` incoherently.
  struct CoherenceWeights {
    double coherent = 1, incoherent = 0;
  };
  [[nodiscard]] CoherenceWeights coherence_weights(double fading_hz) const;
  /// A path after integration and loop filter.
  struct Averaged {
    double delay_chips = 0;
    std::complex<double> coherent;
    double incoherent = 0;  ///< power
    [[nodiscard]] double power() const { return std::norm(coherent) + incoherent; }
  };
  /// lock() on averaged paths.
  [[nodiscard]] std::optional<CodeLock> lock_averaged(std::span<const Averaged> paths,
                                                      std::optional<double> prior_m = std::nullopt) const;

  /// Moves a loop by its own dynamics over `elapsed_s` >= 0, at whose end the paths are `paths`.
  ///
  /// A first-order, carrier-aided loop: the caller moves state.delay_m with the path whose carrier is
  /// tracked. Here the replica moves against the normalised discriminator e [chips] with rate k e, k = 4 Bn,
  /// in steps of T or, if longer, a quarter of the time constant 1 / k, each exact for a constant e. e = D /
  /// (sum of the correlators' powers), scaled to unit slope at the peak of a single path and limited to half
  /// a chip. Each path's phase rotates with fading_hz and its delay drifts with drift_mps, so that the loop
  /// itself filters the fading; fading within a step is averaged before. Only the last 12 / k of a long time
  /// are simulated, more than a loop remembers. Statistics do not depend on the division of time into calls.
  ///
  /// At each step the power at the replica is compared with that at other peaks, one on the early and one on
  /// the late side: the neighbouring peak of the correlation function, and, early, the strongest path that is
  /// more than a spacing and less than 1.5 chips ahead (a later one can only be an echo). The loop jumps
  /// after DllOptions::peak_check_s. The count is a mean over noisy comparisons (normal approximation of the
  /// noise by C/N0).
  ///
  /// @param unit_cn0_hz C/N0 as a ratio [Hz] of a path of power 1
  /// @param bandwidth_ratio used fraction of the loop's bandwidth (CodeLoopNoise), (0, 1]
  /// Empty, and the loop does not move: no power, or a prompt power below a thousandth of the strongest
  /// path's at the end. Inputs must be finite (InputError).
  [[nodiscard]] std::optional<CodeLock> follow(CodeLoopState& state, std::span<const SignalPath> paths,
                                               double elapsed_s, double unit_cn0_hz,
                                               double bandwidth_ratio = 1) const;

  /// From the main peak of |R| to its neighbours [chips]; 0: none above a quarter of it.
  [[nodiscard]] double side_peak_chips() const { return side_peak_chips_; }
  /// Step of the search [chips]: features of D are at least eight steps wide.
  [[nodiscard]] double step_chips() const { return step_chips_; }
  /// Error of the code [chips] over D / (sum of the correlators' powers), near the peak of a single path.
  [[nodiscard]] double gain_chips() const { return gain_chips_; }

 private:
  struct Pull;
  struct Search;
  struct Loop;
  [[nodiscard]] Averaged average(const SignalPath& path) const;
  [[nodiscard]] Pull pull(double delay_chips, std::span<const Averaged> paths) const;
  [[nodiscard]] CodeLock prompt(double delay_chips, std::span<const Averaged> paths) const;

  Correlation correlation_;
  DllOptions options_;
  CorrelatorBank bank_;
  double step_chips_ = 0;
  double gain_chips_ = 0;
  double side_peak_chips_ = 0;
};

/// A cached tracker of these options: a front end's table of correlation takes 2 ms, more than an epoch.
/// Thread-safe. Throws as the constructor does.
[[nodiscard]] std::shared_ptr<const CodeTracker> shared_code_tracker(const CorrelationOptions& signal,
                                                                     const DllOptions& loop);

}  // namespace canyon::tracking
