#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "canyon/buildings/sources/map_data.hpp"
#include "canyon/buildings/sources/shape.hpp"

namespace canyon::buildings {

/// Whether a tag names a material of the facade that is known.
[[nodiscard]] bool is_facade_known(const std::map<std::string, std::string>& tags);

/// A tag's length [m] if it is within [low, high], else `otherwise`.
[[nodiscard]] double length_tag_m(const std::map<std::string, std::string>& tags, const char* key, double low,
                                  double high, double otherwise);

/// The tags of a map's features, with what parts take from their buildings: height or levels where a part has
/// neither, materials of facade and roof, and what a building is used for.
class FeatureTags {
 public:
  /// Both are kept by reference.
  FeatureTags(const MapData& map, const HeightDefaults& heights)
      : map_(map), heights_(heights), building_(map.features.size()) {}

  void set_building(std::size_t part, std::size_t building) { building_[part] = building; }

  /// @param inherited set to whether the height is the building's; may be null
  [[nodiscard]] std::map<std::string, std::string> of(std::size_t feature, bool* inherited = nullptr) const;
  /// shape_from_tags() of them.
  [[nodiscard]] Shape shape(std::size_t feature) const;
  [[nodiscard]] city::FacadeMix facades(std::size_t feature) const;

 private:
  const MapData& map_;
  const HeightDefaults& heights_;
  std::vector<std::optional<std::size_t>> building_;  ///< of parts
};

}  // namespace canyon::buildings
