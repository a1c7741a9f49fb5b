#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace canyon {

/// The text without leading and trailing blanks (space, tab, CR, LF).
[[nodiscard]] std::string_view trim(std::string_view text);

/// Splits at every `separator`; "a,,b" gives three pieces, "" gives one empty piece. Pieces are not trimmed.
[[nodiscard]] std::vector<std::string_view> split(std::string_view text, char separator);

/// Pieces between runs of blanks; empty text gives no piece.
[[nodiscard]] std::vector<std::string_view> split_blanks(std::string_view text);

/// A whole decimal number, blanks around it allowed, in the C locale whatever the program's; Fortran's
/// exponent letter D is accepted. Empty for anything else, for nan and inf, and beyond double's range.
[[nodiscard]] std::optional<double> parse_double(std::string_view text);

/// A whole decimal integer, blanks around it allowed. Empty for anything else and beyond long long.
[[nodiscard]] std::optional<long long> parse_integer(std::string_view text);

/// ASCII letters in lower case; other bytes, UTF-8 among them, stay.
[[nodiscard]] std::string lower_case(std::string_view text);

/// FNV-1a hash, 64 bits: the same on every machine (Fowler, Noll, Vo).
[[nodiscard]] std::uint64_t fnv1a(std::string_view text);

/// `text.substr(begin, length)` that yields what there is of it, possibly nothing: for fixed-column formats
/// whose lines may be cut short.
[[nodiscard]] std::string_view column(std::string_view text, std::size_t begin, std::size_t length);

/// The candidate closest to `word` (edit distance at most a third of its length, at least 2): "did you mean"
/// for unknown keys and names. Empty where none is close.
[[nodiscard]] std::optional<std::string> closest(std::string_view word,
                                                 const std::vector<std::string>& candidates);

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
