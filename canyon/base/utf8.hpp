#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace canyon {

/// Bytes of the well-formed UTF-8 sequence at `at` (Unicode 15, table 3-7), 1 to 4; 0 where there is none.
[[nodiscard]] std::size_t utf8_length(std::string_view text, std::size_t at);
/// `text` with "?" for each byte that belongs to no such sequence.
[[nodiscard]] std::string valid_utf8(std::string_view text);
/// Characters that a UTF-8 text takes on a terminal, one column each.
[[nodiscard]] std::size_t display_width(std::string_view utf8);
/// valid_utf8() with &, <, >, " and ' escaped for XML text and attributes, without the characters that
/// XML 1.0 forbids.
[[nodiscard]] std::string xml_escaped(std::string_view text);

/// UTF-16 behind a byte order mark as UTF-8, piece by piece.
class Utf16Decoder {
 public:
  /// Whether bytes begin with the mark (FF FE or FE FF) and text: a quarter of the first characters or more
  /// is ASCII, as the marks and digits of every format are.
  [[nodiscard]] static bool is_marked(std::string_view head);

  /// @param head begins with the mark
  explicit Utf16Decoder(std::string_view head) : big_endian_(head.substr(0, 1) == "\xfe") {}

  /// Appends the next bytes; half a character waits for the next call. Half of a pair of surrogates becomes
  /// U+FFFD.
  void append(std::string_view bytes, std::string& utf8);

 private:
  bool big_endian_;
  std::string waiting_;     ///< one byte or none
  std::uint32_t high_ = 0;  ///< the first half of a pair of surrogates, or 0
};

/// A text in UTF-16 with its mark as UTF-8, in which an XML declaration says so; another text as it is.
[[nodiscard]] std::string utf8_of_marked(std::string text);
/// Makes an XML declaration at the begin of a text, which says UTF-16, say UTF-8.
void declare_utf8(std::string& text);

}  // namespace canyon
