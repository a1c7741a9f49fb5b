#include "canyon/receiver/channel_bank.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

namespace canyon::receiver {

double EphemerisAcquisition::search_s(gnss::SatelliteId id) const {
  if (restart_.search_s) return *restart_.search_s;
  if (restart_.kind != disturbance::RestartKind::Cold) return lock_.reacquisition_s;
  const double uniform = RandomStream(seed_, fmt::format("{}/{}/search/{}", stream_name_, gnss::to_string(id),
                                                         restart_.at.nanoseconds()))
                             .uniform();
  const double cold_s = lock_.cold_acquisition_s;
  if (has_network_aid()) return (0.8 + 0.8 * uniform) * cold_s;
  return (0.4 + 1.85 * uniform) * std::max(1.0, cold_s - 20);
}

using propagation::Visibility;

namespace {

bool in_line_of_sight(Visibility visibility) {
  return visibility == Visibility::LOS || visibility == Visibility::LOSMultipath;
}

}  // namespace

ChannelBank::ChannelBank(const ReceiverOptions& options, std::uint64_t seed, std::string stream_name)
    : options_(options), seed_(seed), stream_name_(std::move(stream_name)) {
  for (const gnss::System system : gnss::kAllSystems)
    tracks_[static_cast<std::size_t>(system)] = receiver::tracked_signals(options.tracks, system);
  if (options.signal.enabled) signals_.emplace(options.signal, seed, options.name, stream_name_);
}

void ChannelBank::restart(const disturbance::Restart& restart) {
  known_.emplace(restart, options_.signal.lock, signals_.has_value(), seed_, stream_name_);
  channels_.clear();
  if (!signals_) return;
  tracking::SignalOptions searching = options_.signal;
  searching.lock.warm_start = false;
  signals_.emplace(std::move(searching), seed_, options_.name, stream_name_);
}

std::span<const tracking::ReceivedWave> ChannelBank::receive(
    std::span<const propagation::Interference> waves) {
  if (signals_) signals_->receive(waves, received_waves_);
  return received_waves_;
}

std::vector<BandState> ChannelBank::bands(std::span<const tracking::ReceivedWave> waves) {
  std::map<double, BandState> by_carrier;
  if (!signals_) return {};
  for (const auto& system_entry : tracks_) {
    for (const gnss::Signal* signal : system_entry) {
      const auto load = signals_->front_end_load(*signal, waves);
      BandState& band =
          by_carrier.try_emplace(signal->carrier_hz, BandState{signal->carrier_hz}).first->second;
      if (load.interference <= band.interference_ratio) continue;
      band.interference_ratio = load.interference;
      band.tone_ratio = load.tones;
    }
  }
  std::vector<BandState> result;
  for (const auto& [carrier_hz, band] : by_carrier) result.push_back(band);
  return result;
}

tracking::Channel& ChannelBank::channel_of(const tracking::AntennaMotion& motion, gnss::SatelliteId id,
                                           const gnss::Signal& signal) {
  std::vector<tracking::Channel>& satellite_value = channels_[id];
  const auto found = std::find_if(satellite_value.begin(), satellite_value.end(),
                                  [&](const tracking::Channel& c) { return &c.signal() == &signal; });
  if (found != satellite_value.end()) return *found;
  satellite_value.reserve(tracks_[static_cast<std::size_t>(signal.system)].size());  // keeps pointers valid
  tracking::Channel& channel = satellite_value.emplace_back(*signals_, id, signal, motion);
  if (known_) channel.search_for(known_->search_s(id));
  return channel;
}

/// Processes one signal in its channel if signals have a strength; else returns empty. Sets the observation's
/// lock, C/N0 and excess. @param received whether a receiver without thresholds receives it
std::optional<TrackedChannel> ChannelBank::track(const tracking::AntennaMotion& motion,
                                                 const propagation::SatelliteView& view, bool free,
                                                 bool received, SignalObservation& observation) {
  if (!view.paths.paths.empty()) observation.tracked_path = view.paths.paths.front().kind;
  if (!signals_) {
    observation.direct = in_line_of_sight(view.paths.visibility);
    if (received) {
      observation.lock = tracking::LockState::Tracking;
      observation.excess_m = view.paths.tracked_excess_m();
    }
    return std::nullopt;
  }
  tracking::Channel& channel = channel_of(motion, view.line.id, *observation.signal);
  TrackedChannel tracked{&channel, {}};
  tracked.reception = free ? channel.receive(*signals_, motion, view) : channel.receive_nothing(motion.time);
  observation.lock = tracked.reception.lock;
  observation.cn0_dbhz = tracked.reception.cn0_dbhz;
  if (free && !view.paths.paths.empty()) {
    observation.tracked_path = view.paths.paths[tracked.reception.tracked].kind;
    observation.direct = observation.tracked_path == propagation::PathKind::Direct &&
                         *tracked.reception.direct_cn0_dbhz >= options_.signal.lock.tracking_threshold_dbhz;
  }
  if (observation.lock == tracking::LockState::Tracking)
    observation.excess_m = tracked.reception.code_delay_m;
  return tracked;
}

/// The visibility of a satellite by the strength of its signals, independent of acquisition.
Visibility ChannelBank::visibility_of(const SatelliteObservation& satellite) const {
  if (!signals_) return satellite.map_visibility;
  bool strong = false, direct = false;
  satellite.for_each_signal([&](const SignalObservation& signal) {
    strong = strong || (signal.cn0_dbhz && *signal.cn0_dbhz >= options_.signal.lock.tracking_threshold_dbhz);
    direct = direct || signal.direct;
  });
  if (direct) return satellite.map_visibility;
  return strong ? Visibility::NLOS : Visibility::Blocked;
}

TrackingResult ChannelBank::follow(const tracking::AntennaMotion& motion, const propagation::Arrival& arrival,
                                   ReceiverEpoch& epoch) {
  const bool free = arrival.containment == raytrace::Containment::Free;
  TrackingResult followed;
  epoch.satellites.reserve(arrival.views.size());
  followed.satellites.reserve(arrival.views.size());
  followed.channels.reserve(arrival.views.size());
  for (const propagation::SatelliteView& view : arrival.views) {
    wanted_ = tracks_[static_cast<std::size_t>(view.line.id.system)];
    leave_out(options_, view.line.id, motion.time, wanted_);
    if (wanted_.empty()) continue;
    SatelliteObservation& seen = epoch.satellites.emplace_back();
    seen.id = view.line.id;
    seen.azimuth_rad = view.line.azimuth_rad;
    seen.elevation_rad = view.line.elevation_rad;
    seen.above_mask =
        view.shown_elevation_rad.value_or(view.line.elevation_rad) >= options_.fix.elevation_mask_rad;
    if (free) seen.map_visibility = view.paths.visibility;
    const bool received = seen.map_visibility != Visibility::Blocked;
    if (in_line_of_sight(seen.map_visibility))
      seen.obstacles_db = -20 * std::log10(view.paths.paths.front().amplitude_factor);
    followed.satellites.push_back({&view, followed.channels.size()});
    seen.signal = wanted_.front();
    for (std::size_t k = 1; k < wanted_.size(); ++k) seen.more.emplace_back().signal = wanted_[k];
    seen.for_each_signal([&](SignalObservation& signal) {
      followed.channels.push_back(track(motion, view, free, received, signal));
    });
    seen.visibility = visibility_of(seen);
    if (!seen.above_mask) continue;
    ++(seen.lock == tracking::LockState::Tracking ? epoch.visible : epoch.blocked);
    if (in_line_of_sight(seen.visibility)) ++followed.los;
  }
  return followed;
}

void ChannelBank::drop_channels_except(const std::vector<SatelliteObservation>& satellites,
                                       geodesy::GpsTime now) {
  auto seen = satellites.begin();
  for (auto& [id, satellite_value] : channels_) {
    while (seen != satellites.end() && seen->id < id) ++seen;
    if (seen != satellites.end() && seen->id == id) continue;
    for (tracking::Channel& channel : satellite_value) channel.receive_nothing(now);
  }
}

tracking::LoopErrors ChannelBank::sample(const TrackedChannel& tracked, geodesy::GpsTime now) {
  return tracked.channel->sample(*signals_, now, *tracked.reception.cn0_dbhz);
}

bool ChannelBank::read_ephemeris(const SatelliteObservation& satellite, geodesy::GpsTime now) {
  if (!known_) return true;
  const bool readable =
      satellite.lock == tracking::LockState::Tracking &&
      (!satellite.cn0_dbhz || *satellite.cn0_dbhz >= options_.signal.lock.acquisition_threshold_dbhz);
  return known_->read(satellite.id, *satellite.signal, readable, now);
}

}  // namespace canyon::receiver
