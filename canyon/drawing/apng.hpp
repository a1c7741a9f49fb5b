#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "canyon/base/output_file.hpp"
#include "canyon/drawing/canvas.hpp"

namespace canyon::drawing {

/// Pixels of an opaque PNG. Throws std::runtime_error for bytes that are not one. Part of canyon::io.
[[nodiscard]] RgbImage decode_png(const std::string& png);
/// The image as PNG of 8-bit RGB; width and height of at least 1. Throws std::runtime_error where Cairo fails
/// (memory). Part of canyon::io.
[[nodiscard]] std::string encode_png(const RgbImage& image);

/// An animated PNG (Portable Network Graphics Specification, third edition, W3C 2025: acTL, fcTL and fdAT
/// chunks), played for ever. Readers that know no animation show the first frame. After it only the rectangle
/// that changed is stored. Memory: two frames. Part of canyon::io.
class AnimatedPng {
 public:
  /// @param path appears at commit(), whole or not at all
  /// @param frames as many as will be added, at least 1 (asserted)
  /// @param frame_s how long a frame is seen [s], rounded to milliseconds; [0.001, 65] (asserted)
  /// Throws InputError where the file cannot be made in its folder.
  AnimatedPng(std::filesystem::path path, std::uint32_t frames, double frame_s);

  /// @param png bytes of an opaque PNG, of the same size each time (asserted)
  /// Throws like OutputFile::write(), and std::runtime_error for bytes that are not a PNG.
  void add(const std::string& png);
  /// Call it after the last frame (asserted). Throws like OutputFile::commit().
  void commit();

 private:
  void chunk(const char* type, const std::string& data);
  void control(std::uint32_t width, std::uint32_t height, std::uint32_t x, std::uint32_t y);

  OutputFile file_;
  std::uint32_t frames_ = 1, added_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint16_t delay_ms_ = 500;
  RgbImage last_;
};

}  // namespace canyon::drawing
