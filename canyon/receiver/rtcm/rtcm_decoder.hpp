#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/rtcm/frames.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::rtcm {

// Pseudoranges of messages without whole light milliseconds (RTCM 10403.3, 3.5.16.3: MSM1 to MSM3; table
// 3.5-1: 1001, 1003, 1009, 1011).

/// A pseudorange without the clock of the receiver [m]: the distance from a satellite to a position minus the
/// satellite's clock. Within 1 km of the measured one. Empty if the satellite is unknown then.
/// @param position of the station, ECEF [m]; zeros if it has not reported it
using RangeTable = std::function<std::optional<double>(gnss::SatelliteId, geodesy::GpsTime reception,
                                                       const Eigen::Vector3d& position)>;
/// By the ephemerides of a sky. @param fallback a position within 50 km of a station that reports none [m]
[[nodiscard]] RangeTable range_table(std::shared_ptr<const orbit::Sky> sky,
                                     const Eigen::Vector3d& fallback = Eigen::Vector3d::Zero());

/// A pseudorange modulo a length.
struct PartialRange {
  double modulo_m = 0;     ///< [0, unit)
  double unit_m = 0;       ///< one or two light milliseconds
  double predicted_m = 0;  ///< by a RangeTable
};

/// The whole units to add to each range [m]. All satellites of an epoch have the receiver's clock in common,
/// which is assumed to be within half a millisecond. Empty for a satellite that contradicts the majority's
/// clock by more than a twentieth of a millisecond (15 km), and for all if fewer than four, or less than two
/// thirds of them, agree on it: position or ephemerides are wrong then.
[[nodiscard]] std::vector<std::optional<double>> whole_milliseconds(const std::vector<PartialRange>& ranges);

struct DecoderStatus {
  std::map<int, std::uint64_t> messages;          ///< by number, with a right checksum
  std::map<int, std::uint64_t> messages_unread;   ///< the part of `messages` that the decoder does not read
  std::map<std::string, std::uint64_t> problems;  ///< one sentence each: ignored messages or fields
  /// Ignored observations, because no signal of gnss::signals_of() has their RINEX code: "G 2W".
  std::map<std::string, std::uint64_t> unknown_codes;
  /// Satellites with ignored observations, because their whole milliseconds were not found.
  std::set<gnss::SatelliteId> without_milliseconds;
  std::uint64_t checksum_errors = 0;    ///< frame-like sequences with a wrong checksum
  std::uint64_t bytes_passed_over = 0;  ///< outside frames
  std::uint64_t bytes_held = 0;         ///< of an incomplete frame
  std::uint64_t epochs = 0;             ///< delivered
  std::uint64_t epochs_held_back = 0;   ///< not delivered, because the station's position was not known yet
  std::optional<int> station;           ///< of the last message with a station, [0, 4095]
  std::optional<geodesy::GpsTime> last_epoch;  ///< of the last observations, also of undelivered ones

  /// Damage and omissions, one line each with its count.
  [[nodiscard]] std::vector<std::string> warnings() const;
};

/// Decodes RTCM 3 of a base, in pieces of any size, into epochs of corrections. Reads the messages
///   1005, 1006   position of the antenna reference point; the antenna's height of 1006 is relative to
///                a marker and not included
///   1007, 1008, 1033   names of antenna and receiver
///   1230         GLONASS code-phase biases, which are added to the phases; phases restart if they change
///   1020         GLONASS frequency channels
///   1001 to 1004, 1009 to 1012   observations of GPS and GLONASS, of L1, of L1 and L2
///   1071, 1073 to 1077, 1081, 1083 to 1087, ..., 1121, 1123 to 1127   MSM1 and MSM3 to MSM7 of GPS, GLONASS,
///   Galileo, SBAS, QZSS, BeiDou
/// and counts all others; MSM2 has no pseudoranges. MSM1, MSM3, 1001, 1003, 1009 and 1011 omit the whole
/// milliseconds of pseudoranges: a RangeTable completes them, else they are counted and ignored. If the
/// station of the observations reports no position, names or biases, those of a station without observations
/// are used: some bases and casters number these messages differently. For any input it throws nothing and
/// its memory is bounded.
///
/// Measurements have the default standard deviations: RTCM has none. Of a satellite's codes for one signal
/// the best one is used, in the order of rinex::signal_codes(). Measurement::phase_since is later than at the
/// previous epoch if the lock time fell, or is shorter than the time between the two epochs; with MSM4 and
/// MSM5, whose lock times are coarse, also if that is uncertain.
class CorrectionsDecoder {
 public:
  using Epochs = std::vector<std::shared_ptr<const rtk::Corrections>>;
  /// Frequency channel of a GLONASS satellite, [-7, 6].
  using ChannelTable = std::function<std::optional<int>(gnss::SatelliteId)>;

