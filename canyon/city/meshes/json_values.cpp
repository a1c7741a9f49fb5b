#include "canyon/city/meshes/json_values.hpp"

#include <fmt/format.h>

#include <cmath>

namespace canyon::meshes {
namespace {

constexpr double kMaxCount = 9e15;  // integers exact in doubles

[[noreturn]] void fail_member(std::string_view key, std::string_view wanted) {
  throw InputError(fmt::format("'{}' is not {}", key, wanted), "check the program that wrote it");
}

double finite_number(const Json& value, std::string_view key) {
  if (!value.is_number() || !std::isfinite(value.get<double>())) fail_member(key, "a finite number");
  return value.get<double>();
}

}  // namespace

std::uint64_t count_member(const Json& object, std::string_view key, std::optional<std::uint64_t> fallback) {
  const Json* found = object.find(key);
  if (found == nullptr) {
    if (fallback) return *fallback;
    throw InputError(fmt::format("'{}' is missing", key), "check the program that wrote it");
  }
  const double number = finite_number(*found, key);
  if (number < 0 || number > kMaxCount || std::floor(number) != number)
    fail_member(key, "a whole number of at least 0");
  return static_cast<std::uint64_t>(number);
}

double number_member(const Json& object, std::string_view key, std::optional<double> fallback) {
  const Json* found = object.find(key);
  if (found == nullptr && fallback) return *fallback;
  if (found == nullptr) fail_member(key, "there");
  return finite_number(*found, key);
}

std::vector<double> numbers_member(const Json& object, std::string_view key, std::size_t size) {
  const Json* found = object.find(key);
  if (found == nullptr) return {};
  if (!found->is_array() || found->size() != size)
    fail_member(key, fmt::format("a list of {} numbers", size));
  std::vector<double> values;
  values.reserve(size);
  for (const Json& item : *found) values.push_back(finite_number(item, key));
  return values;
}

std::string text_member(const Json& object, std::string_view key) {
  const Json* found = object.find(key);
  return found != nullptr && found->is_string() ? found->text() : std::string();
}

Eigen::Matrix4d matrix_member(const Json& object, std::string_view key) {
  const std::vector<double> values = numbers_member(object, key, 16);
  if (values.empty()) return Eigen::Matrix4d::Identity();
  Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix4d>(values.data());
  if (!matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-9)) fail_member(key, "an affine matrix");
  return matrix;
}

const Json& extension(const Json& object, std::string_view name) {
  static const Json kNone;
  const Json* all = object.find("extensions");
  const Json* found = all != nullptr ? all->find(name) : nullptr;
  return found != nullptr ? *found : kNone;
}

}  // namespace canyon::meshes
