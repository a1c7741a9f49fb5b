#pragma once

#include <cstddef>
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

}  // namespace canyon
