// Declared in canyon/output/formats.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/formats.hpp"
#include "canyon/output/number.hpp"
#include "canyon/output/observations/raw_observations.hpp"
#include "canyon/rinex/android_log.hpp"

// Text log of Android's GnssLogger: columns of its LOGGING_FORMAT.md (version 3), values as the documentation
// of android.location's GnssMeasurement and GnssClock defines them. rinex::read_android_observations() reads
// it back.

namespace canyon::output {
namespace {

using geodesy::GpsTime;
using gnss::System;
namespace android = rinex::android;

constexpr std::string_view kLogHeader =
    "# \n# Header Description:\n# \n"
    "# Version: v3.0.6.4 Platform: 14 Manufacturer: Canyon Model: emulated receiver\n# \n"
    "# Raw,utcTimeMillis,TimeNanos,LeapSecond,TimeUncertaintyNanos,FullBiasNanos,BiasNanos,"
    "BiasUncertaintyNanos,DriftNanosPerSecond,DriftUncertaintyNanosPerSecond,HardwareClockDiscontinuityCount,"
    "Svid,TimeOffsetNanos,State,ReceivedSvTimeNanos,ReceivedSvTimeUncertaintyNanos,Cn0DbHz,"
    "PseudorangeRateMetersPerSecond,PseudorangeRateUncertaintyMetersPerSecond,AccumulatedDeltaRangeState,"
    "AccumulatedDeltaRangeMeters,AccumulatedDeltaRangeUncertaintyMeters,CarrierFrequencyHz,CarrierCycles,"
    "CarrierPhase,CarrierPhaseUncertainty,MultipathIndicator,SnrInDb,ConstellationType,AgcDb,BasebandCn0DbHz,"
    "FullInterSignalBiasNanos,FullInterSignalBiasUncertaintyNanos,SatelliteInterSignalBiasNanos,"
    "SatelliteInterSignalBiasUncertaintyNanos,CodeType,ChipsetElapsedRealtimeNanos\n# \n"
    "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,BearingDegrees,"
    "UnixTimeMillis,SpeedAccuracyMps,BearingAccuracyDegrees,elapsedRealtimeNanos,VerticalAccuracyMeters,"
    "MockLocation\n# \n";

constexpr std::int64_t kSecond_ns = GpsTime::kNanosecondsPerSecond;
/// The phone was switched on so long before the first epoch.
constexpr std::int64_t kUptime_ns = 100 * kSecond_ns;

int constellation_of(System system) {
  constexpr std::array kNumbers{android::kGps,    android::kGlonass, android::kGalileo,
                                android::kBeiDou, android::kQzss,    android::kSbas};
  return kNumbers.at(static_cast<std::size_t>(system));
}

/// State bits of a signal that is tracked and whose satellite's time is decoded.
std::uint32_t state_of(const gnss::Signal& signal) {
  constexpr std::uint32_t kWeekKnown = android::kCodeLock | android::kBitSync | android::kSubframeSync |
                                       android::kTowDecoded | android::kTowKnown | android::kSymbolSync;
  switch (signal.system) {
    case System::GLONASS:
      return android::kCodeLock | android::kBitSync | android::kSymbolSync | android::kGlonassStringSync |
             android::kGlonassTimeOfDayDecoded | android::kGlonassTimeOfDayKnown;
    case System::Galileo:
      if (signal.code.front() != '1') return kWeekKnown | android::kSecondaryCodeLock;
      return kWeekKnown | android::kE1CodeLock | android::kE1SecondaryCodeLock | android::kE1PageSync;
    default:
      return kWeekKnown;
  }
}

/// Time of a system's week or day, as its satellites send it [ns].
std::int64_t satellite_time_ns(System system, GpsTime sent) {
  std::int64_t t = sent.nanoseconds();
  std::int64_t span = GpsTime::kNanosecondsPerWeek;
  if (system == System::BeiDou) t -= geodesy::kBdtSecondsOffset * kSecond_ns;
  if (system == System::GLONASS) {
    span = 86'400 * kSecond_ns;
    t += (3 * 3600 - geodesy::leap_seconds(sent)) * kSecond_ns;
  }
  return (t % span + span) % span;
}

class GnssLog final : public Encoder {
 public:
  std::string begin() override { return std::string(kLogHeader); }

  std::string encode(const simulation::Epoch& epoch) override {
    const receiver::ReceiverEpoch& seen = epoch.observed;
    const RawEpoch raw = observations_.next(seen);
    if (!boot_ns_) boot_ns_ = raw.tag.nanoseconds() - kUptime_ns;
    if (seen.events.restart && restart_ != seen.events.restart->at) {
      restart_ = seen.events.restart->at;
      ++discontinuities_;
    }
    const std::int64_t time_ns = raw.tag.nanoseconds() - *boot_ns_;
    const std::int64_t unix_ms = geodesy::unix_from_gps(seen.stated_utc()) / 1'000'000;
    const std::string clock = clock_fields(seen, unix_ms, time_ns);
    std::string text;
    for (const RawObservation& o : raw.observations) {
      if (o.id.system != System::SBAS) text += raw_line(clock, seen, raw.tag, time_ns, o);
    }
    if (seen.fix.solved()) text += fix_line(seen.fix, unix_ms, time_ns);
    return text;
  }

