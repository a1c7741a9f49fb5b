#include "canyon/simulation/motion/nmea_sentences.hpp"

#include <algorithm>
#include <cctype>
#include <optional>

namespace canyon::simulation {
namespace {

/// The text of a sentence before its checksum, where one holds. The two digits behind '*' end a sentence,
/// whatever a logger writes behind them.
std::optional<std::string_view> checked_body(std::string_view text) {
  const auto digit = [](char c) {
    const char lower = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (lower >= '0' && lower <= '9') return static_cast<unsigned>(lower - '0');
    return lower >= 'a' && lower <= 'f' ? static_cast<unsigned>(lower - 'a') + 10 : 256U;
  };
  unsigned sum = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '*' && at + 2 < text.size() && digit(text[at + 1]) * 16 + digit(text[at + 2]) == sum)
      return text.substr(0, at);
    sum ^= static_cast<unsigned char>(text[at]);
  }
  return std::nullopt;
}

/// Whether it was a sentence before it was damaged: bytes of other protocols between sentences are no text.
bool is_text(std::string_view bytes) {
  const auto printable = std::count_if(bytes.begin(), bytes.end(), [](unsigned char c) {
    return std::isprint(c) != 0 || c == '\r' || c == '\t';
  });
  return 4 * static_cast<std::size_t>(printable) > 3 * bytes.size();
}

}  // namespace

std::size_t each_nmea_sentence(std::string_view line, const std::function<void(const NmeaSentence&)>& each) {
  std::size_t damaged = 0;
  for (std::size_t at = line.find('$'); at != std::string_view::npos;) {
    const std::size_t next = line.find('$', at + 1);
    const std::string_view text = line.substr(at + 1, next - at - 1);
    if (const auto body = checked_body(text)) {
      each(NmeaSentence{split(*body, ','), true});
    } else if (is_text(text)) {
      const bool ended = next != std::string_view::npos || text.find('*') != std::string_view::npos;
      if (ended) {
        ++damaged;
      } else {
        each(NmeaSentence{split(trim(text), ','), false});
      }
    }
    at = next;
  }
  return damaged;
}

}  // namespace canyon::simulation
