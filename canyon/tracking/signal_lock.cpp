#include "canyon/tracking/signal_lock.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "canyon/base/input_error.hpp"

namespace canyon::tracking {
namespace {

void check_time(double seconds, std::string_view field) {
  if (!(seconds >= 0 && seconds <= 1e8)) {
    throw InputError(fmt::format("{} of the signal lock is {}", field, seconds), "it must be 0 to 1e8 s");
  }
}

}  // namespace

void SignalLockOptions::validate() const {
  if (!std::isfinite(acquisition_threshold_dbhz)) {
    throw InputError(
        fmt::format("acquisition_threshold_dbhz of the signal lock is {}", acquisition_threshold_dbhz),
        "it must be a finite number of dB-Hz");
  }
  if (!std::isfinite(tracking_threshold_dbhz) || tracking_threshold_dbhz > acquisition_threshold_dbhz) {
    throw InputError(
        fmt::format("tracking_threshold_dbhz of the signal lock is {}", tracking_threshold_dbhz),
        fmt::format("it must be at most the acquisition threshold, {} dB-Hz", acquisition_threshold_dbhz));
  }
  check_time(cold_acquisition_s, "cold_acquisition_s");
  check_time(reacquisition_s, "reacquisition_s");
  check_time(hold_s, "hold_s");
  check_time(memory_s, "memory_s");
}

std::string_view name(LockState state) {
  switch (state) {
    case LockState::Searching:
      return "searching";
    case LockState::Tracking:
      return "tracking";
    case LockState::Holding:
      return "holding";
  }
  assert(false);
  return "";
}

SignalLock::SignalLock(const SignalLockOptions& options) : options_(options) {
  options_.validate();
}

LockState SignalLock::update(geodesy::GpsTime time, std::optional<double> cn0_dbhz) {
  if (cn0_dbhz && !std::isfinite(*cn0_dbhz)) {
    throw InputError(fmt::format("the C/N0 of a signal is {}", *cn0_dbhz), "leave it empty without a signal");
  }
  if (now_ && time < *now_) {
    throw InputError(fmt::format("a signal lock cannot step by {} s", time - *now_),
                     "give epochs in order of time");
  }
  const bool findable = cn0_dbhz && *cn0_dbhz >= options_.acquisition_threshold_dbhz;
  const bool keepable = cn0_dbhz && *cn0_dbhz >= options_.tracking_threshold_dbhz;
  if (!now_ && options_.warm_start) {
    lost_at_ = time;
    if (findable) {
      state_ = LockState::Tracking;
      tracking_since_ = time;
    }
  }
  // The stretch of constant C/N0 begins here.
  const geodesy::GpsTime begin = now_.value_or(time);
  now_ = time;

  if (state_ == LockState::Tracking && !keepable && begin < time) {
    state_ = LockState::Holding;
    holding_since_ = begin;
  } else if (state_ == LockState::Holding && keepable && begin < time) {
    state_ = LockState::Tracking;
    tracking_since_ = begin;
  }
  if (state_ == LockState::Holding && !keepable) {
    const geodesy::GpsTime end = holding_since_ + options_.hold_s;
    if (time >= end) {
      state_ = LockState::Searching;
      lost_at_ = end;
      found_since_.reset();
    }
  }
  if (state_ != LockState::Searching) return state_;

  if (!findable) {
    if (begin < time) found_since_.reset();
    return state_;
  }
  if (!found_since_) found_since_ = begin;
  const bool known = lost_at_ && *found_since_ <= *lost_at_ + options_.memory_s;
  const geodesy::GpsTime found =
      *found_since_ + (known ? options_.reacquisition_s : options_.cold_acquisition_s);
  if (time >= found) {
    state_ = LockState::Tracking;
    tracking_since_ = found;
    found_since_.reset();
  }
  return state_;
}

std::optional<geodesy::GpsTime> SignalLock::tracking_since() const {
  if (state_ != LockState::Tracking) return std::nullopt;
  return tracking_since_;
}

}  // namespace canyon::tracking
