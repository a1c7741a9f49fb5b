#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/png_pixels.hpp"

namespace canyon::test {

/// An animated PNG taken apart by the PNG specification (W3C, third edition): chunk by chunk with their CRCs
/// and sequence numbers, each frame decoded by libpng from a PNG of its own and laid over those before it.
/// Fails the test where something is against it.
class ApngFrames {
 public:
  struct Control {
    std::uint32_t width = 0, height = 0, x = 0, y = 0;
    double delay_s = 0;
  };
  struct Frame {
    std::uint32_t width = 0, height = 0;
    std::vector<std::uint32_t> pixels;  ///< 0xRRGGBB, rows from the top
  };

  explicit ApngFrames(const std::string& file) { take_apart(file); }

  [[nodiscard]] std::uint32_t plays() const { return plays_; }
  [[nodiscard]] std::size_t data_chunks() const { return data_chunks_; }
  [[nodiscard]] const std::vector<Control>& controls() const { return controls_; }
  /// The frames as a viewer shows them.
  [[nodiscard]] const std::vector<Frame>& frames() const { return frames_; }

 private:
  void take_apart(const std::string& file) {
    EXPECT_EQ(file.substr(0, 8), kSignature);
    std::uint32_t announced = 0, sequence = 0;
    bool ended = false;
    for (std::size_t at = 8; at < file.size();) {
      ASSERT_LE(at + 12, file.size());
      const std::uint32_t length = number(file, at);
      ASSERT_LE(at + 12 + length, file.size());
      const std::string type = file.substr(at + 4, 4), data = file.substr(at + 8, length);
      EXPECT_EQ(number(file, at + 8 + length), checksum(type + data)) << type;
      EXPECT_FALSE(ended);
      at += 12 + length;
      if (type == "IHDR") {
        header_ = data;
        screen_ = {number(data, 0), number(data, 4), {}};
        screen_.pixels.resize(std::size_t{screen_.width} * screen_.height, kUnpainted);
      } else if (type == "acTL") {
        EXPECT_TRUE(controls_.empty());
        announced = number(data, 0);
        plays_ = number(data, 4);
      } else if (type == "fcTL") {
        ASSERT_EQ(data.size(), 26U);
        EXPECT_EQ(number(data, 0), sequence++);
        finish_frame();
        const std::uint32_t delay = number(data, 20);
        controls_.push_back({number(data, 4), number(data, 8), number(data, 12), number(data, 16),
                             static_cast<double>(delay >> 16) / (delay & 0xFFFFU)});
        EXPECT_EQ(data[24], 0);  // leave the frame
        EXPECT_EQ(data[25], 0);  // replace
      } else if (type == "IDAT") {
        EXPECT_EQ(controls_.size(), 1U);
        compressed_ += data;
        ++data_chunks_;
      } else if (type == "fdAT") {
        EXPECT_GT(controls_.size(), 1U);
        EXPECT_EQ(number(data, 0), sequence++);
        compressed_ += data.substr(4);
        ++data_chunks_;
      } else {
        EXPECT_EQ(type, "IEND");
        ended = true;
      }
    }
    finish_frame();
    EXPECT_TRUE(ended);
    EXPECT_EQ(announced, frames_.size());
  }

  inline static const std::string kSignature{"\x89PNG\r\n\x1a\n", 8};
  static constexpr std::uint32_t kUnpainted = 0x01000000;

  static std::uint32_t number(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes.at(at + i));
    return value;
  }
  static std::string bytes_of(std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xFFU);
    return bytes;
  }
  static std::uint32_t checksum(const std::string& body) {
    return static_cast<std::uint32_t>(
        crc32(0, reinterpret_cast<const unsigned char*>(body.data()), static_cast<unsigned>(body.size())));
  }
  static std::string chunk(const std::string& type, const std::string& data) {
    return bytes_of(static_cast<std::uint32_t>(data.size())) + type + data + bytes_of(checksum(type + data));
  }

  void finish_frame() {
    if (controls_.empty()) return;
    const Control& control = controls_.back();
    const std::string header = bytes_of(control.width) + bytes_of(control.height) + header_.substr(8);
    const PngPixels part(kSignature + chunk("IHDR", header) + chunk("IDAT", compressed_) + chunk("IEND", ""));
    compressed_.clear();
    EXPECT_EQ(part.width(), static_cast<int>(control.width));
    EXPECT_EQ(part.height(), static_cast<int>(control.height));
    ASSERT_LE(control.x + control.width, screen_.width);
    ASSERT_LE(control.y + control.height, screen_.height);
    for (std::uint32_t y = 0; y < control.height; ++y) {
      for (std::uint32_t x = 0; x < control.width; ++x) {
        screen_.pixels[std::size_t{control.y + y} * screen_.width + control.x + x] =
            part.pixel(static_cast<int>(x), static_cast<int>(y));
      }
    }
    frames_.push_back(screen_);
  }

  std::string header_, compressed_;
  std::uint32_t plays_ = 0;
  std::size_t data_chunks_ = 0;
  std::vector<Control> controls_;
  std::vector<Frame> frames_;
  Frame screen_;
};

}  // namespace canyon::test
