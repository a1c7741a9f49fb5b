#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace canyon {

/// Cells of a line of a table, UTF-8; a row may be shorter than the head.
using TextRow = std::vector<std::string>;

struct TextTableStyle {
  /// Number of columns, from the left one on, that are aligned to the left; the others are aligned to the
  /// right. Empty: columns of numbers (and "-") to the right, all others to the left.
  std::optional<std::size_t> words = {};
  const char* indent = "";
  bool rule = false;  ///< a line of dashes below the head
};
/// A table for terminals, columns two blanks apart, each line with its end and without blanks before it.
[[nodiscard]] std::string text_table(const TextRow& head, const std::vector<TextRow>& rows,
                                     const TextTableStyle& style = {});

/// A table of Markdown; bars in cells are escaped.
[[nodiscard]] std::string markdown_table(const TextRow& head, const std::vector<TextRow>& rows);

}  // namespace canyon
