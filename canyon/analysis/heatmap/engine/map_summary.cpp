#include "canyon/analysis/heatmap/engine/map_summary.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>

#include "canyon/base/arithmetic.hpp"
#include "canyon/city/city.hpp"

namespace canyon::heatmap {
namespace {

// A float's bits without sign, in order of magnitude, rounded to 9 bits of mantissa (and the implicit one).
constexpr int kDropped = 14;
constexpr std::uint32_t kMagnitude = 0x7fff'ffff, kInfinite = 0x7f80'0000;
constexpr std::size_t kZero = kInfinite >> kDropped;

std::size_t bin_of(float value) {
  const auto bits = same_bytes<std::uint32_t>(value);
  const std::size_t size = ((bits & kMagnitude) + (1U << (kDropped - 1))) >> kDropped;
  return (bits & ~kMagnitude) != 0 ? kZero - size : kZero + size;
}

double value_of(std::size_t bin) {
  const std::size_t size = bin < kZero ? kZero - bin : bin - kZero;
  const auto bits = static_cast<std::uint32_t>(size << kDropped);
  const auto value = same_bytes<float>(bits);
  return bin < kZero ? -value : value;
}

bool nan_without_fix(Layer layer) {
  return info(layer).error && layer != Layer::Availability && layer != Layer::SatellitesUsed &&
         layer != Layer::ProtectedAvailability && !is_rtk_layer(layer);
}

}  // namespace

std::optional<std::size_t> fix_layer(std::span<const Layer> layers) {
  const auto first = [&](auto&& is_one) -> std::optional<std::size_t> {
    const auto found = std::find_if(layers.begin(), layers.end(), is_one);
    if (found == layers.end()) return std::nullopt;
    return static_cast<std::size_t>(found - layers.begin());
  };
  if (const auto i = first([](Layer layer) { return layer == Layer::Availability; })) return i;
  // Layers of single fixes are preferred to those over realizations, which have values if any has a fix.
  if (const auto i = first([](Layer layer) { return nan_without_fix(layer) && !info(layer).needs_samples; }))
    return i;
  if (const auto i = first([](Layer layer) { return layer == Layer::SatellitesUsed; })) return i;
  return first(nan_without_fix);
}

double fix_fraction(Layer layer, float value) {
  if (layer == Layer::Availability) return value;
  if (layer == Layer::SatellitesUsed) return value > 0 ? 1 : 0;
  return std::isnan(value) ? 0 : 1;
}

ValueCounts::ValueCounts() : bins_(2 * kZero + 1) {}

void ValueCounts::add(float value) {
  if (std::isnan(value)) return;
  ++bins_[bin_of(value)];
  ++count_;
  sum_ += value;
  if (!(least_ <= value)) least_ = value;
  if (!(greatest_ >= value)) greatest_ = value;
}

double ValueCounts::mean() const {
  return count_ > 0 ? sum_ / static_cast<double>(count_) : kNone;
}

double ValueCounts::quantile(double p) const {
  assert(p >= 0 && p <= 1);
  if (count_ == 0) return kNone;
  const double wanted = std::max(1.0, std::ceil(p * static_cast<double>(count_) - 1e-9));
  std::size_t passed = 0, bin = 0;
  for (; bin + 1 < bins_.size(); ++bin) {
    passed += bins_[bin];
    if (static_cast<double>(passed) >= wanted) break;
  }
  return std::clamp(value_of(bin), least_, greatest_);
}

MapSummary summarize(const MapSource& source) {
  assert(source.request != nullptr && source.slice);
  const Request& request = *source.request;
  const std::size_t altitudes = request.altitudes_m.size();
  MapSummary summary;
  summary.cells = request.grid.cells() * altitudes;
  std::vector<ValueCounts> counts(request.layers.size());
  const std::optional<std::size_t> fix = fix_layer(request.layers);
  double fixes = 0;
  for (std::size_t tile = 0; tile < request.grid.tile_count(); ++tile) {
    const std::size_t cells = request.grid.tile(tile).cells() * altitudes;
    bool reported = false;
    for (std::size_t time = 0; time < request.times.size(); ++time) {
      const std::optional<MapSource::Slice> slice = source.slice(tile, time);
      if (!slice) {
        summary.missing += cells;
        continue;
      }
      assert(slice->state.size() == cells && slice->values.size() == cells * counts.size());
      if (!reported)
        for (const CellState state : slice->state) ++summary.states[static_cast<std::size_t>(state)];
      reported = true;
      for (std::size_t i = 0; i < cells; ++i) {
        if (slice->state[i] != CellState::Computed) continue;
        ++summary.values;
        for (std::size_t k = 0; k < counts.size(); ++k) counts[k].add(slice->values[k * cells + i]);
        if (fix) fixes += fix_fraction(request.layers[*fix], slice->values[*fix * cells + i]);
      }
    }
  }
  if (fix && summary.values > 0) summary.availability = fixes / static_cast<double>(summary.values);
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const ValueCounts& c = counts[k];
    summary.layers.push_back(
        {request.layers[k], c.count(), c.mean(), c.least(), c.quantile(0.5), c.quantile(0.95), c.greatest()});
  }
  return summary;
}

}  // namespace canyon::heatmap
