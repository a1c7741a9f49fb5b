#include "canyon/outputs/view/header.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "canyon/paths/propagation/paths.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/tracking/correlation.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::view {
namespace {

/// Correlation functions are linear between multiples of this fraction of a chip.
constexpr int kCodeSteps = 12;

std::string_view surface_word(city::Surface surface) {
  static constexpr std::array<std::string_view, 4> kWords{"building", "terrain", "foliage", "vehicle"};
  return kWords.at(static_cast<std::size_t>(surface));
}

/// Rounded to 1 mm, so that headers of large cities stay short.
double millimetres(double metres) {
  return std::round(metres * 1000) / 1000 + 0.0;
}

Json city_json(const SceneCity& city) {
  Json objects = Json::array();
  for (const SceneObject& object : city.objects) {
    Json json{{"id", object.id},
              {"surface", surface_word(object.surface)},
              {"material", city::material_name(object.material)},
              {"low_m", millimetres(object.low_m)},
              {"high_m", millimetres(object.high_m)}};
    if (!object.height_source.empty()) json["height_source"] = object.height_source;
    objects.push_back(std::move(json));
  }
  return {{"name", city.name},
          {"file", kCityChunk},
          {"triangles", city.triangles},
          {"notes", city.notes},
          {"objects", std::move(objects)}};
}

/// The correlation functions of the signals of these satellites' systems, without noise and sidelobes.
Json codes_json(const std::vector<gnss::SatelliteId>& satellites) {
  Json codes = Json::array();
  for (const gnss::System system : gnss::kAllSystems) {
    const bool seen = std::any_of(satellites.begin(), satellites.end(),
                                  [&](gnss::SatelliteId id) { return id.system == system; });
    for (const gnss::Signal& signal : gnss::signals_of(system)) {
      if (!seen || !signal.only_recorded.empty()) continue;
      const tracking::Correlation correlation({signal.modulation, signal.chip_rate_hz});
      Json values = Json::array();
      for (int i = 0; i <= kCodeSteps; ++i)
        values.push_back(std::round(1e6 * correlation.value(static_cast<double>(i) / kCodeSteps)) / 1e6);
      codes.push_back({{"system", gnss::name(system)},
                       {"signal", signal.name},
                       {"chip_m", std::round(1e6 * correlation.chip_m()) / 1e6},
                       {"values", std::move(values)}});
    }
  }
  return codes;
}

/// The words indexed by columns.
Json words_json(const encoding::ViewWords& texts) {
  Json words;
  const auto list = [&](std::string_view name, auto last, std::string_view (*word)(std::int64_t)) {
    Json& all = words[std::string(name)] = Json::array();
    for (std::int64_t i = 0; i <= static_cast<std::int64_t>(last); ++i) all.push_back(word(i));
  };
  list("status", positioning::FixStatus::NoSignal, [](std::int64_t i) {
    const auto s = static_cast<positioning::FixStatus>(i);
    return s == positioning::FixStatus::Fix ? positioning::name(s) : positioning::reason(s);
  });
  list("path", propagation::PathKind::Transmitted,
       [](std::int64_t i) { return propagation::name(static_cast<propagation::PathKind>(i)); });
  list("body", propagation::Body::Kind::Crown,
       [](std::int64_t i) { return propagation::name(static_cast<propagation::Body::Kind>(i)); });
  for (const encoding::ViewTable& table : encoding::view_tables()) {
    for (const encoding::ViewColumn& column : table.columns)
      if (column.from != nullptr && column.from->words > 0)
        list(column.name, column.from->words - 1, column.from->word);
  }
  for (const auto& [column, known] : texts.lists()) words[column] = known;
  return words;
}

/// The metrics shown by the viewer.
Json metrics_json() {
  Json json = Json::array();
  for (const encoding::SummaryMetric& metric : encoding::summary_metrics()) {
    if (*metric.label == '\0') continue;
    json.push_back({{"name", metric.name},
                    {"label", metric.label},
                    {"unit", metric.printed_unit()},
                    {"factor", metric.factor},
                    {"decimals", metric.decimals},
                    {"about", metric.help}});
  }
  return json;
}

Json summary_json(const encoding::RunSummary& summary) {
  Json json;
  for (const encoding::SummaryMetric& metric : encoding::summary_metrics()) {
    if (!metric.is_applicable(summary)) continue;
    const double value = metric.value(summary);
    json[metric.name] = metric.is_count() ? Json(static_cast<std::int64_t>(value)) : Json(value);
  }
  return json;
}

Json receiver_json(const ReceiverHeader& receiver) {
  Json faults = Json::array();
  for (const FaultStretch& f : receiver.faults)
    faults.push_back({{"name", f.name}, {"from_s", f.from_s}, {"until_s", f.until_s}});
  return {{"name", receiver.name},
          {"strength", receiver.strength},
          {"elevation_mask_deg", receiver.elevation_mask_deg},
          {"faults", std::move(faults)},
          {"summary", summary_json(receiver.summary)}};
}

Json tables_json() {
  Json json = Json::array();
  for (const encoding::ViewTable& table : encoding::view_tables()) {
    Json columns = Json::array();
    for (const encoding::ViewColumn& column : table.columns) {
      columns.push_back({{"name", column.name},
                         {"type", encoding::name(column.type)},
                         {"unit", column.unit},
                         {"about", column.about},
                         {"values", table.name == "skylines" ? encoding::kSkylineSectors : 1}});
    }
    json.push_back({{"name", table.name}, {"columns", std::move(columns)}});
  }
  return json;
}

Json frame_json(const geodesy::Geodetic& origin) {
  return {{"axes", "east north up"},
          {"unit", "m"},
          {"origin",
           {{"latitude_deg", geodesy::degrees(origin.latitude_rad)},
            {"longitude_deg", geodesy::degrees(origin.longitude_rad)},
            {"height_m", origin.height_m}}}};
}

}  // namespace

