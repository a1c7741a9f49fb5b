#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/transport/link.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/rtcm/rtcm_decoder.hpp"
#include "canyon/simulation/epoch.hpp"
#include "canyon/sky/broadcast/schedule.hpp"

namespace canyon::encoding {

/// Tracks the continuity of one receiver's carrier phases from epoch to epoch.
class PhaseArcs {
 public:
  /// The relation of a phase to the satellite's earlier phases.
  struct Link {
    /// Cycle slip: the phase is not continuous with the satellite's previous phase. False for the satellite's
    /// first phase.
    bool slip = false;
    bool begins = false;  ///< first phase of an arc
    /// Whole cycles that bring the arc's first phase nearest to its pseudorange over the wavelength; constant
    /// along the arc.
    double alignment_cycles = 0;
  };

  /// Link of a measurement that has a phase and the instant since which the phase is continuous; else empty.
  /// Call it with a satellite's measurements in order of time.
  /// @param signal its index_of(): each signal of a satellite has its own arcs
  std::optional<Link> next(const positioning::Measurement& measurement, std::size_t signal = 0) {
    if (!measurement.carrier_phase_cycles || !measurement.phase_since) return std::nullopt;
    const auto [at, first] = arcs_.try_emplace({measurement.id, signal});
    Arc& arc = at->second;
    const bool begins = first || arc.since != *measurement.phase_since;
    if (begins) {
      const double range_cycles =
          measurement.pseudorange_m * measurement.carrier_frequency_hz / geodesy::kSpeedOfLight;
      arc = {*measurement.phase_since, std::round(range_cycles - *measurement.carrier_phase_cycles)};
    }
    return Link{begins && !first, begins, arc.alignment_cycles};
  }

 private:
  struct Arc {
    geodesy::GpsTime since;
    double alignment_cycles = 0;
  };
  std::map<std::pair<gnss::SatelliteId, std::size_t>, Arc> arcs_;
};

/// Decimals of RINEX time tags.
inline constexpr std::int64_t kTagStep_ns = 100;

/// How an epoch's time tag follows the receiver's clock.
enum class Tags {
  /// The clock's reading; the format rounds it. The observations include the clock's full bias and drift. A
  /// rounding of 50 ns moves a satellite by 0.2 mm only; if ranges followed the rounding, they would jump by
  /// 30 m, unlike the Doppler.
  ClockReading,
  /// The nearest whole millisecond of the clock's reading. Range, phase and Doppler are referred to it, as in
  /// receivers with a steered clock: they contain neither the bias's fraction of a millisecond nor the drift
  /// (RINEX 3.04, table 1).
  WholeMilliseconds,
};

/// One signal's observables, as in observation files, for the epoch's tag.
struct RawObservation {
  gnss::SatelliteId id;
  const gnss::Signal* signal = nullptr;                   ///< of gnss::signals_of()
  const positioning::Measurement* measurement = nullptr;  ///< points into the epoch
  double pseudorange_m = 0;
  /// Arcs begin within half a cycle of the pseudorange over the wavelength, as in receivers, and never at 0,
  /// which readers treat as a missing value.
  std::optional<double> carrier_phase_cycles = std::nullopt;
  std::optional<double> doppler_hz = std::nullopt;  ///< the negative rate of the phase
  bool slip = false;                                ///< not continuous with the signal's previous phase
  double locked_s = 0;                              ///< since the first phase of its arc
};

struct RawEpoch {
  geodesy::GpsTime tag;                      ///< of the receiver's clock, by the rule of Tags
  std::vector<RawObservation> observations;  ///< by satellite, then in the order of gnss::signals_of()
};

/// Measurements of one receiver, epoch by epoch. With each rule of Tags the rate of a phase is the negative
/// Doppler.
class RawObservations {
 public:
  explicit RawObservations(Tags tags) : tags_(tags) {}
  [[nodiscard]] RawEpoch next(const receiver::ReceiverEpoch& seen);

