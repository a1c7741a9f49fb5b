#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/base/random.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::relative {

/// A receiver's measurement of one signal.
struct SignalMeasurement {
  const gnss::Signal* signal = nullptr;  ///< of gnss::signals_of()
  positioning::Measurement measurement;
  /// The phase refers to the instant of the code. GLONASS phases of receivers of different makers are off by
  /// up to some 100 m here, which becomes a part of a cycle for each step of the channel's number. True for
  /// systems whose satellites share a carrier.
  bool aligned = true;
};

/// Bias to add to GLONASS phases [m] so that they refer to the instant of the codes, by RINEX code
/// ("1C", "1P", "2C", "2P"): RTCM message 1230, header record GLONASS COD/PHS/BIS. Without an entry it is not
/// known.
using GlonassBiases = std::map<std::string, double, std::less<>>;

/// Adds the bias of a GLONASS signal of this code to its phase; where there is none the phase is not aligned.
inline void align(SignalMeasurement& seen, std::string_view code, const GlonassBiases& biases) {
  positioning::Measurement& m = seen.measurement;
  if (m.id.system != gnss::System::GLONASS) return;
  const auto bias_m = biases.find(code);
  seen.aligned = bias_m != biases.end();
  if (!seen.aligned || !m.carrier_phase_cycles) return;
  *m.carrier_phase_cycles += bias_m->second * m.carrier_frequency_hz / geodesy::kSpeedOfLight;
}

/// Input of a receiver from a reference station, beside the signals at its own antenna: one epoch of the
/// station as RTCM 3 has it (messages 1005 and MSM).
struct Corrections {
  int station = 0;  ///< its identification, [0, 4095]; 0 is what the RTCM of a run says
  Eigen::Vector3d station_ecef = Eigen::Vector3d::Zero();  ///< its antenna, as the station states it [m]
  /// The station moves: its place is its own fix of this epoch.
  bool moving = false;
  /// Reading of the station's clock; the pseudoranges hold its error.
  geodesy::GpsTime receiver_time;
  /// Those of a satellite stand together.
  std::vector<SignalMeasurement> observations;
  /// Names by the station (messages 1007, 1008, 1033); empty: not known.
  std::string antenna_name = {}, receiver_name = {};
};

/// The base whose corrections a receiver takes, and the link between them (docs/rtk.md).
struct CorrectionOptions {
  /// Name of a reference station of the same run, or the address of a stream of RTCM 3 (is_stream()), which
  /// `canyon live` reads, or of a topic (kTopicAddress), which the node of ROS 2 reads; empty: none.
  std::string from;
  /// Older ones are not used [s], (0, 3600]. Default: that of u-blox F9 receivers (HPG interface description,
  /// CFG-NAVSPG-CONSTR_DGNSSTO).
  double max_age_s = 60;
  double rate_hz = 0;    ///< epochs that the base sends, [0, 100]; 0: all
  double latency_s = 0;  ///< from the base's epoch to their use, [0, 600]
  double jitter_s = 0;   ///< and more, evenly from 0 to this, [0, 600]; those that overtake others count
  double loss = 0;       ///< share of epochs that never come, [0, 1]
  double range_m = 0;    ///< radio: nothing comes from farther away; 0: no limit
  /// Beginnings and ends of times in which nothing is sent, from the beginning of the run [s], ascending;
  /// without the last end it lasts.
  std::vector<double> outages_s;
  /// East, north, up [m], of the place that the base states; empty: it states the true one.
  std::vector<double> station_error_m;
  /// A network's: as if the base were at the place that the receiver reports (simulation::VirtualStation).
  bool virtual_station = false;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, CorrectionOptions& o);
/// Addresses of topics of ROS 2 begin with it: "topic:NAME".
inline constexpr std::string_view kTopicAddress = "topic:";
/// Whether CorrectionOptions::from is an address: "ntrip://...", "tcp-connect://...", "serial:...",
/// "topic:...".
[[nodiscard]] bool is_stream(const std::string& from);

/// Link that carries corrections from a base to one receiver. The same options and seed give the same losses.
class CorrectionLink {
 public:
  /// @param name of the receiver, that sets its random draws apart
  CorrectionLink(CorrectionOptions options, std::uint64_t seed, const std::string& name);

  /// The base measured at `time`. @param receiver_ecef where the receiver is then [m]; empty: not known, in
  /// range
  void send(geodesy::GpsTime time, std::shared_ptr<const Corrections> corrections,
            const std::optional<Eigen::Vector3d>& receiver_ecef);
  /// The newest that has come by `time`, and was not given before; null: none.
  [[nodiscard]] std::shared_ptr<const Corrections> take(geodesy::GpsTime time);

 private:
  struct Sent {
    geodesy::GpsTime due;
    std::shared_ptr<const Corrections> corrections;
  };
  CorrectionOptions options_;
  RandomStream random_;
  std::optional<geodesy::GpsTime> begin_, sent_, given_;  // of the run, of the base's epochs
  std::deque<Sent> on_their_way_;                         // by `due`
};

}  // namespace canyon::relative
