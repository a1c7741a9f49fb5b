#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"

namespace canyon::meshes {

// Members of JSON objects, checked against hostile files.
/// A member that is a count or index: a whole number of at least 0. `fallback` if it is not there. Throws
/// InputError for anything else, and if it is missing without a fallback.
[[nodiscard]] std::uint64_t count_member(const Json& object, std::string_view key,
                                         std::optional<std::uint64_t> fallback = {});

/// A finite number; `fallback` if it is not there. Throws InputError likewise.
[[nodiscard]] double number_member(const Json& object, std::string_view key,
                                   std::optional<double> fallback = {});

/// A list of exactly `size` finite numbers; empty if it is not there. Throws InputError for anything else.
[[nodiscard]] std::vector<double> numbers_member(const Json& object, std::string_view key, std::size_t size);

/// A text; empty if it is not there or of another type.
[[nodiscard]] std::string text_member(const Json& object, std::string_view key);

/// 16 numbers in column order; the identity if missing. Throws InputError for a matrix that is not affine
/// (last row 0, 0, 0, 1).
[[nodiscard]] Eigen::Matrix4d matrix_member(const Json& object, std::string_view key);

/// object.extensions[name]; null if it is not there.
[[nodiscard]] const Json& extension(const Json& object, std::string_view name);

/// Bytes [offset, offset + length) of `bytes`. Throws InputError if they are not all there.
[[nodiscard]] inline std::string_view piece(std::string_view bytes, std::uint64_t offset,
                                            std::uint64_t length) {
  if (offset > bytes.size() || length > bytes.size() - offset)
    throw InputError("the data end early", "get the file again");
  return bytes.substr(static_cast<std::size_t>(offset), static_cast<std::size_t>(length));
}

/// The little-endian number at a byte offset. Throws InputError likewise.
template <typename T>
[[nodiscard]] T little(std::string_view bytes, std::uint64_t offset) {
  T value;
  std::memcpy(&value, piece(bytes, offset, sizeof(T)).data(), sizeof(T));
  return value;
}

}  // namespace canyon::meshes
