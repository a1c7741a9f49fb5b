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

/// A whole decimal number; surrounding blanks are allowed. Always parsed in the C locale; Fortran's exponent
/// letter D is accepted. Empty for anything else, for nan and inf, and beyond double's range.
[[nodiscard]] std::optional<double> parse_double(std::string_view text);

/// A whole decimal integer; surrounding blanks are allowed. Empty for anything else and beyond long long.
[[nodiscard]] std::optional<long long> parse_integer(std::string_view text);

/// ASCII letters in lower case; other bytes, also UTF-8, are unchanged.
[[nodiscard]] std::string lower_case(std::string_view text);

/// FNV-1a hash, 64 bits: the same on every machine (Fowler, Noll, Vo).
[[nodiscard]] std::uint64_t fnv1a(std::string_view text);

/// Like `text.substr(begin, length)`, but shorter or empty at the end of the text: for fixed-column formats
/// whose lines may be truncated.
[[nodiscard]] std::string_view column(std::string_view text, std::size_t begin, std::size_t length);

/// The candidate closest to `word` (edit distance at most a third of its length, at least 2). Empty if none
/// is close.
[[nodiscard]] std::optional<std::string> closest(std::string_view word,
                                                 const std::vector<std::string>& candidates);
/// The hint "did you mean 'MEANT'?", or `otherwise` if `meant` is empty.
[[nodiscard]] std::string did_you_mean(const std::optional<std::string>& meant,
                                       std::string_view otherwise = {});

/// Cells of a line of a table, UTF-8; a row may be shorter than the head.
using TextRow = std::vector<std::string>;

struct TextTableStyle {
  /// Number of left columns that are aligned to the left; the others are aligned to the right. Empty: columns
  /// of numbers (and "-") to the right, all others to the left.
  std::optional<std::size_t> words = {};
  const char* indent = "";
  bool rule = false;  ///< a line of dashes below the header
};
/// A table for terminals, columns two blanks apart; each line ends with LF and has no leading blanks.
[[nodiscard]] std::string text_table(const TextRow& head, const std::vector<TextRow>& rows,
                                     const TextTableStyle& style = {});

/// A Markdown table; bars in cells are escaped.
[[nodiscard]] std::string markdown_table(const TextRow& head, const std::vector<TextRow>& rows);

/// Bytes of the well-formed UTF-8 sequence at `at` (Unicode 15, table 3-7), 1 to 4; 0 if there is none.
[[nodiscard]] std::size_t utf8_length(std::string_view text, std::size_t at);
/// `text` with "?" for each byte that is not part of such a sequence.
[[nodiscard]] std::string valid_utf8(std::string_view text);
/// Number of characters of a UTF-8 text, one terminal column each.
[[nodiscard]] std::size_t display_width(std::string_view utf8);
/// Replaces every `from` by `to`; does nothing for an empty `from`.
void replace_all(std::string& text, std::string_view from, std::string_view to);
/// valid_utf8() with &, <, >, " and ' escaped for XML text and attributes, without characters forbidden in
/// XML 1.0.
[[nodiscard]] std::string xml_escaped(std::string_view text);

/// Decodes UTF-16 with a byte order mark to UTF-8, piece by piece.
class Utf16Decoder {
 public:
  /// Whether bytes begin with the mark (FF FE or FE FF) and text: at least a quarter of the first characters
  /// is ASCII, because every format has ASCII markup and digits.
  [[nodiscard]] static bool is_marked(std::string_view head);

  /// @param head begins with the mark
  explicit Utf16Decoder(std::string_view head) : big_endian_(head.substr(0, 1) == "\xfe") {}

  /// Appends the next bytes; half a character is kept for the next call. Unpaired surrogates become U+FFFD.
  void append(std::string_view bytes, std::string& utf8);

 private:
  bool big_endian_;
  std::string waiting_;     ///< one byte or none
  std::uint32_t high_ = 0;  ///< the first half of a pair of surrogates, or 0
};

/// Converts UTF-16 text with its mark to UTF-8, also its XML declaration; returns other text unchanged.
[[nodiscard]] std::string utf8_of_marked(std::string text);
/// Replaces UTF-16 by UTF-8 in an XML declaration at the start of a text.
void declare_utf8(std::string& text);

}  // namespace canyon