 private:
  Tags tags_;
  PhaseArcs arcs_;
  std::map<std::pair<gnss::SatelliteId, std::size_t>, geodesy::GpsTime>
      lock_start_;  ///< start of each signal's arc
};

/// The indicator of signal strength (RINEX 3.04, 5.7 and table 12): min(max(int(C/N0 / 6), 1), 9).
[[nodiscard]] int signal_strength_indicator(double cn0_dbhz);

/// The complete navigation messages that a receiver has received, epoch by epoch.
class ReceivedMessages {
 public:
  /// Messages that ended since the previous epoch, of satellites tracked without interruption.
  std::vector<broadcast::SentMessage> received(const simulation::Epoch& epoch);

 private:
  struct Tracked {
    geodesy::GpsTime since, last;  ///< times of transmission
  };
  std::map<gnss::SatelliteId, Tracked> tracked_;
};

/// An epoch as output by a receiver on a line, for all protocols. Refers to the epoch and its DeviceEpochs.
struct DeviceEpoch {
  const receiver::ReceiverEpoch& seen;
  geodesy::GpsTime reported_time;  ///< time reported by the receiver, to the nearest millisecond
  bool time_known = false;         ///< there was a fix since the start
  double first_fix_s = 0;          ///< from the start to the first fix; 0 until there was one
  double uptime_s = 0;             ///< since the start
  const RawEpoch& raw;
  const std::map<gnss::SatelliteId, int>& glonass_channels;
  double geoid_undulation_m = 0;  ///< at the position of the fix
};

/// State of a receiver on a line, for all protocols: its start, its first fix, arcs of its carrier phases,
/// received navigation messages and corrections.
class DeviceEpochs {
 public:
  /// @param begin of the run, when the receiver starts
  DeviceEpochs(std::map<gnss::SatelliteId, int> glonass_channels, geodesy::GpsTime begin, Tags tags);
  DeviceEpochs(const DeviceEpochs&) = delete;
  DeviceEpochs& operator=(const DeviceEpochs&) = delete;

  /// @param epoch in order of time; must outlive the result, which is valid until the next call
  [[nodiscard]] DeviceEpoch next(const simulation::Epoch& epoch);
  /// Navigation messages that ended since the previous epoch.
  [[nodiscard]] std::vector<broadcast::SentMessage> received_messages(const simulation::Epoch& epoch) {
    return messages_.received(epoch);
  }

  /// Takes bytes with RTCM 3 among others, cut anywhere, from one of several senders.
  void receive(std::uint64_t reader, std::string_view bytes);
  /// Epochs of a base in these bytes since the last call.
  [[nodiscard]] std::vector<std::shared_ptr<const rtk::Corrections>> take_corrections();
  [[nodiscard]] const canyon::rtcm::DecoderStatus& corrections_status(std::uint64_t reader) {
    return decoder_of(reader).status();
  }

  [[nodiscard]] const std::map<gnss::SatelliteId, int>& glonass_channels() const { return channels_; }
  /// The start of the run, or of the latest restart.
  [[nodiscard]] geodesy::GpsTime start() const { return start_; }

 private:
  [[nodiscard]] canyon::rtcm::CorrectionsDecoder& decoder_of(std::uint64_t reader);

  std::map<gnss::SatelliteId, int> channels_;
  transport::Readers<canyon::rtcm::CorrectionsDecoder> decoders_;
  std::vector<std::shared_ptr<const rtk::Corrections>> corrections_;
  geodesy::GpsTime start_;
  geodesy::GpsTime clock_;  ///< of the latest epoch, by the receiver's clock
  std::optional<geodesy::GpsTime> first_fix_;
  ReceivedMessages messages_;
  RawObservations observations_;
  RawEpoch raw_;  ///< of the latest epoch
};

/// Standard deviation of a fix's clock [m]. Clocks have no covariance, so it is TDOP times the ratio of
/// position error to position dilution. Empty without a dilution.
[[nodiscard]] std::optional<double> clock_sigma_m(const positioning::Fix& fix);

}  // namespace canyon::encoding
