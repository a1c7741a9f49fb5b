#include "canyon/outputs/encoding/view_messages.hpp"

#include <memory>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::encoding {
namespace {

Json started_message(const char* type, const std::optional<std::int64_t>& id) {
  Json json{{"type", type}, {"version", kViewMessages}};
  if (id) json["id"] = *id;
  return json;
}

/// Maximum paths of a satellite sent to the page, which draws no more.
constexpr std::size_t kPaths = 12;

/// Messages of the viewer, one per line: "hello" first, then one "epoch" each. Independent of the city.
class ViewStream final : public Encoder {
 public:
  explicit ViewStream(const ReceiverDescription& receiver)
      : receiver_(receiver), rows_(receiver.signal, kPaths) {}

  std::string begin() override { return hello_message({&receiver_, 1}) + "\n"; }

  std::string encode(const simulation::Epoch& epoch) override {
    if (epoch.arrival == nullptr) return {};
    const propagation::Arrival& arrival = *epoch.arrival;
    const EpochRows::ToLocal local = [&](const Eigen::Vector3d& ecef) -> Eigen::Vector3d {
      return arrival.antenna_enu + arrival.ecef_from_enu.transpose() * (ecef - epoch.truth_ecef);
    };
    EpochMessage message;
    message.receiver = receiver_.name;
    message.time_s = epoch.observed.time - receiver_.begin;
    return epoch_message(std::move(message), epoch, local, rows_) + "\n";
  }

 private:
  ReceiverDescription receiver_;
  EpochRows rows_;
};

}  // namespace

std::string hello_message(std::span<const ReceiverDescription> receivers) {
  Json json = started_message("hello", {});
  const geodesy::GpsTime begin = receivers.front().begin;
  json["begin_utc"] = geodesy::format_utc(begin);
  json["begin_gpst"] = geodesy::format_gpst(begin);
  json["gps_week"] = begin.week();
  json["gps_tow"] = begin.seconds_of_week();
  json["interval_s"] = receivers.front().interval_s;
  json["receivers"] = Json::array();
  for (const ReceiverDescription& receiver : receivers) {
    json["receivers"].push_back({{"name", receiver.name},
                                 {"strength", receiver.signal.enabled},
                                 {"elevation_mask_deg", geodesy::degrees(receiver.elevation_mask_rad)}});
  }
  return json.dump();
}

std::string epoch_message(const EpochMessage& message, const EpochRows& rows) {
  Json json = started_message("epoch", message.id);
  json["receiver"] = message.receiver;
  json["time_s"] = message.time_s;
  json["place"] = {
      {"east_m", message.position.x()}, {"north_m", message.position.y()}, {"up_m", message.position.z()}};
  json["faults"] = message.faults;
  json["words"] = Json::object();
  for (const auto& [column, words] : rows.words().lists()) json["words"][column] = words;
  json["satellites"] = Json::array();
  for (const gnss::SatelliteId id : message.satellites) json["satellites"].push_back(gnss::to_string(id));
  if (!message.skyline.empty())
    json["skyline"] = std::vector<unsigned char>(message.skyline.begin(), message.skyline.end());
  json["chunk"] = base64(encode_chunk({&rows.epochs, &rows.satellites, &rows.paths, &rows.bodies}));
  return json.dump();
}

std::string epoch_message(EpochMessage message, const simulation::Epoch& epoch,
                          const EpochRows::ToLocal& local, EpochRows& rows) {
  message.position = local(epoch.truth_ecef);
  message.faults = epoch.faults;
  message.satellites.clear();
  for (const auto& satellite : epoch.observed.satellites) message.satellites.push_back(satellite.id);
  rows.clear();
  rows.words().clear();
  rows.add(epoch, 0, message.time_s, -1, local, message.satellites);
  return epoch_message(message, rows);
}

std::string progress_message(std::size_t done, std::size_t planned) {
  Json json = started_message("progress", {});
  json["done"] = done;
  json["planned"] = planned;
  return json.dump();
}

std::string finished_message() {
  return started_message("finished", {}).dump();
}

std::string error_message(std::optional<std::int64_t> id, std::string_view problem) {
  Json json = started_message("error", id);
  json["message"] = std::string(problem);
  return json.dump();
}

std::unique_ptr<Encoder> encode_view(const ReceiverDescription& receiver) {
  return std::make_unique<ViewStream>(receiver);
}

}  // namespace canyon::encoding
