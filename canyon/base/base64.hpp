#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace canyon {

/// RFC 4648, section 4, padded.
[[nodiscard]] std::string base64(std::string_view bytes);
/// The bytes of such a text, whose padding may lack; empty where a character is none of its digits.
[[nodiscard]] std::optional<std::string> from_base64(std::string_view text);

}  // namespace canyon
