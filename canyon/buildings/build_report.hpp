#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "canyon/buildings/city_builder.hpp"

namespace canyon::buildings {

/// Gathers remarks on single features: one line for each kind, with the first few ids and how many
/// more there are.
class Complaints {
 public:
  static constexpr std::size_t kIdsOfAKind = 5;
  static constexpr std::size_t kKinds = 50;  ///< further kinds are only counted

  void add(const std::string& kind, const std::string& id);
  /// "self-crossing outline: way/1, way/2 and 17 more", in the order in which kinds came up.
  [[nodiscard]] std::vector<std::string> lines() const;

 private:
  struct Kind {
    std::string text;
    std::vector<std::string> ids;
    std::size_t count = 0;
  };
  std::vector<Kind> kinds_;
  std::map<std::string, std::size_t> index_;
  std::size_t further_ = 0;
};

/// Counts a feature that was built from surfaces of its own.
void count_surveyed(BuildReport& report, FeatureKind kind);

/// Counts where the height, roof and facade of something built from tags are from.
void count_guesses(BuildReport& report, const Shape& shape, bool facade_known);

/// Adds what is to be said of the city as a whole: mostly guessed heights, heights for types of buildings
/// that the map does not have, buildings of a slope on level ground.
/// @param level the city has no terrain
void add_cautions(BuildReport& report, const MapData& map, const HeightDefaults& heights, bool level);

/// The notes of a city: what the map holds, the lines of format_report(), the terrain if there is one, and
/// the report's warnings.
[[nodiscard]] std::vector<std::string> city_notes(const MapData& map, const BuildReport& report,
                                                  const Terrain* terrain);

}  // namespace canyon::buildings
