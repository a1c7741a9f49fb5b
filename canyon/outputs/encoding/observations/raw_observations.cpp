#include "canyon/outputs/encoding/observations/raw_observations.hpp"

#include <algorithm>

namespace canyon::encoding {

RawEpoch RawObservations::next(const receiver::ReceiverEpoch& seen) {
  constexpr std::int64_t kMillisecond_ns = 1'000'000;
  const bool steered = tags_ == Tags::WholeMilliseconds;
  RawEpoch epoch{steered ? round_to(seen.receiver_time, kMillisecond_ns) : seen.receiver_time, {}};
  // From the exact reading: receiver_time has nanoseconds (0.3 m).
  const double shift_s = steered ? (epoch.tag - seen.time) - seen.clock_bias_s : 0;
  const double drift = steered ? seen.clock_drift : 0;
  for (const receiver::SatelliteObservation& satellite : seen.satellites) {
    const std::size_t first = epoch.observations.size();
    const auto add = [&](const receiver::SignalObservation& observed, const gnss::Signal& signal) {
      if (!observed.measurement) return;
      const positioning::Measurement& m = *observed.measurement;
      RawObservation o;
      o.id = satellite.id;
      o.signal = &signal;
      o.measurement = &m;
      o.pseudorange_m = m.pseudorange_m + geodesy::kSpeedOfLight * shift_s;
      if (m.doppler_hz) o.doppler_hz = *m.doppler_hz * (1 + drift) + m.carrier_frequency_hz * drift;
      if (const auto link = arcs_.next(m, gnss::index_of(signal))) {
        o.carrier_phase_cycles =
            *m.carrier_phase_cycles + link->alignment_cycles + m.carrier_frequency_hz * shift_s;
        o.slip = link->slip;
        geodesy::GpsTime& started = lock_start_[{satellite.id, gnss::index_of(signal)}];
        if (link->begins) started = seen.time;
        o.locked_s = seen.time - started;
      }
      epoch.observations.push_back(o);
    };
    // Manually made epochs may have no signal: uses the system's first.
    add(satellite,
        satellite.signal != nullptr ? *satellite.signal : gnss::signals_of(satellite.id.system).front());
    for (const receiver::SignalObservation& other : satellite.more) add(other, *other.signal);
    std::stable_sort(epoch.observations.begin() + static_cast<std::ptrdiff_t>(first),
                     epoch.observations.end(),
                     [](const auto& a, const auto& b) { return a.signal < b.signal; });
  }
  return epoch;
}

int signal_strength_indicator(double cn0_dbhz) {
  return static_cast<int>(std::clamp(cn0_dbhz / 6, 1.0, 9.0));
}

DeviceEpochs::DeviceEpochs(std::map<gnss::SatelliteId, int> glonass_channels, geodesy::GpsTime begin,
                           Tags tags)
    : channels_(std::move(glonass_channels)), start_(begin), clock_(begin), observations_(tags) {}

DeviceEpoch DeviceEpochs::next(const simulation::Epoch& epoch) {
  constexpr std::int64_t kMillisecond = 1'000'000;
  const receiver::ReceiverEpoch& seen = epoch.observed;
  clock_ = seen.receiver_time;
  // The time to the first fix counts from a restart, for any cause.
  if (seen.events.restart && seen.events.restart->at != start_) {
    start_ = seen.events.restart->at;
    first_fix_.reset();
  }
  if (seen.fix.solved() && !first_fix_) first_fix_ = seen.time;
  raw_ = observations_.next(seen);
  return {seen,
          round_to(seen.reported_time(), kMillisecond),
          first_fix_.has_value(),
          first_fix_ ? *first_fix_ - start_ : 0,
          seen.time - start_,
          raw_,
          channels_,
          epoch.geoid_undulation_m};
}

canyon::rtcm::CorrectionsDecoder& DeviceEpochs::decoder_of(std::uint64_t reader) {
  return decoders_.of(reader, [this](gnss::SatelliteId id) -> std::optional<int> {
    const auto found = channels_.find(id);
    return found == channels_.end() ? std::nullopt : std::optional(found->second);
  });
}

void DeviceEpochs::receive(std::uint64_t reader, std::string_view bytes) {
  for (auto& epoch : decoder_of(reader).feed(bytes, clock_)) corrections_.push_back(std::move(epoch));
}

std::vector<std::shared_ptr<const rtk::Corrections>> DeviceEpochs::take_corrections() {
  return std::exchange(corrections_, {});
}

std::optional<double> clock_sigma_m(const positioning::Fix& fix) {
  if (!fix.dop || !(fix.dop->pdop > 0)) return std::nullopt;
  return std::sqrt(fix.covariance_enu.trace()) / fix.dop->pdop * fix.dop->tdop;
}

using geodesy::GpsTime;

std::vector<broadcast::SentMessage> ReceivedMessages::received(const simulation::Epoch& epoch) {
  constexpr double kMaxGap_s = 60;
  std::map<gnss::SatelliteId, Tracked> tracked;
  std::vector<broadcast::SentMessage> messages;
  for (const receiver::SatelliteObservation& s : epoch.observed.satellites) {
    if (!s.measurement) continue;
    const GpsTime sent = epoch.observed.receiver_time - s.measurement->pseudorange_m / geodesy::kSpeedOfLight;
    const auto before = tracked_.find(s.id);
    // A jump of the clock, or a restarted host.
    const bool goes_on =
        before != tracked_.end() && sent > before->second.last && sent - before->second.last < kMaxGap_s;
    const Tracked now{goes_on ? before->second.since : sent, sent};
    tracked[s.id] = now;
    if (!goes_on || epoch.navigation == nullptr) continue;
    for (broadcast::SentMessage& message :
         broadcast::sent_messages(*epoch.navigation, s.id, before->second.last, sent))
      if (message.start >= now.since) messages.push_back(std::move(message));
  }
  tracked_ = std::move(tracked);
  return messages;
}

}  // namespace canyon::encoding
