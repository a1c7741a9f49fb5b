#pragma once

#include <cstdint>
#include <cstring>
#include <string_view>

#include "canyon/base/input_error.hpp"

namespace canyon::meshes {

/// Bytes [offset, offset + length) of `bytes`. Throws InputError where they are not all there.
[[nodiscard]] inline std::string_view piece(std::string_view bytes, std::uint64_t offset,
                                            std::uint64_t length) {
  if (offset > bytes.size() || length > bytes.size() - offset) {
    throw InputError("the data end early", "get the file again");
  }
  return bytes.substr(static_cast<std::size_t>(offset), static_cast<std::size_t>(length));
}

/// The little-endian number at a byte. Throws InputError likewise.
template <typename T>
[[nodiscard]] T little(std::string_view bytes, std::uint64_t offset) {
  T value;
  std::memcpy(&value, piece(bytes, offset, sizeof(T)).data(), sizeof(T));
  return value;
}

}  // namespace canyon::meshes
