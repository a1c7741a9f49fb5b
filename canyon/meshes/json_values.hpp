#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "canyon/base/json.hpp"

// Members of JSON objects with the checks that hostile files need.

namespace canyon::meshes {

/// A member that counts or points: a whole number of at least 0. `fallback` where it is not there. Throws
/// InputError for anything else, and where it is missing without a fallback.
[[nodiscard]] std::uint64_t count_member(const Json& object, std::string_view key,
                                         std::optional<std::uint64_t> fallback = {});

/// A finite number; `fallback` where it is not there. Throws InputError likewise.
[[nodiscard]] double number_member(const Json& object, std::string_view key,
                                   std::optional<double> fallback = {});

/// A list of exactly `size` finite numbers; empty where it is not there. Throws InputError for anything else.
[[nodiscard]] std::vector<double> numbers_member(const Json& object, std::string_view key, std::size_t size);

/// A text; empty where it is not there or of another type.
[[nodiscard]] std::string text_member(const Json& object, std::string_view key);

/// 16 numbers in order of columns; the identity where they are not there. Throws InputError for a matrix that
/// is not affine (last row 0, 0, 0, 1).
[[nodiscard]] Eigen::Matrix4d matrix_member(const Json& object, std::string_view key);

/// object.extensions[name]; null where it is not there.
[[nodiscard]] const Json& extension(const Json& object, std::string_view name);

}  // namespace canyon::meshes
