#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

namespace canyon::view {

/// Puts more into the header of the view in `folder`: a key with its value, and chunks, which take the place
/// of those of the same kinds that are there. Throws InputError where the folder has no view or does not take
/// the file.
void extend_header(const std::filesystem::path& folder, const std::string& key,
                   const nlohmann::ordered_json& value, const nlohmann::ordered_json& chunks);

}  // namespace canyon::view