  /// @param glonass_channel called if none of MSM5, MSM7, 1012 and 1020 has given the channel. Without a
  /// channel, phase and Doppler are ignored, and the carrier frequency is that of channel 0.
  /// @param needs_position false: a rover's stream, whose epochs without 1005 or 1006 have zeros as position
  /// @param ranges completes pseudoranges without whole milliseconds
  explicit CorrectionsDecoder(ChannelTable glonass_channel = {}, bool needs_position = true,
                              RangeTable ranges = {});

  /// Epochs completed by these bytes, in order. An epoch is complete at its last message (DF393, DF005), or
  /// at a message of another time. If more of an epoch comes after its last message, the whole epoch is
  /// delivered again.
  /// @param now any time within half a week of the messages (half a day if GLONASS does not give the day)
  [[nodiscard]] Epochs feed(std::string_view bytes, geodesy::GpsTime now);
  /// The pending epoch without its last message, if any.
  [[nodiscard]] Epochs finish();

  [[nodiscard]] const DecoderStatus& status() const { return status_; }

 private:
  class Fields;
  /// The signal of a code, and the code's rank among all codes of that signal.
  struct Reading {
    const gnss::Signal* signal = nullptr;
    int rank = 0;
  };
  [[nodiscard]] static Reading reading_of(gnss::System system, std::string_view code);
  /// The range of lock times of an indicator, from the first to below the second [ms].
  struct LockTime {
    double least_ms = 0, end_ms = 0;
  };
  /// Ranges of indicators of MSM4 and MSM5, or MSM6 and MSM7 (extended), and of 1001 to 1012.
  [[nodiscard]] static LockTime msm_lock(int indicator, bool extended);
  [[nodiscard]] static LockTime legacy_lock(int indicator);
  /// A cell: one satellite's signal.
  struct Observation {
    gnss::SatelliteId id;
    std::string_view code;  ///< RINEX
    Reading reading;
    double range_m = 0;
    std::optional<double> phase_range_m, rate_mps, cn0_dbhz;
    /// 1004, 1012: phase_range_m jumps by 1,500 cycles when it is too far from the range.
    bool rotations = false;
    LockTime lock;
    bool half_cycle = false;
    double unit_m = 0;  ///< the ranges are modulo this; 0: they are complete
  };
  using SignalKey = std::pair<gnss::SatelliteId, std::size_t>;  ///< index_of() the signal
  /// The contents of messages without observations.
  struct Station {
    std::optional<Eigen::Vector3d> antenna_position_ecef;
    std::string antenna_name, receiver_name;
    std::optional<rtk::GlonassBiases> glonass_bias_m;
    bool observes = false;
  };
  struct Epoch {
    geodesy::GpsTime time;
    std::map<SignalKey, rtk::SignalMeasurement> observations;
    std::vector<Observation> partial;  ///< without whole milliseconds
    bool news = false;                 ///< since its last delivery
  };
  struct Arc {
    geodesy::GpsTime at;     ///< of its last phase
    double least_ms = 0;     ///< lock time
    std::string_view code;   ///< RINEX
    geodesy::GpsTime since;  ///< Measurement::phase_since
    double ahead_cycles =
        0;  ///< 1004, 1012: phase minus pseudorange, as sent, plus the jumps by 1,500 cycles
  };

  void read(const broadcast::Bits& message, geodesy::GpsTime now, Epochs& complete);
  void read_station_position(Fields& fields);
  void read_names(Fields& fields);
  void read_biases(Fields& fields);
  void read_msm(Fields& fields, geodesy::GpsTime now, Epochs& complete);
  void read_legacy(Fields& fields, geodesy::GpsTime now, Epochs& complete);
  void add(const Observation& observation);
  void complete_milliseconds(const Eigen::Vector3d& point);
  void problem(const Fields& fields, std::string_view what);
  Station& station(int id);
  void observe(int id);
  template <typename Has>
  [[nodiscard]] const Station* describing(Has has) const;
  [[nodiscard]] const rtk::GlonassBiases& glonass_bias_m() const;
  void begin(geodesy::GpsTime time, Epochs& complete);
  void deliver(Epochs& complete);
  [[nodiscard]] std::optional<int> channel(gnss::SatelliteId id) const;

  ChannelTable glonass_channel_;
  RangeTable ranges_;
  FrameParser frames_;
  DecoderStatus status_;
  std::map<int, Station> stations_;
  int observing_ = -1;  ///< station of the last observations
  bool needs_position_;
  std::map<gnss::SatelliteId, int> channels_;
  std::map<SignalKey, Arc> arcs_;
  std::optional<Epoch> epoch_;
};

}  // namespace canyon::rtcm
