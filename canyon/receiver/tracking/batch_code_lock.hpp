#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "canyon/receiver/tracking/code_tracking.hpp"

namespace canyon::tracking {

/// CodeTracker::lock() without a prior for many receivers at once ("lanes"), which receive the same paths
/// with their own phases and strengths: the same ZeroSearch, eight at a time in single precision (a remaining
/// one alone), from a table of the correlation. Delays agree within 1 cm (of a chip of 293 m), prompt powers
/// within 1e-4 of themselves. Falls back to CodeTracker::lock() if a lane finds nothing, and for other
/// discriminators than early minus late power. Const, thread-safe.
class BatchCodeLock {
 public:
  static constexpr std::size_t kWidth = 8;
  /// Lanes rounded up to a multiple of kWidth.
  static constexpr std::size_t padded(std::size_t lanes) { return (lanes + kWidth - 1) / kWidth * kWidth; }

  /// Paths after integration and loop filter: see average().
  struct Paths {
    std::size_t lanes = 0;
    std::size_t stride = 0;          ///< of a path in the lists of lanes: padded(lanes)
    std::vector<float> delay_chips;  ///< [path]
    std::vector<float> re, im;       ///< [path][lane], adds coherently
    std::vector<float> incoherent;   ///< [path][lane], power that adds incoherently

    [[nodiscard]] std::size_t size() const { return delay_chips.size(); }
    /// Removes all paths; keeps the capacity.
    void clear(std::size_t lane_count);
    /// Appends a path without power; returns its index in the lists of lanes.
    std::size_t add(double at_chips);
  };

  explicit BatchCodeLock(std::shared_ptr<const CodeTracker> tracker);

  [[nodiscard]] const CodeTracker& tracker() const { return *tracker_; }
  using CoherenceWeights = CodeTracker::CoherenceWeights;
  [[nodiscard]] CoherenceWeights average(double fading_hz) const {
    return tracker_->coherence_weights(fading_hz);
  }

  /// @param delay_m, prompt_power [lane]; power 0 if a lane has no lock
  void lock(const Paths& paths, std::span<float> delay_m, std::span<float> prompt_power) const;

 private:
  /// Delay [chips] and prompt power of each lane from `first` on; power -1 if a lane found nothing.
  template <std::size_t Width>
  void lock_group(const Paths& paths, std::size_t first, std::array<float, Width>& delay,
                  std::array<float, Width>& power) const;
  void lock_alone(const Paths& paths, std::size_t lane, float& delay_m, float& prompt_power) const;

  std::shared_ptr<const CodeTracker> tracker_;
  std::vector<float> table_;  // R
  float half_spacing_ = 0, step_ = 0, gain_ = 0, least_ = 0;
};

}  // namespace canyon::tracking
