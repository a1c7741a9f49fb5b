#pragma once

#include <string>
#include <string_view>

#include "canyon/options/visitor.hpp"

namespace canyon::options {

/// Checks names that become folders, and words in formats without quotes. Throws `v.fault(key)` unless `name`
/// is 1 to 60 letters, digits, '-', '_' and '.', a dot not first.
void check_folder_name(Visitor& v, std::string_view key, const std::string& name);

}  // namespace canyon::options
