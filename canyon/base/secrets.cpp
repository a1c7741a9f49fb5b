#include "canyon/base/secrets.hpp"

#include <algorithm>

#include "canyon/base/text.hpp"

namespace canyon {
namespace {

/// Whether a key of an address's query stands for a secret: "api_key", "access_token", "sig".
bool is_secret(std::string_view key) {
  const std::string word = lower_case(key);
  const auto has = [&word](std::string_view part) { return word.find(part) != std::string::npos; };
  return word.ends_with("key") || has("token") || has("secret") || has("passw") || has("pwd") ||
         has("auth") || has("credential") || has("signature") || word == "sig" || word == "pass";
}

/// A host, path and query with "..." for the values of secret keys.
std::string hide_keys(std::string_view word) {
  const std::size_t query = word.find('?');
  if (query == std::string_view::npos) return std::string(word);
  std::string shown(word.substr(0, query));
  for (std::size_t at = query; at < word.size();) {
    const std::size_t end = std::min(word.find_first_of("&;#", at + 1), word.size());
    const std::string_view pair = word.substr(at, end - at);  // with the character before it
    const std::size_t equals = pair.find('=');
    const bool secret = equals != std::string_view::npos && is_secret(pair.substr(1, equals - 1));
    shown += secret ? pair.substr(0, equals + 1) : pair;
    if (secret) shown += "...";
    at = end;
  }
  return shown;
}

/// "user:" of "user:password"; empty of a word alone, which may be a token.
std::string_view user_of(std::string_view word) {
  const std::size_t colon = std::min(word.find(':'), lower_case(word).find("%3a"));
  return colon == std::string_view::npos ? std::string_view()
                                         : word.substr(0, colon + (word[colon] == ':' ? 1 : 3));
}

}  // namespace

std::string hide_passwords(std::string_view text) {
  constexpr std::string_view kScheme = "://", kExplained = "USER:PASSWORD";
  std::string shown;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = text.find(kScheme, at);
    if (begin == std::string_view::npos) return shown += text.substr(at);
    const std::size_t secret = begin + kScheme.size();
    const std::size_t end = std::min(text.find_first_of(" \t\r\n'\"`", secret), text.size());
    const std::string_view word = text.substr(secret, end - secret);
    const std::size_t host = word.rfind('@');
    shown += text.substr(at, secret - at);
    if (host == std::string_view::npos || word.find(kExplained) < host) {
      shown += hide_keys(word);
    } else {
      shown += user_of(word.substr(0, host));
      shown += "...";
      shown += hide_keys(word.substr(host));
    }
    at = end;
  }
  return shown;
}

}  // namespace canyon
