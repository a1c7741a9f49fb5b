#include "canyon/analysis/heatmap/pictures/map_style.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/outputs/drawing/plot.hpp"

namespace canyon::heatmap {
namespace {

using drawing::Colour;
using drawing::rgb;

constexpr double kRobustFraction = 0.98;
/// If a scale's end is more than this times the median, most of a linear map has one colour.
constexpr double kSkewed = 6;
/// A scale's end that is smaller than this is drawn as zero.
constexpr double kNearZero = 1e-3;
constexpr int kMaxClasses = 10;
/// The darkest part of inferno: nearly black would hide outlines and the hue.
constexpr double kDarkestInferno = 0.1;

/// Knots are at entries 0, 16, ... 240 and 255 of a table of 256.
template <std::size_t N>
Colour table_colour(const std::array<Colour, N>& knots, double t) {
  const double entry = 255 * (std::isnan(t) ? 0 : std::clamp(t, 0.0, 1.0));
  const auto i = std::min(static_cast<std::size_t>(entry / 16), N - 2);
  const double width = i == N - 2 ? 15 : 16;
  return drawing::mix(knots[i], knots[i + 1], (entry - 16 * static_cast<double>(i)) / width);
}

Colour bright_inferno(double t) {
  return inferno(kDarkestInferno + (1 - kDarkestInferno) * t);
}

/// Minimum part of the bar for each label.
constexpr double kLabelRoom = 0.1;

void add_tick(ColourScale& scale, double value) {
  scale.ticks.emplace_back(scale.at(value), drawing::tick_label(value));
}

/// Ends are multiples of the step.
void label_evenly(ColourScale& scale, double step) {
  const double first = std::round(scale.low / step), last = std::round(scale.high / step);
  for (double k = first; k <= last; ++k) add_tick(scale, k * step + 0.0);
}

/// Round values from the largest down, if far enough apart, and the low end (or zero) itself.
void label_unevenly(ColourScale& scale) {
  const double low = std::max(scale.low, 0.0);
  std::vector<double> values{scale.high};
  for (double value = drawing::nice_floor(scale.high); scale.at(value) - scale.at(low) > kLabelRoom;
       value = drawing::nice_floor(0.99 * value))
    if (scale.at(values.back()) - scale.at(value) > kLabelRoom) values.push_back(value);
  if (scale.low < 0)
    for (const double value : values) add_tick(scale, -value);
  add_tick(scale, low);
  for (auto value = values.rbegin(); value != values.rend(); ++value) add_tick(scale, *value);
}

void scale_lengths(ColourScale& scale, const ValueCounts& values) {
  const double robust = values.quantile(kRobustFraction), least = values.quantile(1 - kRobustFraction);
  // Values below a micrometre count as zero: their rounding errors would look like a pattern.
  const bool some = robust > 1e-6, both = scale.style.kind == ValueKind::SignedLength;
  const double step = some ? drawing::nice_ceil(robust / (both ? 3 : 5)) : 0.5;
  scale.high = some ? step * std::ceil(robust / step - 1e-9) : 1;
  if (both) scale.low = -scale.high;
  scale.unit = scale.style.kind == ValueKind::Duration ? "s" : "m";
  if (!some || robust <= kSkewed * values.quantile(0.5)) {
    label_evenly(scale, step);
    return;
  }
  scale.progression = ColourScale::Progression::SquareRoot;
  if (!both && least > kNearZero * scale.high) {
    scale.progression = ColourScale::Progression::Logarithm;
    // Rounded to one digit: a rounder end would leave the bright colours unused.
    const double unit = std::pow(10, std::floor(std::log10(least)));
    scale.low = unit * std::floor(least / unit);
  }
  label_unevenly(scale);
}

void scale_dops(ColourScale& scale, const ValueCounts& values) {
  const double robust = values.count() > 0 ? std::min(values.quantile(kRobustFraction), kMaxRenderedDop) : 1;
  const double least = values.count() > 0 ? std::clamp(values.least(), 0.0, robust) : 0;
  const double step = drawing::nice_ceil(std::max(robust - least, 0.1) / 5);
  scale.low = step * std::floor(least / step + 1e-9);
  scale.high = std::max(step * std::ceil(robust / step - 1e-9), scale.low + step);
  label_evenly(scale, step);
}

void scale_counts(ColourScale& scale, const ValueCounts& values) {
  const bool any = values.count() > 0;
  const double least = any ? std::floor(values.least()) : 0,
               largest = any ? std::floor(values.greatest()) : 0;
  const double numbers = largest - least + 1;
  scale.class_width = numbers <= kMaxClasses ? 1 : drawing::nice_ceil(numbers / kMaxClasses);
  scale.low = scale.class_width * std::floor(least / scale.class_width);
  scale.classes = static_cast<int>((largest - scale.low) / scale.class_width) + 1;
  scale.high = scale.low + scale.classes * scale.class_width;
  const bool single = scale.class_width == 1;
  for (int i = 0; i < scale.classes + (single ? 0 : 1); ++i) {
    // A class of one number has its label below its middle; wider ones begin and end at their labels.
    scale.ticks.emplace_back((i + (single ? 0.5 : 0.0)) / scale.classes,
                             drawing::tick_label(scale.low + i * scale.class_width));
  }
}

void scale_fractions(ColourScale& scale) {
  scale.unit = "%";
  for (const int percent : {0, 20, 40, 60, 80, 100})
    scale.ticks.emplace_back(percent / 100.0, fmt::format("{}", percent));
}

}  // namespace

Colour inferno(double t) {
  static constexpr std::array kKnots{
      rgb(0x000004), rgb(0x0B0724), rgb(0x210C4A), rgb(0x3D0965), rgb(0x57106D), rgb(0x71196E),
      rgb(0x8A226A), rgb(0xA32C61), rgb(0xBC3754), rgb(0xD24644), rgb(0xE45A31), rgb(0xF1731D),
      rgb(0xF98E09), rgb(0xFCAC11), rgb(0xF9CB35), rgb(0xF2EA69), rgb(0xFCFFA4)};
  return table_colour(kKnots, t);
}

Colour cividis(double t) {
  static constexpr std::array kKnots{
      rgb(0x00224E), rgb(0x002E6A), rgb(0x1A386F), rgb(0x32436D), rgb(0x434E6C), rgb(0x535A6D),
      rgb(0x61656F), rgb(0x6F7073), rgb(0x7D7C78), rgb(0x8C8878), rgb(0x9B9476), rgb(0xABA072),
      rgb(0xBCAE6C), rgb(0xCDBB64), rgb(0xDEC958), rgb(0xF0D846), rgb(0xFEE838)};
  return table_colour(kKnots, t);
}

Colour orange_purple(double t) {
  static constexpr std::array kSteps{rgb(0x7F3B08), rgb(0xB35806), rgb(0xE08214), rgb(0xFDB863),
                                     rgb(0xFEE0B6), rgb(0xF7F7F7), rgb(0xD8DAEB), rgb(0xB2ABD2),
                                     rgb(0x8073AC), rgb(0x542788), rgb(0x2D004B)};
  return drawing::between(kSteps, t);
}

LayerStyle style_of(Layer layer) {
  if (layer == Layer::VerticalError) return {ValueKind::SignedLength, &orange_purple, false};
  const std::string_view unit = info(layer).unit;
  if (unit == "m") return {ValueKind::Length, &bright_inferno, true};
  if (unit == "s") return {ValueKind::Duration, &bright_inferno, true};
  if (layer >= Layer::Hdop && layer <= Layer::Vdop) return {ValueKind::Dop, &cividis, true};
  const bool good = more_is_better(layer);
  if (layer >= Layer::SatellitesLos && layer <= Layer::SatellitesBlocked)
    return {ValueKind::Count, &drawing::viridis, !good};
  return {ValueKind::Fraction, good ? &drawing::viridis : &cividis, !good};
}

double ColourScale::at(double value) const {
  if (std::isnan(value)) return 0;
  const auto eased = [this](double part) {
    return progression == Progression::SquareRoot ? std::sqrt(part) : part;
  };
  if (low < 0) return 0.5 + 0.5 * std::copysign(eased(std::min(std::abs(value) / high, 1.0)), value);
  if (progression == Progression::Logarithm)
    return value <= low ? 0 : std::min(std::log(value / low) / std::log(high / low), 1.0);
  return eased(std::clamp((value - low) / (high - low), 0.0, 1.0));
}

Colour ColourScale::colour_at(double position) const {
  double t = std::clamp(position, 0.0, 1.0);
  if (classes == 1) t = 0.5;
  if (classes > 1) t = std::min(std::floor(t * classes + 1e-9), classes - 1.0) / (classes - 1);
  return style.colours(style.large_is_bad ? 1 - t : t);
}

ColourScale make_colour_scale(Layer layer, const ValueCounts& values) {
  ColourScale scale;
  scale.style = style_of(layer);
  switch (scale.style.kind) {
    case ValueKind::Length:
    case ValueKind::SignedLength:
    case ValueKind::Duration:
      scale_lengths(scale, values);
      break;
    case ValueKind::Dop:
      scale_dops(scale, values);
      break;
    case ValueKind::Count:
      scale_counts(scale, values);
      return scale;
    case ValueKind::Fraction:
      scale_fractions(scale);
      return scale;
  }
  // A step beyond the end that is invisible in its colour is not marked.
  constexpr double kSlack = 1e-6;
  scale.below = values.count() > 0 && values.least() < scale.low - kSlack;
  scale.above = values.count() > 0 && values.greatest() > scale.high + kSlack;
  return scale;
}

}  // namespace canyon::heatmap
