#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/json.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/outputs/encoding/view_tables.hpp"
#include "canyon/outputs/view/page.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"

namespace canyon::view {

/// Name of a view's header in its folder.
inline constexpr const char* kHeaderFile = "view.json";

/// A file of rows next to the header.
struct ChunkEntry {
  std::string file;
  std::size_t receiver = 0;
  bool track = false;  ///< all epochs and skylines of the receiver; else a block of its satellites and paths
  std::size_t first_epoch = 0, epochs = 0;
  std::size_t bytes = 0;                  ///< unpacked
  std::size_t satellites = 0, paths = 0;  ///< rows
};

/// The time of a fault, by the epochs during which it was active.
struct FaultStretch {
  std::string name;
  double from_s = 0, until_s = 0;  ///< first and last epoch, since the beginning
};

struct ReceiverHeader {
  std::string name;
  bool strength = false;          ///< signals have a strength: C/N0, lock, loss of paths
  double elevation_mask_deg = 0;  ///< of its fix
  std::vector<FaultStretch> faults;
  encoding::RunSummary summary;
};

/// Contents of view.json; docs/view-format.md and viewer/schema.json define it.
struct ViewHeader {
  std::string title;
  bool live = false;  ///< epochs are sent as messages; no chunks
  SceneCity city;
  std::optional<geodesy::GpsTime> begin;  ///< without receivers: none
  double interval_s = 1;
  std::size_t paths_per_satellite = 0;  ///< maximum stored
  std::vector<ReceiverHeader> receivers;
  std::vector<gnss::SatelliteId> satellites;  ///< ascending
  encoding::ViewWords words;                  ///< texts of indices in the chunks
  std::vector<ChunkEntry> chunks;
};

/// The header of the view in `folder`, parsed; null if not JSON. InputError if unreadable.
[[nodiscard]] Json read_header(const std::filesystem::path& folder);
/// Whether such a header is of this city: same origin, same number of triangles.
[[nodiscard]] bool shows_city(const Json& header, const city::City& city);

/// The header of a receiver before its first epoch.
[[nodiscard]] ReceiverHeader receiver_header(const receiver::ReceiverOptions& options);

/// The JSON, ending with a newline.
[[nodiscard]] std::string header_json(const ViewHeader& header);
/// Writes it to `folder` atomically.
void write_header(const ViewHeader& header, const std::filesystem::path& folder);
/// Extends the header of the view in `folder` by a key with its value and by chunks, which replace existing
/// chunks of the same kinds. Throws InputError if the folder has no view or cannot be written to.
void extend_header(const std::filesystem::path& folder, const std::string& key, const Json& value,
                   const Json& chunks);

}  // namespace canyon::view
