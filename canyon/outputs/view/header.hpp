#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/json.hpp"
#include "canyon/outputs/output/sinks.hpp"
#include "canyon/outputs/output/view_tables.hpp"
#include "canyon/outputs/view/page.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::view {

/// Name of a view's header in its folder.
inline constexpr const char* kHeaderFile = "view.json";

/// A file of rows beside the header.
struct ChunkEntry {
  std::string file;
  std::size_t receiver = 0;
  bool track = false;  ///< all epochs and skylines of the receiver; else a block of its satellites and paths
  std::size_t first_epoch = 0, epochs = 0;
  std::size_t bytes = 0;                  ///< unpacked
  std::size_t satellites = 0, paths = 0;  ///< rows
};

/// The time of a fault, by the epochs at which it was at work.
struct FaultStretch {
  std::string name;
  double from_s = 0, until_s = 0;  ///< first and last epoch, since the begin
};

struct ReceiverHeader {
  std::string name;
  bool strength = false;          ///< signals have a strength: C/N0, lock, loss of paths
  double elevation_mask_deg = 0;  ///< of its fix
  std::vector<FaultStretch> faults;
  output::RunSummary summary;
};

/// Contents of view.json; docs/view-format.md and viewer/schema.json define it.
struct ViewHeader {
  std::string title;
  bool live = false;  ///< epochs come as messages; no chunks
  SceneCity city;
  std::optional<geodesy::GpsTime> begin;  ///< without receivers: none
  double interval_s = 1;
  std::size_t paths_per_satellite = 0;  ///< kept at most
  std::vector<ReceiverHeader> receivers;
  std::vector<gnss::SatelliteId> satellites;  ///< ascending
  output::ViewWords words;                    ///< texts of indices in the chunks
  std::vector<ChunkEntry> chunks;
};

/// The header of the view in `folder`, parsed; null where it is not JSON. Throws InputError where it
/// cannot be read.
[[nodiscard]] Json read_header(const std::filesystem::path& folder);
/// Whether such a header is of this city: the same origin, as many triangles.
[[nodiscard]] bool shows_city(const Json& header, const city::City& city);

/// The header of a receiver before its first epoch.
[[nodiscard]] ReceiverHeader receiver_header(const receiver::ReceiverOptions& options);

/// The JSON, ending with a newline.
[[nodiscard]] std::string header_json(const ViewHeader& header);
/// Writes it to `folder`, whole or not at all.
void write_header(const ViewHeader& header, const std::filesystem::path& folder);
/// Puts more into the header of the view in `folder`: a key with its value, and chunks, which take the place
/// of those of the same kinds that are there. Throws InputError where the folder has no view or does not take
/// the file.
void extend_header(const std::filesystem::path& folder, const std::string& key, const Json& value,
                   const Json& chunks);

}  // namespace canyon::view
