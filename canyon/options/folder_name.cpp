#include "canyon/options/folder_name.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace canyon::options {

void check_folder_name(Visitor& v, std::string_view key, const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  });
  if (!plain || name.empty() || name.front() == '.' || name.size() > 60) {
    throw v.fault(key, fmt::format("'{}' cannot name a folder", name),
                  "use at most 60 letters, digits, '-', '_' and '.', a dot not first");
  }
}

}  // namespace canyon::options
