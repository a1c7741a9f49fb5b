#include "canyon/output/view_messages.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "canyon/base/base64.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/gnss/satellite_id.hpp"
#include "canyon/output/encoder.hpp"

namespace canyon::output {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json begun(const char* type, const std::optional<std::int64_t>& id) {
  Json json{{"type", type}, {"version", kViewMessages}};
  if (id) json["id"] = *id;
  return json;
}

}  // namespace

std::string hello_message(const ReceiverDescription& receiver) {
  Json json = begun("hello", {});
  json["begin_utc"] = geodesy::format_utc(receiver.begin);
  json["begin_gpst"] = geodesy::format_gpst(receiver.begin);
  json["gps_week"] = receiver.begin.week();
  json["gps_tow"] = receiver.begin.seconds_of_week();
  json["interval_s"] = receiver.interval_s;
  json["receivers"] = Json::array();
  json["receivers"].push_back({{"name", receiver.name},
                               {"strength", receiver.signal.enabled},
                               {"elevation_mask_deg", geodesy::degrees(receiver.elevation_mask_rad)}});
  return text_of(json);
}

std::string epoch_message(const EpochMessage& message, const EpochRows& rows) {
  Json json = begun("epoch", message.id);
  json["receiver"] = message.receiver;
  json["time_s"] = message.time_s;
  json["place"] = {{"east_m", number(message.place.x())},
                   {"north_m", number(message.place.y())},
                   {"up_m", number(message.place.z())}};
  json["faults"] = message.faults;
  json["satellites"] = Json::array();
  for (const gnss::SatelliteId id : message.satellites) json["satellites"].push_back(gnss::to_string(id));
  if (!message.skyline.empty()) {
    json["skyline"] = Json::array();
    for (const char half_degrees : message.skyline) {
      json["skyline"].push_back(static_cast<unsigned char>(half_degrees));
    }
  }
  json["chunk"] = base64(view::encode_chunk({&rows.epochs, &rows.satellites, &rows.paths}));
  return text_of(json);
}

std::string error_message(std::optional<std::int64_t> id, std::string_view problem) {
  Json json = begun("error", id);
  json["message"] = std::string(problem);
  return text_of(json);
}

}  // namespace canyon::output
