#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/observations/raw_observations.hpp"

// RINEX, The Receiver Independent Exchange Format, versions 3.04 (IGS/RTCM, 2018) and 4.00 (2021): header
// records table A2, epochs table A3. For the signals of gnss::signals_of() they differ in the header
// alone: 4.00 strongly deprecates SYS / PHASE SHIFT and GLONASS COD/PHS/BIS, which 3.04 requires.

namespace canyon::encoding {
namespace {

/// "C1C", and so on: pseudorange and Doppler of each signal; with `strength` also carrier phase and strength.
std::vector<std::string> observation_codes(const std::vector<const gnss::Signal*>& signals, bool strength) {
  std::vector<std::string> codes;
  for (const gnss::Signal* signal : signals)
    for (const char kind : std::string_view(strength ? "CLDS" : "CD"))
      codes.push_back(kind + std::string(signal->code));
  return codes;
}

std::string header_line(std::string_view content, std::string_view label) {
  std::string text(content.substr(0, 60));
  text.append(60 - text.size(), ' ');
  text += label;
  text.append(80 - text.size(), ' ');
  return text + '\n';
}

/// RINEX is ASCII: other bytes become '?'.
std::string ascii(std::string text) {
  for (char& c : text)
    if (c < 0x20 || c > 0x7E) c = '?';
  return text;
}

std::string time_record(geodesy::GpsTime t, std::string_view label) {
  const geodesy::CalendarTime c = geodesy::calendar_from_gps(t);
  return header_line(fmt::format("{:6d}{:6d}{:6d}{:6d}{:6d}{:5d}.{:07d}     GPS", c.year, c.month, c.day,
                                 c.hour, c.minute, c.second, c.nanosecond / kTagStep_ns),
                     label);
}

/// F14.3, loss-of-lock indicator (blank: no loss), signal strength indicator (blank: not known). 0.000 would
/// mean a missing observation (RINEX 3.04, table A3), so a measured 0 is written as the smallest step.
std::string observation(double value, bool lost_lock = false, char strength = ' ') {
  if (std::abs(value) < 0.0005) value = std::copysign(0.001, value);
  return fmt::format("{:14.3f}{}{}", value, lost_lock ? '1' : ' ', strength);
}
constexpr std::string_view kNoObservation = "                ";

enum class Version { V304, V400 };

class RinexObservation final : public Encoder {
 public:
  RinexObservation(ReceiverDescription receiver, Version version)
      : receiver_(std::move(receiver)), version_(version) {}

  std::string encode(const simulation::Epoch& epoch) override {
    if (!position_) position_ = epoch.truth_ecef;
    const RawEpoch raw = observations_.next(epoch.observed);
    if (raw.observations.empty()) return {};
    const geodesy::GpsTime tag = round_to(epoch.observed.reported(raw.tag), kTagStep_ns);
    std::string text = started_ ? std::string() : header(tag, epoch.observed.time);
    last_ = tag;
    std::map<gnss::SatelliteId, std::map<const gnss::Signal*, const RawObservation*>> satellites;
    for (const RawObservation& o : raw.observations) satellites[o.id][o.signal] = &o;
    const geodesy::CalendarTime c = geodesy::calendar_from_gps(tag);
    text += fmt::format("> {:04d} {:02d} {:02d} {:02d} {:02d} {:2d}.{:07d}  0{:3d}\n", c.year, c.month, c.day,
                        c.hour, c.minute, c.second, c.nanosecond / kTagStep_ns, satellites.size());
    for (const auto& [id, signals] : satellites) {
      text += gnss::to_string(id);
      for (const gnss::Signal* signal : signals_of(id.system)) {
        const auto found = signals.find(signal);
        if (found != signals.end())
          text += observations(*found->second);
        else
          for (int i = 0; i < (receiver_.signal.enabled ? 4 : 2); ++i) text += kNoObservation;
      }
      text.erase(text.find_last_not_of(' ') + 1);
      text += '\n';
    }
    return text;
  }

  void end(const Put& put) override {
    if (!started_) put(header(receiver_.begin, receiver_.begin));
  }
  std::optional<Correction> correction() override {
    return Correction{last_position_, time_record(last_, "TIME OF LAST OBS")};
  }

 private:
  [[nodiscard]] std::vector<const gnss::Signal*> signals_of(gnss::System system) const {
    return receiver::tracked_signals(receiver_.tracks, system);
  }

  /// The observations in the order of observation_codes().
  [[nodiscard]] std::string observations(const RawObservation& o) const {
    const positioning::Measurement& m = *o.measurement;
    const std::string doppler = o.doppler_hz ? observation(*o.doppler_hz) : std::string(kNoObservation);
    if (!receiver_.signal.enabled) return observation(o.pseudorange_m) + doppler;
    const char strength = m.cn0_dbhz ? static_cast<char>('0' + signal_strength_indicator(*m.cn0_dbhz)) : ' ';
    std::string text = observation(o.pseudorange_m, false, strength);
    text += o.carrier_phase_cycles ? observation(*o.carrier_phase_cycles, o.slip, strength)
                                   : std::string(kNoObservation);
    text += doppler;
    text += m.cn0_dbhz ? observation(*m.cn0_dbhz) : std::string(kNoObservation);
    return text;
  }

