#pragma once

#include <cstdint>
#include <span>

#include "canyon/paths/propagation/paths.hpp"

namespace canyon::drawing {

/// sRGB, each 0 to 1.
struct Colour {
  double r = 0;
  double g = 0;
  double b = 0;
  double a = 1;

  [[nodiscard]] constexpr Colour with_alpha(double alpha) const { return {r, g, b, alpha}; }
};

/// The colour 0xRRGGBB.
[[nodiscard]] constexpr Colour rgb(unsigned hex) {
  return {static_cast<double>(hex >> 16 & 0xFFU) / 255, static_cast<double>(hex >> 8 & 0xFFU) / 255,
          static_cast<double>(hex & 0xFFU) / 255};
}

/// The colour as 0xRRGGBB, without its opacity.
[[nodiscard]] std::uint32_t packed(const Colour& c);

/// Interpolates between two colours; `t` is clamped to [0, 1].
[[nodiscard]] Colour mix(const Colour& from, const Colour& to, double t);
/// Interpolates along two or more evenly spaced colours.
[[nodiscard]] Colour between(std::span<const Colour> stops, double t);

/// Matplotlib's viridis (Smith, van der Walt 2015), from dark purple at 0 to yellow at 1, approximated within
/// 2 %: perceptually uniform, readable by colour-blind people and in grey.
[[nodiscard]] Colour viridis(double t);

/// Okabe and Ito's palette (Color Universal Design, 2008) for categories.
inline constexpr Colour kBlack = rgb(0x000000), kOrange = rgb(0xE69F00), kSkyBlue = rgb(0x56B4E9),
                        kGreen = rgb(0x009E73), kBlue = rgb(0x0072B2), kVermilion = rgb(0xD55E00),
                        kPurple = rgb(0xCC79A7);

/// Ink, lines and paper of all pictures.
inline constexpr Colour kInk = rgb(0x222222), kFaintInk = rgb(0x6B6B6B), kRule = rgb(0xD9D9D9),
                        kPaper = rgb(0xFFFFFF), kGround = rgb(0xF8F6F3), kLowRoof = rgb(0xE6E2DC),
                        kHighRoof = rgb(0x8D95A1), kNoFix = kVermilion;

/// The colour of a visibility in every picture (the shape of the mark differs too).
[[nodiscard]] Colour colour_of(propagation::Visibility visibility);

}  // namespace canyon::drawing
