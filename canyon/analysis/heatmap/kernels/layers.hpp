#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/options/fwd.hpp"

namespace canyon::heatmap {

/// A quantity that a map has for each cell, time and altitude. Values are floats, NaN if there is none.
enum class Layer : std::uint8_t {
  HorizontalError,      ///< without noise [m]; NaN without a fix, as all errors
  VerticalError,        ///< without noise, up positive [m]
  HorizontalErrorMean,  ///< over noise realizations [m]
  HorizontalErrorRms,
  HorizontalErrorP50,
  HorizontalErrorP95,
  VerticalErrorMean,  ///< of |up error| [m]
  VerticalErrorRms,
  VerticalErrorP50,
  VerticalErrorP95,
  Availability,  ///< 1 with a fix, 0 without; with strength: fraction of the realizations [1]
  Hdop,          ///< NaN without a fix, as all DOPs
  Pdop,
  Vdop,
  SatellitesLos,      ///< above the mask, direct path clear
  SatellitesVisible,  ///< above the mask, received
  SatellitesUsed,     ///< in the fix; 0 without
  SatellitesBlocked,  ///< above the mask, not received
  NlosFraction,       ///< of the received ones, NaN for none [1]
  LargestExcess,      ///< of received satellites [m], NaN for none
  SkyView,            ///< clear fraction of the sky's hemisphere (by solid angle) [1]; the same at all times
  HorizontalErrorExceedance,  ///< fraction of realizations with a fix whose error exceeds
                              ///< LimitOptions::error_m
  ProtectionLevel,            ///< positioning::horizontal_protection_level_m() of the fix without noise [m]
  /// Fraction of the realizations that have a fix with a protection level up to LimitOptions::alert_m [1].
  ProtectedAvailability,
  MisleadingFraction,  ///< fraction of realizations with a fix and a horizontal error above the protection
                       ///< level
  // Layers of a stationary receiver with RTK that uses its base's corrections for LimitOptions::rtk_s:
  RtkFixedFraction,  ///< fraction of the epochs of all realizations whose solution is fixed [1]
  RtkTimeToFix,      ///< median over the realizations [s]; NaN if half of them or more have no fixed solution
  RtkFixedErrorP95,  ///< 95th percentile of the horizontal error while fixed [m]; NaN without
};
inline constexpr std::size_t kLayerCount = static_cast<std::size_t>(Layer::RtkFixedErrorP95) + 1;

struct LayerInfo {
  Layer layer;
  std::string_view name;       ///< "horizontal_error_p95": of options, NetCDF variables and files
  std::string_view long_name;  ///< for people
  std::string_view unit;       ///< UDUNITS: "m", "1", "s"
  bool error = false;          ///< needs a fix (its errors, geometry or satellites)
  bool needs_samples = false;  ///< needs noise realizations
  /// Needs all arriving paths beyond the line of sight: all but SatellitesLos and SkyView.
  bool received = true;
};
/// Limits of the layers for planners.
struct LimitOptions {
  double error_m = 10;  ///< of HorizontalErrorExceedance; (0, 1e6]
  /// Alert limit of ProtectedAvailability; (0, 1e6]. Default: horizontal alert limit of APV-I and LPV
  /// approaches (ICAO Annex 10 volume I, table 3.7.2.4-1).
  double alert_m = 40;
  /// K of protection levels, (0, 100]. Default: K_H,PA of RTCA DO-229D appendix J.2.1; K_H,NPA is 6.18.
  double protection_factor = 6.0;
  int rtk_s = 60;  ///< time with corrections [s]; [1, 3600]
  [[nodiscard]] bool operator==(const LimitOptions&) const = default;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, LimitOptions& o);
/// All layers, in the order of Layer.
[[nodiscard]] std::span<const LayerInfo> all_layers();
[[nodiscard]] const LayerInfo& info(Layer layer);
/// Whether its receivers are run second by second.
[[nodiscard]] constexpr bool is_rtk_layer(Layer layer) {
  return layer >= Layer::RtkFixedFraction;
}
/// Whether the solver of cells computes it: all but SkyView, which needs none, and those of RTK.
[[nodiscard]] constexpr bool is_solver_layer(Layer layer) {
  return layer != Layer::SkyView && !is_rtk_layer(layer);
}
/// Whether large values are good. False for VerticalError, whose large values of both signs are bad.
[[nodiscard]] constexpr bool more_is_better(Layer layer) {
  return layer == Layer::Availability || layer == Layer::ProtectedAvailability || layer == Layer::SkyView ||
         layer == Layer::SatellitesLos || layer == Layer::SatellitesVisible ||
         layer == Layer::SatellitesUsed || layer == Layer::RtkFixedFraction;
}
/// The layer of this name, case-insensitive. InputError with the closest name if unknown; "all" is no layer.
[[nodiscard]] Layer layer_by_name(std::string_view name);
/// The layers of these names in their order, each once; "all" is layers_of_one_look(). No name:
/// default_layers(). Throws as layer_by_name().
[[nodiscard]] std::vector<Layer> layers_named(const std::vector<std::string_view>& names);
/// The limit of a layer, for people: "more than 10 m, of the draws with a fix"; empty for most layers.
[[nodiscard]] std::string limits_text(Layer layer, const LimitOptions& limits);
/// Layers that "all" selects: those that need one epoch in each cell.
[[nodiscard]] std::vector<Layer> layers_of_one_look();
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
