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

namespace canyon::rtk {

struct SignalMeasurement {
  const gnss::Signal* signal = nullptr;  ///< of gnss::signals_of()
  positioning::Measurement measurement;
  /// The phase refers to the instant of the code. GLONASS phases of receivers of different makers are off by
  /// up to some 100 m otherwise, which is a fraction of a cycle for each step of the channel's number. True
  /// for systems whose satellites use a common carrier.
  bool aligned = true;
};

/// Bias to add to GLONASS phases [m] so that they refer to the instant of the codes, by RINEX code ("1C",
/// "1P", "2C", "2P"): RTCM message 1230, header record GLONASS COD/PHS/BIS. Without an entry it is unknown.
using GlonassBiases = std::map<std::string, double, std::less<>>;

/// Adds the bias of a GLONASS signal of this code to its phase; without an entry the phase is not aligned.
inline void align(SignalMeasurement& seen, std::string_view code, const GlonassBiases& biases) {
  positioning::Measurement& m = seen.measurement;
  if (m.id.system != gnss::System::GLONASS) return;
  const auto bias_m = biases.find(code);
  seen.aligned = bias_m != biases.end();
  if (!seen.aligned || !m.carrier_phase_cycles) return;
  *m.carrier_phase_cycles += bias_m->second * m.carrier_frequency_hz / geodesy::kSpeedOfLight;
}

/// Data of a reference station for a receiver: one epoch of the station as in RTCM 3 (messages 1005 and MSM).
struct Corrections {
  int station = 0;  ///< its identification, [0, 4095]; 0 in the RTCM of a run
  Eigen::Vector3d station_ecef = Eigen::Vector3d::Zero();  ///< reported position of its antenna [m]
  /// The station moves: its position is its own fix of this epoch.
  bool moving = false;
  /// Reading of the station's clock; the pseudoranges include its error.
  geodesy::GpsTime receiver_time;
  /// Those of a satellite are adjacent.
  std::vector<SignalMeasurement> observations;
  /// Names by the station (messages 1007, 1008, 1033); empty: unknown.
  std::string antenna_name = {}, receiver_name = {};
};

/// The base of a receiver's corrections, and the link to it (docs/rtk.md).
struct CorrectionOptions {
  /// Name of a reference station of the same run, or the address of a stream of RTCM 3 (is_stream()), which
  /// `canyon live` reads, or of a topic (kTopicAddress), which the ROS 2 node reads; empty: none.
  std::string from;
  /// Corrections older than this are not used [s], (0, 3600]. Default: that of u-blox F9 receivers (HPG
  /// interface description, CFG-NAVSPG-CONSTR_DGNSSTO).
  double max_age_s = 60;
  double rate_hz = 0;    ///< rate of the base's epochs, [0, 100]; 0: all
  double latency_s = 0;  ///< from the base's epoch to their use, [0, 600]
  double jitter_s = 0;   ///< additional delay, uniform from 0 to this, [0, 600]; epochs may overtake others
  double loss = 0;       ///< fraction of lost epochs, [0, 1]
  double range_m = 0;    ///< range of the radio; 0: no limit
  /// Starts and ends of outages of the link, from the start of the run [s], ascending; without the last end
  /// the outage lasts.
  std::vector<double> outages_s;
  /// East, north, up [m], error of the base's reported position; empty: it reports the true one.
  std::vector<double> station_error_m;
  /// Of a network: as if the base were at the receiver's reported position (simulation::VirtualStation).
  bool virtual_station = false;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, CorrectionOptions& o);
/// Prefix of addresses of ROS 2 topics: "topic:NAME".
inline constexpr std::string_view kTopicAddress = "topic:";
/// Whether `from` is an address: "ntrip://...", "tcp-connect://...", "serial:...", "topic:...".
[[nodiscard]] bool is_stream(const std::string& from);

/// Link that carries corrections from a base to one receiver. Equal options and seed give equal losses.
class CorrectionLink {
 public:
  /// @param name of the receiver, makes its random stream distinct
  CorrectionLink(CorrectionOptions options, std::uint64_t seed, const std::string& name);

  /// Sends the base's epoch. @param receiver_ecef the receiver's position then [m]; empty: unknown, in range
  void send(geodesy::GpsTime time, std::shared_ptr<const Corrections> corrections,
            const std::optional<Eigen::Vector3d>& receiver_ecef);
  /// The newest epoch that arrived by `time` and was not returned before; null: none.
  [[nodiscard]] std::shared_ptr<const Corrections> take(geodesy::GpsTime time);

 private:
  struct Sent {
    geodesy::GpsTime due;
    std::shared_ptr<const Corrections> corrections;
  };
  CorrectionOptions options_;
  RandomStream random_;
  std::optional<geodesy::GpsTime> begin_, sent_, given_;  // of the run, of the base's epochs
  std::deque<Sent> in_transit_;                           // by `due`
};

}  // namespace canyon::rtk
