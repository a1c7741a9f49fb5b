#include "adapters/gazebo_classic/resource_files.hpp"

#include <algorithm>
#include <cstdlib>
#include <gazebo/common/SystemPaths.hh>
#include <string_view>

#include "canyon/base/text.hpp"

namespace canyon::gazebo_classic {
namespace {

namespace fs = std::filesystem;

bool starts_with(const std::string& text, std::string_view start) {
  return text.compare(0, start.size(), start) == 0;
}

// package://NAME/REST lies in a folder NAME of ROS_PACKAGE_PATH, or in one of its entries that is called
// NAME.
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
                                      std::vector<fs::path>& looked) {
  std::vector<fs::path> candidates;
  auto* paths = gazebo::common::SystemPaths::Instance();
  if (starts_with(name, "model://")) {
    // Not FindFileURI(), which says nothing of where it looked.
    for (const std::string& folder : paths->GetModelPaths()) {
      if (!folder.empty()) candidates.push_back(fs::path(folder) / name.substr(8));
    }
  } else if (starts_with(name, "package://")) {
    candidates = package_candidates(name.substr(10));
  } else {
    const fs::path path(starts_with(name, "file://") ? name.substr(7) : name);
    if (path.is_absolute()) {
      candidates.push_back(path);
    } else {
      for (const fs::path& folder : folders) candidates.push_back(folder / path);
      for (const std::string& folder : paths->GetGazeboPaths()) {
        if (!folder.empty()) candidates.push_back(fs::path(folder) / path);
      }
    }
  }
  for (const fs::path& candidate : candidates) {
    if (std::find(looked.begin(), looked.end(), candidate) != looked.end()) continue;
    looked.push_back(candidate);
    std::error_code ignored;
    // Pipes are welcome (process substitution), folders are not.
    if (fs::exists(candidate, ignored) && !fs::is_directory(candidate, ignored))
      return fs::absolute(candidate, ignored);
  }
  return std::nullopt;
}

}  // namespace canyon::gazebo_classic
