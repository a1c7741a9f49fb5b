#pragma once

#include <string>
#include <string_view>

#include "canyon/options/node.hpp"

// Trees of settings, changed at a place and written on one line.

namespace canyon::options {

/// Puts `value` at a dotted key of `root`, in place of what stands there: "city.synthetic.seed",
/// "receivers[0].profile" (the first), "receivers[car].profile" (the one whose name is car),
/// "receivers[].elevation_mask_deg" (each). Sections that are missing are made, in the line of `value`; so is
/// the first item of a list that is missing. Throws InputError, without a file, for an item that is not there
/// and for a way through a value that is not a section.
void set_at(Node& root, std::string_view key, const Node& value);

/// The tree with keys that have dots in them as sections: "clock.bias_s: 1" is "clock: {bias_s: 1}". Keys of
/// one section at several places are gathered in it. Throws InputError where a key comes twice, or is a
/// section and a value as well.
[[nodiscard]] Node without_dots(const Node& root, const Document& document);

/// Moves values of Document::other_names to the keys that they are other names of. Throws InputError where a
/// key stands by both.
void use_keys(Node& root, const Document& document);

/// The key as options::Key::path has it: items of lists as "[]".
[[nodiscard]] std::string plain_key(std::string_view key);

/// YAML in flow style on one line: {profile: ublox-m8t, name: car}. Equal for equal trees and for no others.
[[nodiscard]] std::string flow_text(const Node& node);

[[nodiscard]] Node scalar_node(std::string text, int line = 0);

}  // namespace canyon::options
