#include "canyon/base/utf8.hpp"

#include <algorithm>
#include <array>
#include <boost/locale/utf.hpp>
#include <iterator>
#include <utility>

#include "canyon/base/text.hpp"

namespace canyon {

using Utf8 = boost::locale::utf::utf_traits<char>;

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
    if (length == 0) {
      valid += '?';
    } else {
      valid += text.substr(at, length);
    }
    at += std::max<std::size_t>(1, length);
  }
  return valid;
}

std::size_t display_width(std::string_view utf8) {
  return static_cast<std::size_t>(std::count_if(utf8.begin(), utf8.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;  // continuation bytes take no column
  }));
}

std::string xml_escaped(std::string_view text) {
  constexpr std::string_view kSpecial = "&<>\"'";
  constexpr std::array<std::string_view, 5> kEntities{"&amp;", "&lt;", "&gt;", "&quot;", "&apos;"};
  std::string escaped;
  for (const char c : valid_utf8(text)) {
    const std::size_t special = kSpecial.find(c);
    if (special != std::string_view::npos) {
      escaped += kEntities[special];
    } else if (static_cast<unsigned char>(c) >= 0x20 || c == '\t' || c == '\n') {
      escaped += c;
    }
  }
  return escaped;
}

namespace {

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
    if (code >= 0xd800 && code < 0xdc00) {
      high_ = code;
    } else {
      append_character(second ? kReplacement : code, utf8);
    }
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
