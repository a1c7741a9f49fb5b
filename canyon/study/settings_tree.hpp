#pragma once

#include <string>
#include <string_view>

#include "canyon/options/node.hpp"

// Trees of settings, changed at a place and written on one line.

namespace canyon::study {

/// Puts `value` at a dotted key of `root`, in place of what stands there: "city.synthetic.seed",
/// "receivers[0].profile" (the first), "receivers[car].profile" (the one whose name is car),
/// "receivers[].elevation_mask_deg" (each). Sections that are missing are made; so is the first item of a
/// list that is missing. Throws InputError, without a file, for an item that is not there and for a way
/// through a value that is not a section.
void set_at(options::Node& root, std::string_view key, const options::Node& value);

/// The key as options::Key::path has it: items of lists as "[]".
[[nodiscard]] std::string plain_key(std::string_view key);

/// YAML in flow style on one line: {profile: ublox-m8t, name: car}. Equal for equal trees and for no others.
[[nodiscard]] std::string flow_text(const options::Node& node);

[[nodiscard]] options::Node scalar_node(std::string text, int line = 0);

}  // namespace canyon::study
