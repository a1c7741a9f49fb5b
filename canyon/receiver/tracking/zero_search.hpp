#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace canyon::tracking {

/// Convergence of a code loop to a stable zero of its discriminator D, one evaluation of D at a time:
/// CodeTracker runs one search in doubles, BatchCodeLock eight in parallel in floats. The replica moves
/// against the sign of D; a zero is stable if D rises with the delay there. Delays in chips.
template <typename Real>
struct ZeroSearch {
  enum class State : std::uint8_t { Scanning, Refining, Located, Lost };

  /// |D| below this fraction of its correlators' power is rounding noise.
  static constexpr Real kSilent = sizeof(Real) == sizeof(float) ? Real(3e-6) : Real(1e-13);
  /// Accuracy of a found zero [chips].
  static constexpr Real kWidth = sizeof(Real) == sizeof(float) ? Real(1e-5) : Real(1e-10);
  static constexpr int kMaxLooks = 8000;  ///< evaluations of one search

  State state = State::Lost;
  Real at = 0;  ///< next delay to evaluate D at; if Found: the zero

  [[nodiscard]] bool looking() const { return state == State::Scanning || state == State::Refining; }

  /// Scans from `start` in a direction, +1 or -1; D is known there.
  void scan(Real start, Real d, Real direction, Real first_step, Real max_step) {
    *this = {};
    state = State::Scanning;
    direction_ = direction;
    max_step_ = max_step;
    step_ = std::clamp(first_step, max_step / 1024, max_step);
    at = start;
    note(d);
    at += direction_ * step_;
  }
  /// Scans in the direction in which D != 0 moves a replica, while it does. @param expected distance to the
  /// zero, if D were linear
  void run(Real start, Real d, Real expected, Real max_step) {
    scan(start, d, d < 0 ? Real(1) : Real(-1), Real(1.2) * std::abs(expected), max_step);
    driven_ = true;
  }
  /// Between delays at which D is negative (low) and positive (high).
  void refine(Real low, Real high, Real d_low, Real d_high) {
    state = State::Refining;
    low_ = low, high_ = high, d_low_ = d_low, d_high_ = d_high;
    side_ = 0;
    divide();
  }
  /// Processes D at `at`; 0 if it is silent.
  void take(Real d) {
    ++looks_;
    if (state == State::Refining) return narrow(d);
    if (note(d)) return;
    step_ = std::min(2 * step_, max_step_);
    at += direction_ * step_;
    if (looks_ >= kMaxLooks || (driven_ && since_ < 0)) state = State::Lost;
  }

 private:
  /// Processes a sample of the scan: true if D crossed zero upwards, with at most one silent sample between;
  /// an interval without pull is no crossing.
  bool note(Real d) {
    const int sign = d > 0 ? 1 : d < 0 ? -1 : 0;
    const int wanted = direction_ > 0 ? -1 : 1;
    if (sign == wanted) {
      from_ = at;
      d_from_ = d;
      since_ = 0;
    } else if (sign == -wanted && since_ >= 0 && since_ <= 1) {
      direction_ > 0 ? refine(from_, at, d_from_, d) : refine(at, from_, d, d_from_);
      return true;
    } else if (since_ >= 0) {
      ++since_;
      if (sign != 0) since_ = -1;
    }
    return false;
  }
  /// Regula falsi with the Illinois correction, and bisection if that is slow: D may have corners.
  void narrow(Real d) {
    if (d == 0) {
      state = State::Located;
      return;
    }
    Real& end = d > 0 ? high_ : low_;
    Real& d_end = d > 0 ? d_high_ : d_low_;
    Real& d_other = d > 0 ? d_low_ : d_high_;
    const int side = d > 0 ? 1 : -1;
    end = at;
    d_end = d;
    if (side_ == side) d_other /= 2;
    side_ = side;
    divide();
  }
  void divide() {
    at = (low_ + high_) / 2;
    if (high_ - low_ <= kWidth || refined_ >= 100) {
      state = State::Located;
      return;
    }
    if (refined_++ % 3 == 2) return;
    const Real middle = (low_ * d_high_ - high_ * d_low_) / (d_high_ - d_low_);
    if (middle > low_ && middle < high_) at = middle;
  }

  bool driven_ = false;  // the scan ends if D no longer moves the replica on
  Real direction_ = 1, step_ = 0, max_step_ = 0;
  Real from_ = 0, d_from_ = 0;
  int since_ = -1;  // samples since `from_`; -1: none
  Real low_ = 0, high_ = 0, d_low_ = 0, d_high_ = 0;
  int side_ = 0, refined_ = 0, looks_ = 0;
};

}  // namespace canyon::tracking
