#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/options/fwd.hpp"
#include "canyon/relative/corrections.hpp"

namespace canyon::relative {

/// The base whose corrections a receiver takes, and the link between them (docs/corrections.md).
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
