#include "canyon/base/named_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "canyon/base/input_error.hpp"

namespace canyon {

namespace fs = std::filesystem;

bool lies_beside(const fs::path& path, const fs::path& by, const fs::path& other) {
  std::error_code error;
  const auto whole = [&error](const fs::path& any) {
    return fs::weakly_canonical(fs::absolute(any, error), error);
  };
  const fs::path file = whole(path);
  const auto is_about = [&](const fs::path& of) {
    fs::path folder = whole(other.empty() ? of.parent_path() : (of.parent_path() / other).lexically_normal());
    if (!folder.has_filename()) folder = folder.parent_path();
    return !error &&
           std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first == folder.end();
  };
  return !error && (is_about(fs::absolute(by, error)) || is_about(whole(by)));
}

fs::path file_named_by(const fs::path& by, std::string_view name) {
  constexpr std::string_view kScheme = "file://";
  if (name.starts_with(kScheme)) name.remove_prefix(kScheme.size());
  fs::path path = by.parent_path() / name;
  if (!lies_beside(path, by))
    throw InputError(by, 0, fmt::format("names '{}', which lies outside the folder of this file", name),
                     "put it into the folder, and name it from there");
  return path;
}

}  // namespace canyon
