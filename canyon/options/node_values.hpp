#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "canyon/options/node.hpp"
#include "canyon/options/visitor.hpp"

// Values of a tree's nodes. Each throws InputError that names the place where a node has no such value.

namespace canyon::options {

/// The text of a single value.
[[nodiscard]] std::string read_scalar(const Node& node, const Place& place);
/// A text that is not blank.
[[nodiscard]] std::string read_text(const Node& node, const Place& place);
/// A list of texts, or a single one.
[[nodiscard]] std::vector<std::string> read_texts(const Node& node, const Place& place);
/// A number in the range; a fraction, or "none" for infinity, where the range allows them.
[[nodiscard]] double to_number(const std::string& text, const Range& range, const Place& place);
/// A list of numbers, or one text with blanks between them.
[[nodiscard]] std::vector<double> read_numbers(const Node& node, const Range& range, const Place& place);
/// Rows of numbers: a list of lists, or all numbers in one list or text, row by row.
[[nodiscard]] std::vector<std::vector<double>> read_rows(const Node& node, std::size_t columns,
                                                         const Range& range, const Place& place);
/// A Boolean in the words of YAML 1.1, or 1 and 0 where the document has these.
[[nodiscard]] bool read_boolean(const Node& node, const Place& place);
/// An existing file, relative to the document's folder. A name that ends in / may be a folder: who reads it
/// knows whether that will do.
[[nodiscard]] std::filesystem::path read_file(const std::string& text, const Place& place);
/// Refuses a text that is none of `known`, with the closest of these.
void require_word(const std::string& text, const std::vector<std::string>& known, const Place& place);
/// One of `words`.
[[nodiscard]] std::string read_word(const Node& node, const std::vector<std::string>& words,
                                    const Place& place);

}  // namespace canyon::options
