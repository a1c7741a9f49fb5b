#pragma once

#include <cmath>
#include <cstdio>

#include "adapters/ros/conversions.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/encoding/observations/raw_observations.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::ros_messages {

/// canyon_msgs/GnssRawObservations of one receiver, epoch by epoch in order of time: carrier phases are
/// tracked, so that each begins near its pseudorange and a cycle slip is reported once.
class RawObservations {
 public:
  /// @param epoch null if the truth has not come: no observations
  template <class GnssRawObservations>
  [[nodiscard]] GnssRawObservations message(const Head& head, const simulation::Epoch* epoch) {
    GnssRawObservations message;
    detail::set_header(message.header, head);
    message.gps_week = -1;
    message.gps_tow = detail::kNaN;
    message.leap_seconds = 0;
    if (epoch == nullptr) return message;
    const receiver::ReceiverEpoch& observed = epoch->observed;
    message.gps_week = observed.reported(observed.receiver_time).week();
    message.gps_tow = observed.receiver_time.seconds_of_week();
    message.leap_seconds = static_cast<std::int8_t>(geodesy::leap_seconds(observed.time));
    for (const receiver::SatelliteObservation& satellite : observed.satellites) {
      const auto add = [&](const receiver::SignalObservation& seen) {
        if (!seen.measurement) return;
        const gnss::Signal& signal =
            seen.signal != nullptr ? *seen.signal : gnss::signals_of(satellite.id.system).front();
        message.observations.emplace_back();
        fill(message.observations.back(), satellite.id, signal, *seen.measurement, observed.time);
      };
      add(satellite);
      for (const receiver::SignalObservation& more : satellite.more) add(more);
    }
    return message;
  }
  /// Time restarts.
  void reset() { arcs_ = {}; }

 private:
  template <class GnssRawObservation>
  void fill(GnssRawObservation& to, gnss::SatelliteId id, const gnss::Signal& signal,
            const positioning::Measurement& measured, geodesy::GpsTime time) {
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    detail::assign(to.id, gnss::to_string(id));
    to.system = detail::system_code<GnssRawObservation>(id.system);
    to.prn = prn_number(id);
    detail::assign(to.code, std::string(signal.code));
    to.carrier_frequency = measured.carrier_frequency_hz;
    const double channel =
        signal.channel_hz == 0 ? 0 : (measured.carrier_frequency_hz - signal.carrier_hz) / signal.channel_hz;
    to.frequency_channel = static_cast<std::int8_t>(std::lround(channel));
    to.pseudorange = measured.pseudorange_m;
    to.pseudorange_deviation = static_cast<float>(measured.sigma_m);
    to.doppler = measured.doppler_hz.value_or(detail::kNaN);
    to.doppler_deviation = measured.doppler_hz ? static_cast<float>(measured.doppler_sigma_hz) : kNaN;
    to.cn0 = measured.cn0_dbhz ? static_cast<float>(*measured.cn0_dbhz) : kNaN;
    to.carrier_phase = detail::kNaN;
    to.carrier_phase_deviation = to.lock_time = kNaN;
    to.loss_of_lock = false;
    if (const auto link = arcs_.next(measured, gnss::index_of(signal))) {
      to.carrier_phase = *measured.carrier_phase_cycles + link->alignment_cycles;
      to.carrier_phase_deviation = static_cast<float>(measured.carrier_phase_sigma_cycles);
      to.lock_time = static_cast<float>(time - *measured.phase_since);
      to.loss_of_lock = link->slip;
    }
  }

  encoding::PhaseArcs arcs_;
};

/// A receiver's state for diagnostics, in addition to its epoch.
struct ReceiverHealth {
  std::string name;       ///< the node's
  std::string receiver;   ///< its profile or name
  std::string reason;     ///< why there is no epoch
  double lateness_s = 0;  ///< delay of the last epoch after the clock
  double compute_s = 0;   ///< wall time of the last epoch in the node's own thread
  bool finished = false;  ///< the drive has ended
};

/// diagnostic_msgs/DiagnosticArray: OK with a fix or after the drive's end, WARN with an epoch without one,
/// ERROR if the truth is missing.
template <class DiagnosticArray>
[[nodiscard]] DiagnosticArray diagnostics_message(const Head& head, const ReceiverHealth& health,
                                                  const simulation::Epoch* epoch) {
  using Status = typename std::remove_reference_t<decltype(DiagnosticArray::status)>::value_type;
  DiagnosticArray message;
  detail::set_header(message.header, head);
  detail::assign(message.header.frame_id, "");
  message.status.emplace_back();
  Status& status = message.status.back();
  detail::assign(status.name, health.name + ": receiver");
  detail::assign(status.hardware_id, "canyon " + health.receiver);
  const auto log = [&](int level, const std::string& text) {
    status.level = static_cast<std::remove_reference_t<decltype(status.level)>>(level);
    detail::assign(status.message, text);
  };
  const auto add = [&](const char* key, const std::string& value) {
    status.values.emplace_back();
    detail::assign(status.values.back().key, key);
    detail::assign(status.values.back().value, value);
  };
  const auto number = [](double value) {
    std::string text(32, '\0');
    text.resize(static_cast<std::size_t>(std::snprintf(text.data(), text.size(), "%.6g", value)));
    return text;
  };
  if (health.finished) {
    log(Status::OK, "the drive has ended");
  } else if (epoch == nullptr) {
    log(Status::ERROR, health.reason);
  } else {
    const positioning::Fix& fix = epoch->observed.fix;
    if (fix.measured())
      log(Status::OK, "fix");
    else if (fix.solved())
      log(Status::WARN, "prediction: no satellite is used");
    else
      log(Status::WARN, "no fix: " + std::string(encoding::no_fix_reason(fix, epoch->containment)));
    add("kind of fix", std::string(gnss::name(fix.kind())));
    if (fix.correction_age_s) add("age of corrections [s]", number(*fix.correction_age_s));
    add("satellites used", std::to_string(encoding::used_count(fix)));
    add("satellites tracked", std::to_string(epoch->observed.visible));
    add("satellites blocked", std::to_string(epoch->observed.blocked));
    if (fix.solved() && fix.dop) add("HDOP", number(fix.dop->hdop));
    if (fix.solved()) add("horizontal error [m]", number(encoding::horizontal_m(epoch->error_enu_m)));
  }
  add("behind the clock [s]", number(health.lateness_s));
  add("computing [s]", number(health.compute_s));
  return message;
}

}  // namespace canyon::ros_messages
