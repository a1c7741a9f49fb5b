#pragma once

#include <string>
#include <string_view>

namespace canyon {

/// A text for people with "..." for each password of an address in it, also where its scheme is missing or
/// misspelt, and for the values of keys such as "api_key", "token" and "password" in its query, of addresses
/// also for all values of eight letters and more: "ntrip://user:...@host:2101/MOUNT" for
/// "ntrip://user:p@ss/word@host:2101/MOUNT". An address ends with a blank or a quotation mark, in quotation
/// marks with the second one. Where an explanation writes USER:PASSWORD it stays. InputError does so with its
/// problem and cure.
[[nodiscard]] std::string hide_passwords(std::string_view text);

}  // namespace canyon
