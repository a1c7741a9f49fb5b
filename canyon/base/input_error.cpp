#include "canyon/base/input_error.hpp"

#include <algorithm>

#include "canyon/base/text.hpp"

namespace canyon {
namespace {

std::string message(const std::string& file, int line, std::string_view problem, std::string_view hint) {
  std::string text;
  if (!file.empty()) {
    text += file;
    if (line > 0) text += ":" + std::to_string(line);
    text += ": ";
  }
  text += problem;
  if (!hint.empty()) {
    text += "; ";
    text += hint;
  }
  return text;
}

/// UTF-8 for a terminal, with '?' for control characters.
std::string printable(std::string_view bytes) {
  std::string text = valid_utf8(bytes);
  std::replace_if(
      text.begin(), text.end(),
      [](char c) { return (c >= 0 && c < ' ' && c != '\n' && c != '\t') || c == 0x7f; }, '?');
  return text;
}

/// Whether a key of an address's query is for a secret: "api_key", "access_token", "sig".
bool is_secret(std::string_view key) {
  const std::string word = lower_case(key);
  const auto has = [&word](std::string_view part) { return word.find(part) != std::string::npos; };
  return word.ends_with("key") || has("token") || has("secret") || has("passw") || has("pwd") ||
         has("auth") || has("credential") || has("signature") || word == "sig" || word == "pass";
}

/// A host, path and query with "..." for the values of secret keys. @param all for an address: a long value
/// of any key may be a session or a signature
std::string hide_keys(std::string_view word, bool all) {
  constexpr std::size_t kLong = 8;
  const std::size_t query = word.find_first_of("?;#");
  if (query == std::string_view::npos) return std::string(word);
  std::string shown(word.substr(0, query));
  for (std::size_t at = query; at < word.size();) {
    const std::size_t end = std::min(word.find_first_of("?&;#", at + 1), word.size());
    const std::string_view pair = word.substr(at, end - at);  // with the character before it
    const std::size_t equals = pair.find('=');
    const bool secret = equals != std::string_view::npos &&
                        (is_secret(pair.substr(1, equals - 1)) || (all && pair.size() - equals > kLong));
    shown += secret ? pair.substr(0, equals + 1) : pair;
    if (secret) shown += "...";
    at = end;
  }
  return shown;
}

/// "user:" of "user:password"; empty for a single word, which may be a token, and for a mail address.
std::string_view user_of(std::string_view word) {
  const std::size_t colon = std::min(word.find(':'), lower_case(word).find("%3a"));
  const std::string_view user = word.substr(0, colon);
  const bool mail = user.find('@') != std::string_view::npos || user.find("%40") != std::string_view::npos;
  return colon == std::string_view::npos || mail ? std::string_view()
                                                 : word.substr(0, colon + (word[colon] == ':' ? 1 : 3));
}

/// The same for a word without its scheme: "user:...@host" of "user:password@host".
std::string hide_without_scheme(std::string_view word) {
  const std::size_t host = word.rfind('@'), colon = word.find(':');
  if (host == std::string_view::npos || colon >= host) return hide_keys(word, false);
  // In "serial:/dev/ttyS0@9600" the number is a baud rate.
  const bool rate = word.find_first_not_of("0123456789", host + 1) == std::string_view::npos;
  if (rate) return std::string(word);
  return std::string(user_of(word.substr(0, host))) + "..." + hide_keys(word.substr(host), false);
}

/// A word of a text that may be an address.
std::string hide_in(std::string_view word) {
  constexpr std::string_view kScheme = "://", kExplained = "USER:PASSWORD";
  if (word.find(kExplained) != std::string_view::npos) return std::string(word);
  const std::size_t begin = word.find(kScheme);
  if (begin == std::string_view::npos) return hide_without_scheme(word);
  const std::string_view address = word.substr(begin + kScheme.size());
  const std::size_t host = address.rfind('@');
  std::string shown(word.substr(0, begin + kScheme.size()));
  if (host == std::string_view::npos) return shown + hide_keys(address, true);
  shown += user_of(address.substr(0, host));
  return shown + "..." + hide_keys(address.substr(host), true);
}

/// The end of a quotation that begins with a quotation mark at `at`, whose words may be one address; `at` if
/// no quotation begins there.
std::size_t quotation_end(std::string_view text, std::size_t at) {
  constexpr std::size_t kMax = 2000;
  const bool opens =
      at == 0 || std::string_view(" \t\r\n([{=,:").find(text[at - 1]) != std::string_view::npos;
  const std::size_t end = text.find(text[at], at + 1);
  if (!opens || end == std::string_view::npos || end - at > kMax) return at;
  const std::string_view inside = text.substr(at + 1, end - at - 1);
  return inside.find('\n') == std::string_view::npos && inside.find('@') != std::string_view::npos ? end : at;
}

}  // namespace

Error::Error(std::string_view problem, std::string_view hint)
    : Error(std::filesystem::path(), 0, problem, hint) {}

Error::Error(const std::filesystem::path& file, int line, std::string_view problem, std::string_view hint)
    : std::runtime_error(printable(hide_passwords(message(file.string(), line, problem, hint)))),
      file_(file.string()),
      line_(line),
      problem_(hide_passwords(problem)),
      hint_(hide_passwords(hint)) {}

std::string hide_passwords(std::string_view text) {
  constexpr std::string_view kQuotes = "'\"`", kEnds = " \t\r\n'\"`";
  std::string shown;
  for (std::size_t at = 0; at < text.size();) {
    if (kQuotes.find(text[at]) != std::string_view::npos) {
      const std::size_t end = quotation_end(text, at);
      shown += text[at];
      if (end > at) {
        shown += hide_in(text.substr(at + 1, end - at - 1));
        shown += text[end];
      }
      at = end + 1;
      continue;
    }
    const std::size_t end = std::min(text.find_first_of(kEnds, at), text.size());
    shown += end > at ? hide_in(text.substr(at, end - at)) : std::string(1, text[at]);
    at = std::max(end, at + 1);
  }
  return shown;
}

}  // namespace canyon