  /// @param first epoch by the receiver's clock @param day an instant of the day of the reported leap seconds
  std::string header(geodesy::GpsTime first, geodesy::GpsTime day) {
    started_ = true;
    last_ = first;
    std::string text;
    const auto line = [&](std::string_view content, std::string_view label) {
      text += header_line(content, label);
    };
    line(fmt::format("     {}           OBSERVATION DATA    M: MIXED",
                     version_ == Version::V304 ? "3.04" : "4.00"),
         "RINEX VERSION / TYPE");
    // The date stays empty so that equal runs give equal files.
    line("Canyon", "PGM / RUN BY / DATE");
    line("Simulated; no signal was received", "COMMENT");
    line(receiver_.errors.empty() ? "No atmosphere, orbit and clock errors are inside"
                                  : fmt::format("Inside: {}", fmt::join(receiver_.errors, ", ")),
         "COMMENT");
    line(ascii(receiver_.name), "MARKER NAME");
    line("NON_PHYSICAL", "MARKER TYPE");
    line("", "OBSERVER / AGENCY");
    line(fmt::format("{:<20}{:<20}{:<20}", "", "Canyon", ""), "REC # / TYPE / VERS");
    line("", "ANT # / TYPE");
    const Eigen::Vector3d p = position_.value_or(Eigen::Vector3d::Zero());
    line(fmt::format("{:14.4f}{:14.4f}{:14.4f}", p.x(), p.y(), p.z()), "APPROX POSITION XYZ");
    line(fmt::format("{:14.4f}{:14.4f}{:14.4f}", 0.0, 0.0, 0.0), "ANTENNA: DELTA H/E/N");
    for (const gnss::System system : receiver_.systems) {
      const std::vector<std::string> codes = observation_codes(signals_of(system), receiver_.signal.enabled);
      constexpr std::size_t kPerLine = 13;
      for (std::size_t i = 0; i < codes.size(); i += kPerLine) {
        std::string text_of =
            i == 0 ? fmt::format("{}  {:3d}", gnss::letter(system), codes.size()) : "      ";
        for (std::size_t k = i; k < std::min(i + kPerLine, codes.size()); ++k) text_of += " " + codes[k];
        line(text_of, "SYS / # / OBS TYPES");
      }
    }
    if (receiver_.signal.enabled) line("DBHZ", "SIGNAL STRENGTH UNIT");
    line(fmt::format("{:10.3f}", receiver_.interval_s), "INTERVAL");
    text += time_record(first, "TIME OF FIRST OBS");
    last_position_ = text.size();
    text += time_record(first, "TIME OF LAST OBS");  // overwritten at the end
    if (version_ == Version::V304) text += phase_shifts();
    if (receiver_.systems.count(gnss::System::GLONASS) > 0) {
      std::string slots = fmt::format("{:3d} ", receiver_.glonass_channels.size());
      for (const auto& [id, channel] : receiver_.glonass_channels) {
        if (slots.size() == 60) {  // the count and eight satellites
          line(slots, "GLONASS SLOT / FRQ #");
          slots = "    ";
        }
        slots += fmt::format("{} {:2d} ", gnss::to_string(id), channel);
      }
      line(slots, "GLONASS SLOT / FRQ #");
      std::string biases;
      for (const gnss::Signal* signal : signals_of(gnss::System::GLONASS))
        biases += fmt::format(" C{}    0.000", signal->code);
      if (version_ == Version::V304) line(biases, "GLONASS COD/PHS/BIS");
    }
    line(fmt::format("{:6d}", geodesy::leap_seconds(day)), "LEAP SECONDS");
    line("", "END OF HEADER");
    return text;
  }

  /// The shift that aligned each phase code with the others of its band (3.04, 9.1). Simulated phases need no
  /// shift; without phases it is unknown.
  [[nodiscard]] std::string phase_shifts() const {
    std::string text;
    for (const gnss::System system : receiver_.systems) {
      const char letter = gnss::letter(system);
      if (!receiver_.signal.enabled) text += header_line(fmt::format("{}", letter), "SYS / PHASE SHIFT");
      if (!receiver_.signal.enabled) continue;
      for (const gnss::Signal* signal : signals_of(system))
        text += header_line(fmt::format("{} L{}  0.00000", letter, signal->code), "SYS / PHASE SHIFT");
    }
    return text;
  }

  ReceiverDescription receiver_;
  Version version_;
  std::optional<Eigen::Vector3d> position_;
  RawObservations observations_{Tags::ClockReading};
  bool started_ = false;
  std::size_t last_position_ = 0;  ///< byte of the TIME OF LAST OBS record
  geodesy::GpsTime last_;
};

}  // namespace

std::unique_ptr<Encoder> encode_rinex_observation(const ReceiverDescription& receiver) {
  return std::make_unique<RinexObservation>(receiver, Version::V304);
}

std::unique_ptr<Encoder> encode_rinex4_observation(const ReceiverDescription& receiver) {
  return std::make_unique<RinexObservation>(receiver, Version::V400);
}

}  // namespace canyon::encoding
