#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/kernels/layers.hpp"

namespace canyon::heatmap {

/// Values of one tile: all times (of a chunk) and altitudes. Layout [layer][time][altitude][cell].
struct TileValues {
  std::size_t first_time = 0, times = 0;
  std::vector<float> values;
  std::vector<CellState> state;  ///< [altitude][cell]
};

/// Finished units in a folder, each in a file written as a whole, with a checksum. The folder's manifest has
/// a key (hash of all inputs): a foreign or damaged store is rejected with an InputError that names the file
/// and how to delete it. Processes may share a folder if no two save the same unit; the first one creates it
/// before the others open it. save() and load() of different units may run concurrently.
class TileStore {
 public:
  /// Opens or creates `folder`, which is new, empty or a store of the same key (InputError). Removes
  /// incomplete files of a killed run once they are a minute old.
  /// @param key of the request (Heatmap::key()); @param description for people, stored with it
  TileStore(std::filesystem::path folder, const std::string& key, const std::string& description);
  /// Whether a unit of work (tile and chunk of times) is stored. Checks its header and length (InputError if
  /// wrong); only load() checks the values' checksum.
  [[nodiscard]] bool has(std::size_t unit) const;
  /// Writes a unit completely or not at all. InputError if the disk is full or not writable; others are kept.
  void save(std::size_t unit, const TileValues& values);
  /// Empty if it is not stored; InputError with the file's name if it is damaged.
  [[nodiscard]] std::optional<TileValues> load(std::size_t unit) const;
  /// Removes all units and the manifest, and the folder if nothing else is in it.
  void remove();

 private:
  [[nodiscard]] std::filesystem::path path(std::size_t unit) const;
  std::filesystem::path folder_;
  std::array<std::uint64_t, 2> key_{};  ///< hashed
};

}  // namespace canyon::heatmap
