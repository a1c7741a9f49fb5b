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
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/receiver/rtcm/frames.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::rtcm {

// Pseudoranges of messages that leave out whole milliseconds of light's way (RTCM 10403.3, 3.5.16.3: MSM1 to
// MSM3; table 3.5-1: 1001, 1003, 1009, 1011).

/// A pseudorange without the clock of the receiver [m]: the way from a satellite to a place less the
/// satellite's clock. Within 1 km of what is measured. Empty where the satellite is not known then.
/// @param place of the station, ECEF [m]; zeros where it has not stated it
using RangeTable = std::function<std::optional<double>(gnss::SatelliteId, geodesy::GpsTime reception,
                                                       const Eigen::Vector3d& place)>;
/// By the ephemerides of a sky. @param fallback a place within 50 km of a station that states none [m]
[[nodiscard]] RangeTable range_table(std::shared_ptr<const orbit::Sky> sky,
                                     const Eigen::Vector3d& fallback = Eigen::Vector3d::Zero());

/// A pseudorange modulo a length.
struct PartialRange {
  double modulo_m = 0;     ///< [0, unit)
  double unit_m = 0;       ///< one or two light milliseconds
  double predicted_m = 0;  ///< by a RangeTable
};

/// The whole units to add to each range [m]. All satellites of an epoch have the receiver's clock
/// in common, which is taken as within half a millisecond. Empty for a satellite that contradicts the clock
/// of most by more than a twentieth of a millisecond (15 km), and for all where fewer than four, or less
/// than two thirds of them, agree on it: place or ephemerides are wrong then.
[[nodiscard]] std::vector<std::optional<double>> whole_milliseconds(const std::vector<PartialRange>& ranges);

/// Counts of a decoder so far.
struct DecoderStatus {
  std::map<int, std::uint64_t> messages;          ///< by number, with a right checksum
  std::map<int, std::uint64_t> messages_unread;   ///< of these, those that the decoder does not read
  std::map<std::string, std::uint64_t> problems;  ///< one sentence each: messages or fields left out
  /// Observations left out, as no signal of gnss::signals_of() has their RINEX code: "G 2W".
  std::map<std::string, std::uint64_t> unknown_codes;
  /// Satellites with observations that were left out, as their whole milliseconds were not found.
  std::set<gnss::SatelliteId> without_milliseconds;
  std::uint64_t checksum_errors = 0;           ///< began like a frame, with a wrong checksum
  std::uint64_t bytes_passed_over = 0;         ///< that belonged to no frame
  std::uint64_t bytes_held = 0;                ///< of a frame whose end has not come
  std::uint64_t epochs = 0;                    ///< given
  std::uint64_t epochs_held_back = 0;          ///< not given, as the place of the station was not known yet
  std::optional<int> station;                  ///< of the last message that names one, [0, 4095]
  std::optional<geodesy::GpsTime> last_epoch;  ///< of the last observations, also of those not given

  /// Damage and omissions, one line each with its count.
  [[nodiscard]] std::vector<std::string> warnings() const;
};

/// RTCM 3 of a base, in pieces of any size, into epochs of corrections. Reads the messages
///   1005, 1006   place of the antenna reference point; the antenna's height of 1006 is that over a marker
///                and no part of it
///   1007, 1008, 1033   names of antenna and receiver
///   1230         GLONASS code-phase biases, which are added to the phases; phases begin anew where they
///                change
///   1020         GLONASS frequency channels
///   1001 to 1004, 1009 to 1012   observations of GPS and GLONASS, of L1, of L1 and L2
///   1071, 1073 to 1077, 1081, 1083 to 1087, ..., 1121, 1123 to 1127   MSM1 and MSM3 to MSM7 of GPS, GLONASS,
///   Galileo, SBAS, QZSS, BeiDou
/// and counts all others; MSM2 has no pseudoranges. MSM1, MSM3, 1001, 1003, 1009 and 1011 leave the whole
/// milliseconds of pseudoranges out: a RangeTable completes them, else they are counted and left
/// out. Where the station of the observations states no place, names or biases, those of one
/// that never observes are taken: some bases and casters number these messages otherwise. Whatever the bytes
/// are, it throws nothing and its memory is bounded.
///
/// Measurements have the default standard deviations: RTCM has none. A satellite's code that is read as a
/// signal is the best one that it has, in the order of rinex::signal_codes(). Measurement::phase_since is
/// later than at the epoch before where the lock time fell, or is shorter than the time between the two
/// epochs; of MSM4 and MSM5, whose lock times are coarse, also where that is not certain.
class CorrectionsDecoder {
 public:
  using Epochs = std::vector<std::shared_ptr<const relative::Corrections>>;
  /// Frequency channel of a GLONASS satellite, [-7, 6].
  using ChannelTable = std::function<std::optional<int>(gnss::SatelliteId)>;

  /// @param glonass_channel asked where neither MSM5, MSM7, 1012 nor 1020 has stated the channel. Without
  ///   one, phase and Doppler are left out, and the carrier frequency is that of channel 0.
  /// @param needs_place false: a rover's stream, whose epochs without 1005 or 1006 have a place of zeros
  /// @param ranges completes pseudoranges without whole milliseconds
  explicit CorrectionsDecoder(ChannelTable glonass_channel = {}, bool needs_place = true,
                              RangeTable ranges = {});

  /// Epochs that are complete with these bytes, in their order: the last message of an epoch says that no
  /// more follow (DF393, DF005), or one of another time has come. Where more of an epoch comes behind its
  /// last message, the epoch is given again with all of it.
  /// @param now any time within half a week of the messages (half a day where GLONASS does not state the day)
  [[nodiscard]] Epochs feed(std::string_view bytes, geodesy::GpsTime now);
  /// The epoch whose last message has not come, where there is one.
  [[nodiscard]] Epochs finish();

  [[nodiscard]] const DecoderStatus& status() const { return status_; }

 private:
  class Fields;
  /// The signal that a code is read as, and the code's place among all that are read as it.
  struct Reading {
    const gnss::Signal* signal = nullptr;
    int rank = 0;
  };
  [[nodiscard]] static Reading reading_of(gnss::System system, std::string_view code);
  /// The lock times that an indicator stands for, from the first to below the second [ms].
  struct LockTime {
    double least_ms = 0, end_ms = 0;
  };
  /// Times of indicators of MSM4 and MSM5, or MSM6 and MSM7 (extended), and of 1001 to 1012.
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
    bool turns = false;
    LockTime lock;
    bool half_cycle = false;
    double unit_m = 0;  ///< the ranges are modulo this; 0: they are whole
  };
  using SignalKey = std::pair<gnss::SatelliteId, std::size_t>;  ///< index_of() the signal
  /// The contents of messages without observations.
  struct Station {
    std::optional<Eigen::Vector3d> place_ecef;
    std::string antenna_name, receiver_name;
    std::optional<relative::GlonassBiases> glonass_bias_m;
    bool observes = false;
  };
  struct Epoch {
    geodesy::GpsTime time;
    std::map<SignalKey, relative::SignalMeasurement> observations;
    std::vector<Observation> partial;  ///< without whole milliseconds
    bool news = false;                 ///< since it was given
  };
  struct Arc {
    geodesy::GpsTime at;      ///< of its last phase
    double least_ms = 0;      ///< lock time
    std::string_view code;    ///< RINEX
    geodesy::GpsTime since;   ///< Measurement::phase_since
    double ahead_cycles = 0;  ///< 1004, 1012: phase less pseudorange, as sent and turns of 1,500 cycles
  };

  void read(const broadcast::Bits& message, geodesy::GpsTime now, Epochs& complete);
  void read_place(Fields& fields);
  void read_names(Fields& fields);
  void read_biases(Fields& fields);
  void read_msm(Fields& fields, geodesy::GpsTime now, Epochs& complete);
  void read_legacy(Fields& fields, geodesy::GpsTime now, Epochs& complete);
  void add(const Observation& observation);
  void complete_milliseconds(const Eigen::Vector3d& place);
  void problem(const Fields& fields, std::string_view what);
  Station& station(int id);
  void observe(int id);
  template <typename Has>
  [[nodiscard]] const Station* describing(Has has) const;
  [[nodiscard]] const relative::GlonassBiases& glonass_bias_m() const;
  void begin(geodesy::GpsTime time, Epochs& complete);
  void give(Epochs& complete);
  [[nodiscard]] std::optional<int> channel(gnss::SatelliteId id) const;

  ChannelTable glonass_channel_;
  RangeTable ranges_;
  FrameParser frames_;
  DecoderStatus status_;
  std::map<int, Station> stations_;
  int observing_ = -1;  ///< station of the last observations
  bool needs_place_;
  std::map<gnss::SatelliteId, int> channels_;
  std::map<SignalKey, Arc> arcs_;
  std::optional<Epoch> epoch_;
};

}  // namespace canyon::rtcm
