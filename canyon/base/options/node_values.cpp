// Declared in canyon/base/options/node.hpp.
#include "canyon/base/options/node.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>

#include "canyon/base/named.hpp"

namespace canyon::options {
namespace {

constexpr const char* kOneValue = "write one value";

std::optional<double> parse_fraction(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const auto above = parse_double(text.substr(0, slash));
  const auto below = parse_double(text.substr(slash + 1));
  if (!above || !below || *below == 0) return std::nullopt;
  return *above / *below;
}

}  // namespace

std::string read_scalar(const Node& node, const Place& place) {
  if (node.kind == Node::Kind::Empty)
    throw place.error("has no value", "write one after the colon, or remove the key");
  if (node.kind != Node::Kind::Scalar) {
    throw place.error(node.kind == Node::Kind::Mapping ? "is a mapping where one value belongs"
                                                       : "is a list where one value belongs",
                      kOneValue);
  }
  return node.text;
}

std::string read_text(const Node& node, const Place& place) {
  std::string text = read_scalar(node, place);
  if (trim(text).empty()) throw place.error("is empty", "write something, or remove the key");
  return text;
}

std::vector<std::string> read_texts(const Node& node, const Place& place) {
  if (node.kind != Node::Kind::List) return {read_text(node, place)};
  std::vector<std::string> texts;
  for (const Node& item : node.items) {
    if (item.kind != Node::Kind::Scalar || trim(item.text).empty()) {
      Place at = place;
      if (item.line > 0) at.line = item.line;
      throw at.error(fmt::format("item {} is not one value", texts.size() + 1), kOneValue);
    }
    texts.push_back(item.text);
  }
  if (texts.empty()) throw place.error("the list is empty", "give at least one item, or remove the key");
  return texts;
}

double to_number(const std::string& text, const Range& range, const Place& place) {
  if (range.none && text == "none") return std::numeric_limits<double>::infinity();
  std::optional<double> value = parse_double(text);
  if (!value && range.fraction) value = parse_fraction(text);
  if (!value) {
    // "10 deg", "2m": a number with its unit.
    const std::size_t end = text.find_first_not_of("+-.0123456789eE");
    const bool has_unit =
        end != std::string::npos && end > 0 && parse_double(text.substr(0, end)).has_value();
    throw place.error(
        fmt::format("'{}' is not a number", text),
        has_unit ? fmt::format("give the number alone, the unit is in the {}'s name", place.document.word)
                 : fmt::format("it is {}", range.words()));
  }
  if (!range.holds(*value)) {
    throw place.error(fmt::format("{} is out of range", text), fmt::format("it is {}", range.words()));
  }
  return *value;
}

std::vector<double> read_numbers(const Node& node, const Range& range, const Place& place) {
  std::vector<double> values;
  if (node.kind == Node::Kind::List) {
    for (const std::string& item : read_texts(node, place)) values.push_back(to_number(item, range, place));
    return values;
  }
  const std::string line = read_scalar(node, place);
  for (const std::string_view item : split_blanks(line)) {
    values.push_back(to_number(std::string(item), range, place));
  }
  if (values.empty()) throw place.error("the list is empty", "give at least one number, or remove the key");
  return values;
}

std::vector<std::vector<double>> read_rows(const Node& node, std::size_t columns, const Range& range,
                                           const Place& place) {
  std::vector<std::vector<double>> rows;
  if (node.kind == Node::Kind::List && !node.items.empty() && node.items[0].kind == Node::Kind::List) {
    for (const Node& row : node.items) {
      std::vector<double> values;
      for (const Node& item : row.items) {
        values.push_back(to_number(item.kind == Node::Kind::Scalar ? item.text : "?", range, place));
      }
      if (values.size() != columns) {
        Place at = place;
        if (row.line > 0) at.line = row.line;
        throw at.error(fmt::format("row {} does not have {} numbers", rows.size() + 1, columns));
      }
      rows.push_back(std::move(values));
    }
    return rows;
  }
  const std::vector<double> flat = read_numbers(node, range, place);
  if (flat.size() % columns != 0) {
    throw place.error(fmt::format("{} numbers do not make rows of {}", flat.size(), columns));
  }
  for (std::size_t i = 0; i < flat.size(); i += columns) {
    const auto begin = flat.begin() + static_cast<std::ptrdiff_t>(i);
    rows.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(columns));
  }
  return rows;
}

bool read_boolean(const Node& node, const Place& place) {
  const std::string text = read_text(node, place);
  const std::string small = lower_case(text);
  if (place.document.digits_are_booleans) {
    if (small == "true" || small == "1") return true;
    if (small == "false" || small == "0") return false;
    throw place.error(fmt::format("'{}' is neither true nor false", text), "write true, false, 1 or 0");
  }
  // YAML 1.1's words: in small letters, in capitals, or with a capital first.
  const bool one_case = text.substr(1) == small.substr(1) || text == [&] {
    std::string large = small;
    for (char& c : large) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    return large;
  }();
  const auto is = [&](std::initializer_list<std::string_view> words) {
    return one_case && std::find(words.begin(), words.end(), small) != words.end();
  };
  if (is({"true", "yes", "on", "y"})) return true;
  if (is({"false", "no", "off", "n"})) return false;
  throw place.error(fmt::format("'{}' is neither true nor false", text), "write true or false");
}

std::filesystem::path read_file(const std::string& text, const Place& place) {
  if (place.document.find_file) return place.document.find_file(text, place);
  std::filesystem::path path = place.document.file.parent_path() / text;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    throw place.error(
        fmt::format("there is no file '{}'", path.string()),
        text.find("://") != std::string::npos
            ? std::string(
                  "it is an address: fetch the file first; of 3D Tiles, write city: {tiles: {url: ...}}")
            : fmt::format("paths are relative to the {}'s folder", place.document.kind));
  }
  const bool meant = !text.empty() && text.back() == '/';
  if (std::filesystem::is_directory(path, ignored) && !meant) {
    throw place.error(fmt::format("'{}' is a folder, not a file", path.string()),
                      "where a folder is meant, its name ends in /");
  }
  return path;
}

void require_word(const std::string& text, const std::vector<std::string>& known, const Place& place) {
  if (std::find(known.begin(), known.end(), text) != known.end()) return;
  throw place.error(fmt::format("'{}' is unknown", text), known_names(text, known));
}

std::string read_word(const Node& node, const std::vector<std::string>& words, const Place& place) {
  std::string text = read_text(node, place);
  require_word(text, words, place);
  return text;
}

}  // namespace canyon::options
