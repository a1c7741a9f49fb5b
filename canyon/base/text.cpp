#include "canyon/base/text.hpp"

#include <boost/locale/utf.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <clocale>
#include <cmath>
#include <iterator>
#include <utility>

namespace canyon {
namespace {

using Utf8 = boost::locale::utf::utf_traits<char>;

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/// The value of a sign, up to 15 digits and a point, the form of most numbers in files. Digits and power of
/// ten are exact doubles, so their quotient is the nearest double, as with strtod. Empty for any other text.
std::optional<double> plain_decimal(std::string_view text) {
  static constexpr std::array<double, 16> kPowers{1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                  1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  std::size_t i = 0;
  const bool negative = text[0] == '-';
  if (negative || text[0] == '+') ++i;
  std::uint64_t digits = 0;
  std::size_t count = 0, decimals = 0;
  bool point = false;
  for (; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '.' && !point) {
      point = true;
      continue;
    }
    if (c < '0' || c > '9' || ++count > 15) return std::nullopt;
    digits = 10 * digits + static_cast<std::uint64_t>(c - '0');
    if (point) ++decimals;
  }
  if (count == 0) return std::nullopt;
  const double value = static_cast<double>(digits) / kPowers[decimals];
  return negative ? -value : value;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

std::string markdown_line(const TextRow& cells) {
  std::string line = "|";
  for (const std::string& cell : cells) {
    if (!cell.empty()) line += ' ';
    for (const char c : cell) line += c == '|' ? std::string("\\|") : std::string(1, c);
    line += " |";
  }
  return line + '\n';
}

constexpr std::size_t kMark = 2;  // bytes

std::uint32_t unit(std::string_view bytes, std::size_t at, bool big_endian) {
  const auto first = static_cast<unsigned char>(bytes[at]),
             second = static_cast<unsigned char>(bytes[at + 1]);
  return big_endian ? std::uint32_t{first} << 8 | second : std::uint32_t{second} << 8 | first;
}

void append_character(std::uint32_t code, std::string& utf8) {
  Utf8::encode(code, std::back_inserter(utf8));
}

}  // namespace

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> pieces;
  for (;;) {
    const std::size_t at = text.find(separator);
    pieces.push_back(text.substr(0, at));
    if (at == std::string_view::npos) return pieces;
    text.remove_prefix(at + 1);
  }
}

std::vector<std::string_view> split_blanks(std::string_view text) {
  std::vector<std::string_view> pieces;
  std::size_t i = 0;
  while (i < text.size()) {
    while (i < text.size() && is_blank(text[i])) ++i;
    const std::size_t begin = i;
    while (i < text.size() && !is_blank(text[i])) ++i;
    if (i > begin) pieces.push_back(text.substr(begin, i - begin));
  }
  return pieces;
}

std::optional<double> parse_double(std::string_view text) {
  text = trim(text);
  // 63 characters hold any number written by a person or a fixed-column format.
  char buffer[64];
  if (text.empty() || text.size() >= sizeof buffer) return std::nullopt;
  if (const auto value = plain_decimal(text)) return value;
  std::size_t n = 0;
  for (char c : text) {
    if (c == 'D' || c == 'd') c = 'e';
    // Excludes strtod's hexadecimal floats, "nan" and "infinity".
    const bool plain = (c >= '0' && c <= '9') || c == '+' || c == '-' || c == '.' || c == 'e' || c == 'E';
    if (!plain) return std::nullopt;
    buffer[n++] = c;
  }
  buffer[n] = '\0';
  char* end = nullptr;
  errno = 0;
  // GCC 10 has no std::from_chars for double; strtod follows the program's locale, strtod_l does not.
  static const locale_t c_locale = newlocale(LC_ALL_MASK, "C", nullptr);
  const double value = strtod_l(buffer, &end, c_locale);
  if (end != buffer + n || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<long long> parse_integer(std::string_view text) {
  text = trim(text);
  // from_chars does not read a plus; a digit must follow it ("+-5" is not a number).
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  long long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

std::uint64_t fnv1a(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : text) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3U;
  }
  return hash;
}

std::string_view column(std::string_view text, std::size_t begin, std::size_t length) {
  return begin >= text.size() ? std::string_view() : text.substr(begin, length);
}

std::optional<std::string> closest(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string* best = nullptr;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best = &candidate;
      best_distance = distance;
    }
  }
  if (best == nullptr) return std::nullopt;
  return *best;
}

std::string did_you_mean(const std::optional<std::string>& meant, std::string_view otherwise) {
  return meant ? "did you mean '" + *meant + "'?" : std::string(otherwise);
}

