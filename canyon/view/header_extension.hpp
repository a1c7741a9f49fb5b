#pragma once

#include <filesystem>
#include <string>

#include "canyon/base/json.hpp"

namespace canyon::view {

/// Puts more into the header of the view in `folder`: a key with its value, and chunks, which take the place
/// of those of the same kinds that are there. Throws InputError where the folder has no view or does not take
/// the file.
void extend_header(const std::filesystem::path& folder, const std::string& key, const Json& value,
                   const Json& chunks);

}  // namespace canyon::view
