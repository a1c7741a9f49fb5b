#include "canyon/base/secrets.hpp"

#include <algorithm>

namespace canyon {

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
      shown += word;
    } else {
      shown += word.substr(0, std::min(word.find(':'), host));
      shown += ":...";
      shown += word.substr(host);
    }
    at = end;
  }
  return shown;
}

}  // namespace canyon
