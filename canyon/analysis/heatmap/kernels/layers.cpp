#include "canyon/analysis/heatmap/kernels/layers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <iterator>

#include "canyon/base/named.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"

namespace canyon::heatmap {
namespace {

constexpr bool kFix = true, kSampled = true, kLineOfSight = false;

using L = Layer;
constexpr LayerInfo kLayers[]{
    {L::HorizontalError, "horizontal_error", "horizontal position error without noise and errors from space",
     "m", kFix},
    {L::VerticalError, "vertical_error",
     "vertical position error without noise and errors from space, up positive", "m", kFix},
    {L::HorizontalErrorMean, "horizontal_error_mean", "mean horizontal position error", "m", kFix, kSampled},
    {L::HorizontalErrorRms, "horizontal_error_rms", "RMS horizontal position error", "m", kFix, kSampled},
    {L::HorizontalErrorP50, "horizontal_error_p50", "median horizontal position error", "m", kFix, kSampled},
    {L::HorizontalErrorP95, "horizontal_error_p95", "95th percentile of the horizontal position error", "m",
     kFix, kSampled},
    {L::VerticalErrorMean, "vertical_error_mean", "mean absolute vertical position error", "m", kFix,
     kSampled},
    {L::VerticalErrorRms, "vertical_error_rms", "RMS vertical position error", "m", kFix, kSampled},
    {L::VerticalErrorP50, "vertical_error_p50", "median absolute vertical position error", "m", kFix,
     kSampled},
    {L::VerticalErrorP95, "vertical_error_p95", "95th percentile of the absolute vertical position error",
     "m", kFix, kSampled},
    {L::Availability, "availability", "availability of a position fix", "1", kFix},
    {L::Hdop, "hdop", "horizontal dilution of precision", "1", kFix},
    {L::Pdop, "pdop", "position dilution of precision", "1", kFix},
    {L::Vdop, "vdop", "vertical dilution of precision", "1", kFix},
    {L::SatellitesLos, "satellites_los", "satellites in line of sight", "1", false, false, kLineOfSight},
    {L::SatellitesVisible, "satellites_visible", "satellites received", "1"},
    {L::SatellitesUsed, "satellites_used", "satellites used in the position fix", "1", kFix},
    {L::SatellitesBlocked, "satellites_blocked", "satellites above the mask not received", "1"},
    {L::NlosFraction, "nlos_share", "share of non-line-of-sight satellites among those received", "1"},
    {L::LargestExcess, "largest_excess", "largest excess path of a received satellite", "m"},
    {L::SkyView, "sky_view", "sky view factor: share of the hemisphere that is clear", "1", false, false,
     kLineOfSight},
    {L::HorizontalErrorExceedance, "horizontal_error_exceedance",
     "probability of a horizontal error above the limit", "1", kFix, kSampled},
    {L::ProtectionLevel, "protection_level", "horizontal protection level", "m", kFix},
    {L::ProtectedAvailability, "protected_availability",
     "availability of a fix whose protection level is below the alert limit", "1", kFix, kSampled},
    {L::MisleadingFraction, "misleading_share", "probability of an error above the protection level", "1",
     kFix, kSampled},
    {L::RtkFixedFraction, "rtk_fixed_share", "share of epochs with a fixed RTK solution", "1", kFix,
     kSampled},
    {L::RtkTimeToFix, "rtk_time_to_fix", "median time to the first fixed RTK solution", "s", kFix, kSampled},
    {L::RtkFixedErrorP95, "rtk_fixed_error_p95",
     "95th percentile of the horizontal position error while RTK is fixed", "m", kFix, kSampled},
};

constexpr bool in_order() {
  for (std::size_t i = 0; i < std::size(kLayers); ++i)
    if (kLayers[i].layer != static_cast<Layer>(i)) return false;
  return std::size(kLayers) == kLayerCount;
}
static_assert(in_order());

}  // namespace

std::span<const LayerInfo> all_layers() {
  return kLayers;
}

const LayerInfo& info(Layer layer) {
  assert(static_cast<std::size_t>(layer) < std::size(kLayers));
  return kLayers[static_cast<std::size_t>(layer)];
}

Layer layer_by_name(std::string_view name) {
  return entry_named(kLayers, lower_case(trim(name)), "layer").layer;
}

std::vector<Layer> layers_named(const std::vector<std::string_view>& names) {
  if (names.empty()) return default_layers();
  std::vector<Layer> layers;
  for (const std::string_view name : names) {
    const bool all = lower_case(trim(name)) == "all";
    for (const Layer layer : all ? layers_of_one_look() : std::vector{layer_by_name(name)})
      if (std::find(layers.begin(), layers.end(), layer) == layers.end()) layers.push_back(layer);
  }
  return layers;
}

void LimitOptions::validate() const {
  options::check(*this, "map's limits");
}

void visit(options::Visitor& v, LimitOptions& o) {
  v.number({"error_m", "m", "horizontal_error_exceedance: probability of a larger horizontal error"},
           o.error_m, {0, 1e6, true});
  v.number({"alert_m", "m", "protected_availability: largest horizontal protection level"}, o.alert_m,
           {0, 1e6, true});
  v.number({"protection_factor", "",
            "protection level over the larger half axis of the reported standard deviations"},
           o.protection_factor, {0, 100, true});
  v.integer({"rtk_s", "s", "rtk_...: time for which the receiver has corrections"}, o.rtk_s, 1, 3600);
}

std::string limits_text(Layer layer, const LimitOptions& limits) {
  const std::string level =
      fmt::format("{:g} times the larger half axis of the stated horizontal deviations (RTCA DO-229D, J.1)",
                  limits.protection_factor);
  switch (layer) {
    case Layer::HorizontalErrorExceedance:
      return fmt::format("more than {:g} m, of the draws with a fix", limits.error_m);
    case Layer::ProtectionLevel:
      return level + ", without noise";
    case Layer::ProtectedAvailability:
      return fmt::format("level {}, limit {:g} m", level, limits.alert_m);
    case Layer::MisleadingFraction:
      return fmt::format("level {}, of the draws with a fix", level);
    case Layer::RtkFixedFraction:
    case Layer::RtkTimeToFix:
    case Layer::RtkFixedErrorP95:
      return fmt::format("{} s of corrections, receiver at rest", limits.rtk_s);
    default:
      return {};
  }
}

std::vector<Layer> layers_of_one_look() {
  std::vector<Layer> layers;
  for (const LayerInfo& each : kLayers)
    if (!is_rtk_layer(each.layer)) layers.push_back(each.layer);
  return layers;
}

std::vector<Layer> default_layers() {
  return {Layer::HorizontalError, Layer::SatellitesVisible, Layer::Hdop};
}

}  // namespace canyon::heatmap
