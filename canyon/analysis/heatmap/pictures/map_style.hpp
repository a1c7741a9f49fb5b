#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_summary.hpp"
#include "canyon/analysis/heatmap/kernels/layers.hpp"
#include "canyon/outputs/drawing/palette.hpp"

// Colours of a layer's values. Bright is good and dark is bad on every map, except on maps of signed values.
// This holds in colour, for colour-blind people and in grey.

namespace canyon::heatmap {

/// Matplotlib's inferno (Smith, van der Walt 2015, CC0), from black at 0 to pale yellow at 1, within 1.5 % of
/// it: uniform in lightness. `t` is clamped, NaN counts as 0.
[[nodiscard]] drawing::Colour inferno(double t);
/// Cividis (Nunez, Anderton, Renslow, PLoS ONE 13(7), 2018, e0199239), from dark blue at 0 to yellow at 1,
/// within 3.5 % of Matplotlib's table: looks the same with red-green colour blindness.
[[nodiscard]] drawing::Colour cividis(double t);
/// ColorBrewer's PuOr in 11 steps (Brewer, Harrower 2003), from orange at 0 over near-white to purple at 1:
/// for signed values. In grey it shows the magnitude, not the sign.
[[nodiscard]] drawing::Colour orange_purple(double t);

/// The kind of a layer's values, which determines scale and colours.
enum class ValueKind : std::uint8_t {
  Length,  ///< [m], from 0
  SignedLength,
  Duration,  ///< [s], from 0
  Dop,
  Count,     ///< of satellites: discrete steps
  Fraction,  ///< shown in per cent
};
struct LayerStyle {
  ValueKind kind = ValueKind::Length;
  drawing::Colour (*colours)(double) = &inferno;
  bool large_is_bad = false;  ///< the colour map runs from its bright end
};
[[nodiscard]] LayerStyle style_of(Layer layer);

/// Larger DOPs are drawn as this one: a fix with such a DOP is hardly usable.
inline constexpr double kMaxRenderedDop = 20;

/// Maps values to colours, and has the labels of the colour bar.
struct ColourScale {
  LayerStyle style;
  double low = 0, high = 1;  ///< of values, in the layer's unit
  /// The function of the value that is linear along the bar: the value itself, or its square root or
  /// logarithm if few values are far above the others.
  enum class Progression : std::uint8_t { Linear, SquareRoot, Logarithm };
  Progression progression = Progression::Linear;
  int classes = 0;                    ///< of a Count; 0: continuous
  double class_width = 1;             ///< of a Count
  bool below = false, above = false;  ///< values beyond the ends: drawn in the ends' colours
  std::string unit;                   ///< "m", "%" or empty
  /// Position 0 to 1 on the bar, and its label.
  std::vector<std::pair<double, std::string>> ticks;

  /// Position on the bar, clamped. NaN goes to 0.
  [[nodiscard]] double at(double value) const;
  /// The colour at a position on the bar: one colour for each class.
  [[nodiscard]] drawing::Colour colour_at(double position) const;
  [[nodiscard]] drawing::Colour colour(double value) const { return colour_at(at(value)); }
};

/// The scale for a layer's values: lengths from 0 to their 98th percentile, by the square root if it is more
/// than six times the median, signed ones to both sides; DOPs from about the least to the 98th percentile, at
/// most kMaxRenderedDop; counts from the least to the largest in at most ten classes of equal width;
/// fractions from 0 to 100 %. Ends are rounded outwards to round numbers.
/// @param values of a signed layer without their signs
[[nodiscard]] ColourScale make_colour_scale(Layer layer, const ValueCounts& values);

}  // namespace canyon::heatmap
