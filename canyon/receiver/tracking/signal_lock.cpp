#include "canyon/receiver/tracking/signal_lock.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::tracking {

std::string_view name(LockState state) {
  static constexpr std::string_view kNames[]{"searching", "tracking", "holding"};
  return kNames[static_cast<std::size_t>(state)];
}

SignalLock::SignalLock(const SignalLockOptions& options) : options_(options) {
  options_.validate();
}

LockState SignalLock::update(geodesy::GpsTime time, std::optional<double> cn0_dbhz) {
  if (cn0_dbhz && !std::isfinite(*cn0_dbhz))
    throw InputError(fmt::format("the C/N0 of a signal is {}", *cn0_dbhz), "leave it empty without a signal");
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
  // The period of constant C/N0 starts here.
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

void SignalLockOptions::validate() const {
  options::check(*this, "signal lock");
  if (tracking_threshold_dbhz > acquisition_threshold_dbhz) {
    throw InputError(
        fmt::format("tracking_threshold_dbhz of the signal lock is {}", tracking_threshold_dbhz),
        fmt::format("give at most the acquisition threshold, {} dB-Hz", acquisition_threshold_dbhz));
  }
}

void visit(options::Visitor& v, SignalLockOptions& o) {
  constexpr options::Range kCn0{-100, 100};
  constexpr options::Range kSeconds{0, 1e8};
  v.number({"acquisition_threshold_dbhz", "dB-Hz", "C/N0 at which a signal is acquired"},
           o.acquisition_threshold_dbhz, kCn0);
  v.number({"tracking_threshold_dbhz", "dB-Hz", "lowest C/N0 at which a signal is tracked"},
           o.tracking_threshold_dbhz, kCn0);
  v.number({"cold_acquisition_s", "s", "time from appearance to first measurement of an unknown signal"},
           o.cold_acquisition_s, kSeconds);
  v.number(
      {"reacquisition_s", "s", "time from appearance to first measurement of a previously tracked signal"},
      o.reacquisition_s, kSeconds);
  v.number({"hold_s", "s", "time for which loops coast below the threshold before a new search"}, o.hold_s,
           kSeconds);
  v.number({"memory_s", "s", "a signal lost for longer counts as unknown"}, o.memory_s, kSeconds);
  v.boolean({"warm_start", "", "the receiver has been running: all signals are known at the first epoch"},
            o.warm_start);
}

}  // namespace canyon::tracking