 private:
  /// The fields from utcTimeMillis to HardwareClockDiscontinuityCount. GPS time is TimeNanos - (FullBiasNanos
  /// + BiasNanos), as the receiver states it: a phone's solution for its clock, here without error.
  [[nodiscard]] std::string clock_fields(const receiver::ReceiverEpoch& seen, std::int64_t unix_ms,
                                         std::int64_t time_ns) const {
    const double bias_ns = 1e9 * seen.clock_bias_s;
    const double whole_ns = std::floor(bias_ns);
    const std::int64_t dated_ns = seen.stated_time().nanoseconds() - seen.time.nanoseconds();
    return fmt::format("{},{},{},,{},{},1.0,{},,{}", unix_ms, time_ns, geodesy::leap_seconds(seen.time),
                       static_cast<std::int64_t>(whole_ns) - *boot_ns_ - dated_ns,
                       fixed(bias_ns - whole_ns, 6), fixed(1e9 * seen.clock_drift, 6), discontinuities_);
  }

  [[nodiscard]] static std::string raw_line(const std::string& clock, const receiver::ReceiverEpoch& seen,
                                            GpsTime tag, std::int64_t time_ns, const RawObservation& o) {
    const positioning::Measurement& m = *o.measurement;
    constexpr double kNanosecond_m = 1e-9 * geodesy::kSpeedOfLight;
    const double wavelength_m = geodesy::kSpeedOfLight / m.carrier_frequency_hz;
    const GpsTime sent = tag - std::chrono::nanoseconds(std::llround(o.pseudorange_m / kNanosecond_m));
    const double sigma_ns = std::max(1.0, std::ceil(m.sigma_m / kNanosecond_m));
    std::string rate, rate_sigma;
    if (o.doppler_hz) {
      rate = fixed(-*o.doppler_hz * wavelength_m, 6);
      rate_sigma = fixed(m.doppler_sigma_hz * wavelength_m, 6);
    }
    std::uint32_t state = 0;
    std::string range = "0.0", range_sigma = "0.0";
    if (o.carrier_phase_cycles) {
      // Counted from lock, as phones do; RINEX's begins near the pseudorange.
      range = fixed(*m.carrier_phase_cycles * wavelength_m, 6);
      range_sigma = fixed(m.carrier_phase_sigma_cycles * wavelength_m, 6);
      state = android::kValid | android::kHalfCycleReported;
      if (!m.half_cycle) state |= android::kHalfCycleResolved;
      if (o.slip || o.locked_s == 0) state |= android::kReset;
    }
    std::string agc;
    for (const receiver::BandState& band : seen.bands) {
      if (band.carrier_hz == o.signal->carrier_hz) agc = fixed(20 * std::log10(band.agc()), 2);
    }
    const int svid = o.id.number + (o.id.system == System::QZSS ? android::kQzssOffset : 0);
    return fmt::format("Raw,{},{},0.0,{},{},{},{},{},{},{},{},{},{},,,,0,,{},{},,,,,,{},{}\n", clock, svid,
                       state_of(*o.signal), satellite_time_ns(o.id.system, sent), sigma_ns,
                       m.cn0_dbhz ? fixed(*m.cn0_dbhz, 3) : "", rate, rate_sigma, state, range, range_sigma,
                       fixed(m.carrier_frequency_hz, 0), constellation_of(o.id.system), agc,
                       o.signal->code.substr(1), time_ns);
  }

  /// AccuracyMeters is the radius of 68 %, which a circle of the root of both variances holds at least.
  [[nodiscard]] static std::string fix_line(const positioning::Fix& fix, std::int64_t unix_ms,
                                            std::int64_t time_ns) {
    const Eigen::Matrix3d& c = fix.covariance_enu;
    std::string speed, bearing, speed_sigma;
    if (fix.velocity_enu_mps) {
      const Eigen::Vector3d& v = *fix.velocity_enu_mps;
      speed = fixed(std::hypot(v.x(), v.y()), 4);
      bearing = fixed(std::fmod(geodesy::degrees(std::atan2(v.x(), v.y())) + 360, 360), 3);
    }
    if (fix.velocity_covariance_enu) {
      const Eigen::Matrix3d& v = *fix.velocity_covariance_enu;
      speed_sigma = fixed(std::sqrt(v(0, 0) + v(1, 1)), 4);
    }
    return fmt::format("Fix,GPS,{},{},{},{},{},{},{},{},,{},{},0\n",
                       fixed(geodesy::degrees(fix.position.latitude_rad), 9),
                       fixed(geodesy::degrees(fix.position.longitude_rad), 9),
                       fixed(fix.position.height_m, 4), speed, fixed(std::sqrt(c(0, 0) + c(1, 1)), 3),
                       bearing, unix_ms, speed_sigma, time_ns, fixed(std::sqrt(c(2, 2)), 3));
  }

  RawObservations observations_{Tags::ClockReading};
  std::optional<std::int64_t> boot_ns_;  ///< of the receiver's clock when TimeNanos was 0
  std::optional<GpsTime> restart_;       ///< the last one
  int discontinuities_ = 0;
};

}  // namespace

std::unique_ptr<Encoder> encode_gnsslogger(const ReceiverDescription& /*receiver*/) {
  return std::make_unique<GnssLog>();
}

}  // namespace canyon::output