std::string text_table(const TextRow& head, const std::vector<TextRow>& rows, const TextTableStyle& style) {
  struct Column {
    std::size_t width;
    bool left;
  };
  std::vector<Column> columns;
  std::size_t whole = 0;
  for (std::size_t c = 0; c < head.size(); ++c) {
    Column& column = columns.emplace_back(Column{display_width(head[c]), style.words && c < *style.words});
    for (const TextRow& row : rows) {
      if (c >= row.size()) continue;
      column.width = std::max(column.width, display_width(row[c]));
      const bool number = row[c].empty() || row[c] == "-" || parse_double(row[c]);
      if (!style.words && !number) column.left = true;
    }
    whole += column.width + (c > 0 ? 2 : 0);
  }
  std::string text;
  const auto add = [&](const TextRow& row) {
    text += style.indent;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string blanks(columns[c].width - display_width(row[c]), ' ');
      text += (c > 0 ? "  " : "") + (columns[c].left ? row[c] + blanks : blanks + row[c]);
    }
    text.resize(text.find_last_not_of(' ') + 1);
    text += '\n';
  };
  add(head);
  if (style.rule) text += style.indent + std::string(whole, '-') + '\n';
  for (const TextRow& row : rows) add(row);
  return text;
}

std::string markdown_table(const TextRow& head, const std::vector<TextRow>& rows) {
  std::string text = markdown_line(head) + '|';
  for (std::size_t c = 0; c < head.size(); ++c) text += "---|";
  text += '\n';
  for (const TextRow& row : rows) text += markdown_line(row);
  return text;
}

std::size_t utf8_length(std::string_view text, std::size_t at) {
  const auto* const begin = text.data() + std::min(at, text.size());
  const auto* next = begin;
  const auto code = Utf8::decode(next, text.data() + text.size());
  return boost::locale::utf::is_valid_codepoint(code) ? static_cast<std::size_t>(next - begin) : 0;
}

std::string valid_utf8(std::string_view text) {
  std::string valid;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(text, at);
    if (length == 0)
      valid += '?';
    else
      valid += text.substr(at, length);
    at += std::max<std::size_t>(1, length);
  }
  return valid;
}

std::size_t display_width(std::string_view utf8) {
  return static_cast<std::size_t>(std::count_if(utf8.begin(), utf8.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;  // continuation bytes have no width
  }));
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = 0; !from.empty() && (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

std::string xml_escaped(std::string_view text) {
  constexpr std::string_view kSpecial = "&<>\"'";
  constexpr std::array<std::string_view, 5> kEntities{"&amp;", "&lt;", "&gt;", "&quot;", "&apos;"};
  std::string escaped;
  for (const char c : valid_utf8(text)) {
    const std::size_t special = kSpecial.find(c);
    if (special != std::string_view::npos)
      escaped += kEntities[special];
    else if (static_cast<unsigned char>(c) >= 0x20 || c == '\t' || c == '\n')
      escaped += c;
  }
  return escaped;
}

bool Utf16Decoder::is_marked(std::string_view head) {
  const std::string_view mark = head.substr(0, kMark);
  const bool big_endian = mark == "\xfe\xff";
  if (!big_endian && mark != "\xff\xfe") return false;
  constexpr std::size_t kLooked = 512;
  std::size_t all = 0, ascii = 0;
  for (std::size_t at = kMark; at + 1 < head.size() && at < kLooked; at += 2) {
    const std::uint32_t code = unit(head, at, big_endian);
    if (code == 0) return false;  // UTF-32, or no text
    ++all;
    if ((code >= ' ' && code < 0x7f) || code == '\t' || code == '\r' || code == '\n') ++ascii;
  }
  return all > 0 && 4 * ascii >= all;
}

void Utf16Decoder::append(std::string_view bytes, std::string& utf8) {
  constexpr std::uint32_t kReplacement = 0xfffd;
  std::string joined;
  if (!waiting_.empty()) {
    joined = std::exchange(waiting_, {});
    joined += bytes;
    bytes = joined;
  }
  std::size_t at = 0;
  for (; at + 1 < bytes.size(); at += 2) {
    const std::uint32_t code = unit(bytes, at, big_endian_);
    const bool second = code >= 0xdc00 && code < 0xe000;
    const std::uint32_t high = std::exchange(high_, 0);
    if (high != 0 && second) {
      append_character(0x10000 + ((high - 0xd800) << 10) + (code - 0xdc00), utf8);
      continue;
    }
    if (high != 0) append_character(kReplacement, utf8);
    if (code >= 0xd800 && code < 0xdc00)
      high_ = code;
    else
      append_character(second ? kReplacement : code, utf8);
  }
  if (at < bytes.size()) waiting_ = bytes.substr(at);
}

std::string utf8_of_marked(std::string text) {
  if (!Utf16Decoder::is_marked(text)) return text;
  std::string utf8;
  utf8.reserve(text.size() / 2);
  Utf16Decoder(text).append(std::string_view(text).substr(kMark), utf8);
  declare_utf8(utf8);
  return utf8;
}

void declare_utf8(std::string& text) {
  if (!text.starts_with("<?xml")) return;
  const std::string declaration = lower_case(std::string_view(text).substr(0, text.find("?>")));
  constexpr std::string_view kName = "utf-16";
  const std::size_t at = declaration.find(kName);
  if (at == std::string::npos) return;
  const std::size_t end = declaration.find_first_of("\"'", at);
  if (end != std::string::npos) text.replace(at, end - at, "UTF-8");
}

}  // namespace canyon