std::string header_json(const ViewHeader& header) {
  Json json{{"format", "canyon view"},
            {"version", 1},
            {"title", header.title},
            {"frame", frame_json(header.city.origin)}};
  if (header.live) json["live"] = true;
  if (header.begin) {
    json["time"] = {{"begin_utc", geodesy::format_utc(*header.begin)},
                    {"begin_gpst", geodesy::format_gpst(*header.begin)},
                    {"gps_week", header.begin->week()},
                    {"gps_tow", header.begin->seconds_of_week()},
                    {"interval_s", header.interval_s}};
  } else {
    json["time"] = nullptr;
  }
  json["city"] = city_json(header.city);
  json["words"] = words_json(header.words);
  json["paths_per_satellite"] = header.paths_per_satellite;
  json["figures"] = metrics_json();
  json["receivers"] = Json::array();
  for (const ReceiverHeader& receiver : header.receivers)
    json["receivers"].push_back(receiver_json(receiver));
  json["satellites"] = Json::array();
  for (const gnss::SatelliteId id : header.satellites)
    json["satellites"].push_back({{"id", gnss::to_string(id)}, {"system", gnss::name(id.system)}});
  json["codes"] = codes_json(header.satellites);
  json["tables"] = tables_json();
  json["chunks"] = Json::array();
  for (const ChunkEntry& chunk : header.chunks)
    json["chunks"].push_back({{"file", chunk.file},
                              {"kind", chunk.track ? "track" : "block"},
                              {"receiver", chunk.receiver},
                              {"first_epoch", chunk.first_epoch},
                              {"epochs", chunk.epochs},
                              {"satellites", chunk.satellites},
                              {"paths", chunk.paths},
                              {"bytes", chunk.bytes}});
  return json.dump() + "\n";
}

Json read_header(const std::filesystem::path& folder) {
  return Json::try_parse(read_bytes(folder / kHeaderFile)).value_or(Json());
}

bool shows_city(const Json& header, const city::City& city) {
  return header["frame"] == frame_json(city.frame.origin()) &&
         header["city"]["triangles"] == city.mesh.triangles.size();
}

ReceiverHeader receiver_header(const receiver::ReceiverOptions& options) {
  return {options.name, options.signal.enabled, geodesy::degrees(options.fix.elevation_mask_rad), {}, {}};
}

void write_header(const ViewHeader& header, const std::filesystem::path& folder) {
  overwrite_cache_file(folder / kHeaderFile, header_json(header));
}

void extend_header(const std::filesystem::path& folder, const std::string& key, const Json& value,
                   const Json& chunks) {
  Json header = read_header(folder);
  if (!header.contains("chunks"))
    throw InputError(folder / kHeaderFile, 0, "is not a Canyon view", "write it again");
  header[key] = value;
  Json all = Json::array();
  for (const Json& chunk : header["chunks"]) {
    const auto replaces = [&chunk](const Json& each) { return each["kind"] == chunk["kind"]; };
    if (std::none_of(chunks.begin(), chunks.end(), replaces)) all.push_back(chunk);
  }
  for (const Json& chunk : chunks) all.push_back(chunk);
  header["chunks"] = std::move(all);
  overwrite_cache_file(folder / kHeaderFile, header.dump() + "\n");
}

}  // namespace canyon::view
