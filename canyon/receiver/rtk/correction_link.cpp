#include "canyon/receiver/rtk/correction_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"

namespace canyon::rtk {

void CorrectionOptions::validate() const {
  options::check(*this, "corrections");
  if (std::adjacent_find(outages_s.begin(), outages_s.end(), std::greater_equal<>()) != outages_s.end()) {
    throw InputError("outages_s: the times do not ascend",
                     "write [20, 40, 100, 110]: from 20 s to 40 s, and from 100 s to 110 s");
  }
  if (station_error_m.size() > 3) {
    throw InputError(fmt::format("station_error_m: {} numbers", station_error_m.size()),
                     "give up to three: [east, north, up]");
  }
}

void visit(options::Visitor& v, CorrectionOptions& o) {
  v.text({"from", "",
          "name of the base, a receiver with `fixed`; canyon live: also the address of a stream of RTCM 3, "
          "ntrip://USER:PASSWORD@HOST:PORT/MOUNT; the node of ROS 2: also topic:NAME of rtcm_msgs/Message"},
         o.from);
  v.boolean({"virtual_station", "",
             "virtual reference station: the base's measurements as they would be at the position that the "
             "receiver reports"},
            o.virtual_station);
  v.number({"max_age_s", "s", "largest age of corrections that are used"}, o.max_age_s, {0, 3600, true});
  v.number({"rate_hz", "Hz", "rate of the epochs that the base sends; 0: all"}, o.rate_hz, {0, 100});
  v.number({"latency_s", "s", "delay from the base's epoch to the arrival of corrections"}, o.latency_s,
           {0, 600});
  v.number({"jitter_s", "s", "largest additional delay, uniformly distributed"}, o.jitter_s, {0, 600});
  v.number({"loss_fraction", "", "fraction of lost epochs"}, o.loss, {0, 1});
  v.former_name("loss", "loss_fraction");
  v.number({"range_m", "m", "range of the link to the base; 0: no limit"}, o.range_m, {0, 1e7});
  v.numbers({"outages_s", "s",
             "outages of the link as begin, end, begin, end since the start of the run: [20, 40, 100, 110]; "
             "the last end is optional"},
            o.outages_s, {0, 1e9});
  v.numbers(
      {"station_error_m", "m", "error of the base's reported position: east, north, up; if omitted: none"},
      o.station_error_m, {-1e6, 1e6});
}

bool is_stream(const std::string& from) {
  return from.find("://") != std::string::npos || from.starts_with("serial:") || from.starts_with("pty:") ||
         from.starts_with(kTopicAddress);
}

CorrectionLink::CorrectionLink(CorrectionOptions options, std::uint64_t seed, const std::string& name)
    : options_(std::move(options)), random_(seed, name + "/corrections") {}

void CorrectionLink::send(geodesy::GpsTime time, std::shared_ptr<const Corrections> corrections,
                          const std::optional<Eigen::Vector3d>& receiver_ecef) {
  if (!begin_) begin_ = time;
  // By times of measurement, since streams arrive with jitter; receivers' clocks are off by milliseconds.
  constexpr double kOnTime_s = 5e-3;
  const double since_s = sent_ ? corrections->receiver_time - *sent_ : -1;
  if (options_.rate_hz > 0 && since_s >= 0 && since_s < 1 / options_.rate_hz - kOnTime_s) return;
  sent_ = corrections->receiver_time;
  // Sampled for each epoch, so that outages and range do not change the losses.
  const double lost = random_.uniform(), late = random_.uniform();
  const double at_s = time - *begin_;
  // An odd number of starts and ends is in the past.
  const auto next = std::upper_bound(options_.outages_s.begin(), options_.outages_s.end(), at_s);
  const bool out = (next - options_.outages_s.begin()) % 2 != 0;
  const bool far = options_.range_m > 0 && receiver_ecef &&
                   (*receiver_ecef - corrections->station_ecef).norm() > options_.range_m;
  if (lost < options_.loss || out || far) return;
  if (!options_.station_error_m.empty()) {
    Corrections wrong = *corrections;
    const Eigen::Matrix3d enu =
        geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(wrong.station_ecef));
    Eigen::Vector3d error = Eigen::Vector3d::Zero();
    std::copy(options_.station_error_m.begin(), options_.station_error_m.end(), error.data());
    wrong.station_ecef += enu.transpose() * error;
    corrections = std::make_shared<const Corrections>(std::move(wrong));
  }
  Sent sent{time + (options_.latency_s + late * options_.jitter_s), std::move(corrections)};
  const auto after = std::upper_bound(in_transit_.begin(), in_transit_.end(), sent,
                                      [](const Sent& a, const Sent& b) { return a.due < b.due; });
  in_transit_.insert(after, std::move(sent));
}

std::shared_ptr<const Corrections> CorrectionLink::take(geodesy::GpsTime time) {
  std::shared_ptr<const Corrections> latest;
  for (; !in_transit_.empty() && in_transit_.front().due <= time; in_transit_.pop_front()) {
    std::shared_ptr<const Corrections>& next = in_transit_.front().corrections;
    if (given_ && next->receiver_time <= *given_) continue;  // overtaken
    given_ = next->receiver_time;
    latest = std::move(next);
  }
  return latest;
}

}  // namespace canyon::rtk
