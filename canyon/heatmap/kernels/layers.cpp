#include "canyon/heatmap/kernels/layers.hpp"

#include <fmt/format.h>

#include <array>
#include <cassert>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::heatmap {
namespace {

constexpr bool kFix = true, kDraws = true, kLineOfSight = false;

constexpr std::array kLayers{
    LayerInfo{Layer::HorizontalError, "horizontal_error", "horizontal position error without noise", "m",
              kFix},
    LayerInfo{Layer::VerticalError, "vertical_error", "vertical position error without noise, up positive",
              "m", kFix},
    LayerInfo{Layer::HorizontalErrorMean, "horizontal_error_mean", "mean horizontal position error", "m",
              kFix, kDraws},
    LayerInfo{Layer::HorizontalErrorRms, "horizontal_error_rms", "RMS horizontal position error", "m", kFix,
              kDraws},
    LayerInfo{Layer::HorizontalErrorP50, "horizontal_error_p50", "median horizontal position error", "m",
              kFix, kDraws},
    LayerInfo{Layer::HorizontalErrorP95, "horizontal_error_p95",
              "95th percentile of the horizontal position error", "m", kFix, kDraws},
    LayerInfo{Layer::VerticalErrorMean, "vertical_error_mean", "mean absolute vertical position error", "m",
              kFix, kDraws},
    LayerInfo{Layer::VerticalErrorRms, "vertical_error_rms", "RMS vertical position error", "m", kFix,
              kDraws},
    LayerInfo{Layer::VerticalErrorP50, "vertical_error_p50", "median absolute vertical position error", "m",
              kFix, kDraws},
    LayerInfo{Layer::VerticalErrorP95, "vertical_error_p95",
              "95th percentile of the absolute vertical position error", "m", kFix, kDraws},
    LayerInfo{Layer::Availability, "availability", "availability of a position fix", "1", kFix},
    LayerInfo{Layer::Hdop, "hdop", "horizontal dilution of precision", "1", kFix},
    LayerInfo{Layer::Pdop, "pdop", "position dilution of precision", "1", kFix},
    LayerInfo{Layer::Vdop, "vdop", "vertical dilution of precision", "1", kFix},
    LayerInfo{Layer::SatellitesLos, "satellites_los", "satellites in line of sight", "1", false, false,
              kLineOfSight},
    LayerInfo{Layer::SatellitesVisible, "satellites_visible", "satellites received", "1"},
    LayerInfo{Layer::SatellitesUsed, "satellites_used", "satellites used in the position fix", "1", kFix},
    LayerInfo{Layer::SatellitesBlocked, "satellites_blocked", "satellites above the mask not received", "1"},
    LayerInfo{Layer::NlosShare, "nlos_share", "share of non-line-of-sight satellites among those received",
              "1"},
    LayerInfo{Layer::LargestExcess, "largest_excess", "largest excess path of a received satellite", "m"},
    LayerInfo{Layer::SkyView, "sky_view", "sky view factor: share of the hemisphere that is clear", "1",
              false, false, kLineOfSight},
};

constexpr bool in_order() {
  for (std::size_t i = 0; i < kLayers.size(); ++i) {
    if (kLayers[i].layer != static_cast<Layer>(i)) return false;
  }
  return kLayers.size() == static_cast<std::size_t>(Layer::SkyView) + 1;
}
static_assert(in_order());

}  // namespace

std::span<const LayerInfo> all_layers() {
  return kLayers;
}

const LayerInfo& info(Layer layer) {
  assert(static_cast<std::size_t>(layer) < kLayers.size());
  return kLayers[static_cast<std::size_t>(layer)];
}

Layer layer_by_name(std::string_view name) {
  const std::string word = lower_case(trim(name));
  std::vector<std::string> names;
  for (const LayerInfo& each : kLayers) {
    if (each.name == word) return each.layer;
    names.emplace_back(each.name);
  }
  const auto meant = closest(word, names);
  std::string all;
  for (const std::string& each : names) all += (all.empty() ? "" : ", ") + each;
  throw InputError(fmt::format("there is no layer '{}'", name),
                   meant ? fmt::format("did you mean {}?", *meant) : "layers are " + all);
}

std::vector<Layer> default_layers() {
  return {Layer::HorizontalError, Layer::SatellitesVisible, Layer::Hdop};
}

}  // namespace canyon::heatmap
