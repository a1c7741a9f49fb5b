#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "canyon/studies/heatmap/kernels/layers.hpp"

namespace canyon::heatmap {

/// Values of one tile: all times (of a chunk) and altitudes. Layout [layer][time][altitude][cell].
struct TileValues {
  std::size_t first_time = 0, times = 0;
  std::vector<float> values;
  std::vector<CellState> state;  ///< [altitude][cell]
};

/// Finished units in a folder, each a file written whole, with a checksum. A key (hash of everything that
/// values depend on) stands in the folder's manifest: a foreign or damaged store is refused with an
/// InputError that names the file and says how to get rid of it. Processes may share a folder as long as no
/// two save the same unit; the first one makes it before the others come. save() and load() of different
/// units may run at once.
class TileStore {
 public:
  /// Opens or makes `folder`, which is new, empty or a store of the same key (InputError). Removes files that
  /// a killed run left half written, once they are a minute old.
  /// @param key of the request (Heatmap::key()); @param description for people, kept beside it
  TileStore(std::filesystem::path folder, const std::string& key, const std::string& description);
  /// Whether a unit of work (tile and chunk of times) is there. Its head and length are checked (InputError
  /// where they are wrong), its values' checksum only by load().
  [[nodiscard]] bool has(std::size_t unit) const;
  /// Writes a unit, whole or not at all. Throws InputError where the disk is full or cannot be written to;
  /// other units are kept.
  void save(std::size_t unit, const TileValues& values);
  /// Empty where it is not there; a damaged file is an InputError that names it.
  [[nodiscard]] std::optional<TileValues> load(std::size_t unit) const;
  /// Removes all units and the manifest, and the folder if nothing else is in it.
  void remove();

 private:
  [[nodiscard]] std::filesystem::path path(std::size_t unit) const;
  std::filesystem::path folder_;
  std::array<std::uint64_t, 2> key_{};  ///< hashed
};

}  // namespace canyon::heatmap
