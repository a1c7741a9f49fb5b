#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace canyon::heatmap {

/// A quantity that a map gives for each cell, time and altitude. Values are floats, NaN where there is none.
enum class Layer : std::uint8_t {
  HorizontalError,      ///< without noise [m]; NaN without a fix, as all errors
  VerticalError,        ///< without noise, up positive [m]
  HorizontalErrorMean,  ///< over noise draws [m]
  HorizontalErrorRms,
  HorizontalErrorP50,
  HorizontalErrorP95,
  VerticalErrorMean,  ///< of |up error| [m]
  VerticalErrorRms,
  VerticalErrorP50,
  VerticalErrorP95,
  Availability,  ///< 1 with a fix, 0 without; with strength: share of the draws [1]
  Hdop,          ///< NaN without a fix, as all DOPs
  Pdop,
  Vdop,
  SatellitesLos,      ///< above the mask, direct path clear
  SatellitesVisible,  ///< above the mask, received
  SatellitesUsed,     ///< in the fix; 0 without
  SatellitesBlocked,  ///< above the mask, not received
  NlosShare,          ///< of the received ones, NaN for none [1]
  LargestExcess,      ///< of received satellites [m], NaN for none
  SkyView,  ///< share of the sky's hemisphere (by solid angle) that is clear [1]; the same at all times
};

struct LayerInfo {
  Layer layer;
  std::string_view name;       ///< "horizontal_error_p95": of options, NetCDF variables and files
  std::string_view long_name;  ///< for people
  std::string_view unit;       ///< UDUNITS: "m", "1"
  bool error = false;          ///< needs a fix (its errors, geometry or satellites)
  bool draws = false;          ///< needs noise draws
  /// Needs to know what arrives beyond the line of sight: all but SatellitesLos and SkyView.
  bool received = true;
};
/// In the order of Layer.
[[nodiscard]] std::span<const LayerInfo> all_layers();
[[nodiscard]] const LayerInfo& info(Layer layer);
/// By its name, upper or lower case; InputError, with the closest one, for another. "all" is not one.
[[nodiscard]] Layer layer_by_name(std::string_view name);
/// HorizontalError, SatellitesVisible, Hdop: the paper's panels.
[[nodiscard]] std::vector<Layer> default_layers();

/// Why a cell has no values.
enum class CellState : std::uint8_t {
  Computed = 0,
  InsideBuilding = 1,
  UnderTerrain = 2,
  OutsideArea = 3,
  NoTerrain = 4
};

}  // namespace canyon::heatmap
