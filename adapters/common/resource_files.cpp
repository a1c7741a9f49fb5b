#include "adapters/common/resource_files.hpp"

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "canyon/base/text.hpp"

namespace canyon::adapters {
namespace {

namespace fs = std::filesystem;

// package://NAME/REST is in a folder NAME of ROS_PACKAGE_PATH, or in an entry of it named NAME.
std::vector<fs::path> package_candidates(const std::string& rest) {
  std::vector<fs::path> candidates;
  const char* paths = std::getenv("ROS_PACKAGE_PATH");
  if (paths == nullptr) return candidates;
  const std::string package = rest.substr(0, rest.find('/'));
  for (const std::string_view entry : split(paths, ':')) {
    if (entry.empty()) continue;
    const fs::path folder(entry);
    candidates.push_back(folder / rest);
    if (folder.filename() == package) candidates.push_back(folder.parent_path() / rest);
  }
  return candidates;
}

}  // namespace

std::optional<fs::path> find_resource(const std::string& name, const std::vector<fs::path>& folders,
                                      const ResourcePaths& paths, std::vector<fs::path>& looked) {
  std::vector<fs::path> candidates;
  if (name.starts_with("model://")) {
    for (const fs::path& folder : paths.models) candidates.push_back(folder / name.substr(8));
  } else if (name.starts_with("package://")) {
    candidates = package_candidates(name.substr(10));
  } else {
    const fs::path path(name.starts_with("file://") ? name.substr(7) : name);
    if (path.is_absolute()) {
      candidates.push_back(path);
    } else {
      for (const fs::path& folder : folders) candidates.push_back(folder / path);
      for (const fs::path& folder : paths.resources) candidates.push_back(folder / path);
    }
  }
  for (const fs::path& candidate : candidates) {
    if (std::find(looked.begin(), looked.end(), candidate) != looked.end()) continue;
    looked.push_back(candidate);
    std::error_code ignored;
    // Pipes are accepted (process substitution), folders are not.
    if (fs::exists(candidate, ignored) && !fs::is_directory(candidate, ignored))
      return fs::absolute(candidate, ignored);
  }
  return std::nullopt;
}

}  // namespace canyon::adapters
