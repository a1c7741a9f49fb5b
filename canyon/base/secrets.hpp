#pragma once

#include <string>
#include <string_view>

namespace canyon {

/// A text for people with "..." for each password of an address in it, and for the values of keys such as
/// "api_key", "token" and "password" in its query: "ntrip://user:...@host:2101/MOUNT" for
/// "ntrip://user:p@ss/word@host:2101/MOUNT". An address ends with a blank or a quotation mark. Where an
/// explanation writes USER:PASSWORD it stays. InputError does so with its problem and cure.
[[nodiscard]] std::string hide_passwords(std::string_view text);

}  // namespace canyon
