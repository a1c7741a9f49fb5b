#include "canyon/output/view_messages.hpp"

#include "canyon/base/json.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/gnss/satellite_id.hpp"
#include "canyon/output/encoder.hpp"

namespace canyon::output {
namespace {

Json begun(const char* type, const std::optional<std::int64_t>& id) {
  Json json{{"type", type}, {"version", kViewMessages}};
  if (id) json["id"] = *id;
  return json;
}

}  // namespace

std::string hello_message(std::span<const ReceiverDescription> receivers) {
  Json json = begun("hello", {});
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
  Json json = begun("epoch", message.id);
  json["receiver"] = message.receiver;
  json["time_s"] = message.time_s;
  json["place"] = {
      {"east_m", message.place.x()}, {"north_m", message.place.y()}, {"up_m", message.place.z()}};
  json["faults"] = message.faults;
  json["words"] = Json::object();
  for (const auto& [column, words] : rows.words().lists()) json["words"][column] = words;
  json["satellites"] = Json::array();
  for (const gnss::SatelliteId id : message.satellites) json["satellites"].push_back(gnss::to_string(id));
  if (!message.skyline.empty()) {
    json["skyline"] = std::vector<unsigned char>(message.skyline.begin(), message.skyline.end());
  }
  json["chunk"] = base64(encode_chunk({&rows.epochs, &rows.satellites, &rows.paths, &rows.bodies}));
  return json.dump();
}

std::string epoch_message(EpochMessage message, const simulation::Epoch& epoch,
                          const EpochRows::ToLocal& local, EpochRows& rows) {
  message.place = local(epoch.truth_ecef);
  message.faults = epoch.faults;
  message.satellites.clear();
  for (const auto& satellite : epoch.observed.satellites) message.satellites.push_back(satellite.id);
  rows.clear();
  rows.words().clear();
  rows.add(epoch, 0, message.time_s, -1, local, message.satellites);
  return epoch_message(message, rows);
}

std::string progress_message(std::size_t done, std::size_t planned) {
  Json json = begun("progress", {});
  json["done"] = done;
  json["planned"] = planned;
  return json.dump();
}

std::string finished_message() {
  return begun("finished", {}).dump();
}

std::string error_message(std::optional<std::int64_t> id, std::string_view problem) {
  Json json = begun("error", id);
  json["message"] = std::string(problem);
  return json.dump();
}

}  // namespace canyon::output
