// Declared in canyon/city/mesh_file_format.hpp.
// check_ply(). Format: Greg Turk, "The PLY Polygon File Format", 1994.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_file_format.hpp"

namespace canyon::city {
namespace {

constexpr std::string_view kPlyCutShort = "export or copy it again: it is cut short";
constexpr std::string_view kPlyDamaged = "export or copy it again: it is damaged";

enum class PlyType : std::uint8_t { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float, Double };

std::optional<PlyType> ply_type(std::string_view word) {
  constexpr std::array<std::array<std::string_view, 2>, 8> kNames{{{"char", "int8"},
                                                                   {"uchar", "uint8"},
                                                                   {"short", "int16"},
                                                                   {"ushort", "uint16"},
                                                                   {"int", "int32"},
                                                                   {"uint", "uint32"},
                                                                   {"float", "float32"},
                                                                   {"double", "float64"}}};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (word == kNames[i][0] || word == kNames[i][1]) return static_cast<PlyType>(i);
  return std::nullopt;
}

std::size_t size_of(PlyType type) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

struct PlyProperty {
  std::string name;
  std::optional<PlyType> count;  ///< of a list
  PlyType type = PlyType::Float;
};

struct PlyElement {
  std::string name;
  std::uintmax_t count = 0;
  std::vector<PlyProperty> properties;
};

class PlyCheck {
 public:
  explicit PlyCheck(const std::filesystem::path& path) : path_(path), in_(path, std::ios::binary) {
    std::error_code error;
    size_ = std::filesystem::file_size(path, error);
  }

  std::vector<std::string> check() {
    if (!read_header()) return {};
    for (const PlyElement& element : elements_)
      if (element.name == "vertex") vertices_ = element.count;
    for (const PlyElement& element : elements_) {
      for (std::uintmax_t i = 0; i < element.count; ++i) check_one(element, i);
    }
    note_the_rest();
    return std::move(notes_);
  }

 private:
  /// False where the file is not PLY; Assimp then says what is wrong.
  bool read_header() {
    for (std::string line; std::getline(in_, line);) {
      ++line_;
      const auto words = split_blanks(line);
      if (line_ == 1 && trim(line) != "ply") return false;
      if (words.empty()) continue;
      if (words[0] == "end_header") {
        check_sizes();
        return true;
      }
      if (words[0] == "format" && words.size() > 1) {
        ascii_ = words[1] == "ascii";
        big_ = words[1] == "binary_big_endian";
      } else if (words[0] == "element") {
        add_element(words);
      } else if (words[0] == "property") {
        add_property(words);
      } else if (words[0] == "comment" || words[0] == "obj_info") {
        const std::string note = unit_note(trim(line).substr(words[0].size()));
        if (!note.empty() && notes_.empty()) notes_.push_back(note);
      }
    }
    throw InputError(path_, 0, "has no end_header", kPlyCutShort);
  }

  void add_element(const std::vector<std::string_view>& words) {
    const std::string_view text = words.size() > 2 ? words[2] : std::string_view();
    const std::string_view name = words.size() > 1 ? words[1] : std::string_view();
    const std::optional<long long> count = parse_integer(text);
    if (!count || *count < 0) {
      throw InputError(path_, line_, fmt::format("'{}' {} elements", text, name), "export it again");
    }
    if (name == "tristrips" && *count > 0)
      throw InputError(path_, line_, "has strips of triangles", "export it with faces");
    // Each takes a byte at least.
    if (static_cast<std::uintmax_t>(*count) > size_) {
      throw InputError(path_, line_, fmt::format("promises {} elements in {} bytes", *count, size_),
                       kPlyCutShort);
    }
    elements_.push_back({std::string(name), static_cast<std::uintmax_t>(*count), {}});
  }

  void add_property(const std::vector<std::string_view>& words) {
    const bool list = words.size() > 1 && words[1] == "list";
    PlyProperty property;
    const std::size_t type_at = list ? 3 : 1;
    const auto type = words.size() > type_at + 1 ? ply_type(words[type_at]) : std::nullopt;
    if (list && words.size() > 2) property.count = ply_type(words[2]);
    const bool whole =
        !property.count || (*property.count != PlyType::Float && *property.count != PlyType::Double);
    if (!type || list != property.count.has_value() || !whole || elements_.empty()) {
      throw InputError(path_, line_, "is not a property of a type that PLY has", "export it again");
    }
    property.type = *type;
    property.name = std::string(words[type_at + 1]);
    elements_.back().properties.push_back(property);
  }

  void check_sizes() {
    std::uintmax_t lines = 0, bytes = 0;
    for (const PlyElement& element : elements_) {
      lines += element.count;
      for (const PlyProperty& property : element.properties)
        bytes += element.count * size_of(property.count.value_or(property.type));
    }
    const std::streamoff at = in_.tellg();
    const std::uintmax_t data = at < 0 ? 0 : size_ - static_cast<std::uintmax_t>(at);
    if (ascii_) {
      lines_ = lines;
    } else if (data < bytes) {
      throw InputError(path_, 0, fmt::format("has {} of at least {} bytes of data", data, bytes),
                       kPlyCutShort);
    }
  }

  void check_one(const PlyElement& element, std::uintmax_t number) {
    if (ascii_) next_line();
    for (const PlyProperty& property : element.properties) {
      const bool indices = property.name == "vertex_indices" || property.name == "vertex_index";
      const double count = property.count ? next(*property.count) : 1;
      const bool strips = element.name == "tristrips";
      if (property.count &&
          (!(count >= (indices && !strips ? 1 : 0)) || count > static_cast<double>(size_))) {
        throw wrong(element, number, fmt::format("has {} in a list of {}", property.name, count));
      }
      for (double i = 0; i < count; ++i) {
        const double value = next(property.type);
        // -1 ends a strip.
        if (indices && !(value >= (strips ? -1 : 0) && value < static_cast<double>(vertices_))) {
          throw wrong(element, number, fmt::format("names vertex {} of {}", value, vertices_));
        }
        const bool coordinate = element.name == "vertex" &&
                                (property.name == "x" || property.name == "y" || property.name == "z");
        if (coordinate && !std::isfinite(value)) {
          throw wrong(element, number, fmt::format("has the coordinate {} = {}", property.name, value));
        }
      }
    }
    if (ascii_ && word_ < words_.size()) ++longer_lines_;
  }

  /// Data that the header does not speak of, blanks and zeros at the end apart.
  void note_the_rest() {
    if (longer_lines_ > 0) {
      notes_.push_back(fmt::format("{} lines have more numbers than their properties, which are passed over",
                                   longer_lines_));
    }
    const std::streamoff at = in_.tellg();
    if (at < 0) return;
    std::uintmax_t lines = 0;
    for (std::string line; std::getline(in_, line);)
      lines += line.find_first_not_of(std::string_view(" \t\r\0", 4)) == std::string::npos ? 0U : 1U;
    if (lines == 0) return;
    notes_.push_back(
        fmt::format("{} {} follow the data that the header counts and are left out: are its counts right?",
                    ascii_ ? lines : size_ - static_cast<std::uintmax_t>(at), ascii_ ? "lines" : "bytes"));
  }

  [[nodiscard]] InputError wrong(const PlyElement& element, std::uintmax_t number,
                                 std::string_view what) const {
    return {path_, ascii_ ? line_ : 0, fmt::format("{} {} {}", element.name, number, what), kPlyDamaged};
  }

  [[nodiscard]] InputError cut() const {
    return {path_, 0, fmt::format("has {} of {} lines of data", read_lines_, lines_), kPlyCutShort};
  }

  void next_line() {
    do {
      if (!std::getline(in_, text_)) throw cut();
      ++line_;
    } while (trim(text_).empty());
    ++read_lines_;
    words_ = split_blanks(text_);
    word_ = 0;
  }

  double next(PlyType type) {
    if (ascii_) {
      const std::string_view word = word_ < words_.size() ? words_[word_++] : std::string_view();
      const std::optional<double> value = mesh_number(word);
      const std::string name = lower_case(word);
      if (!value && name.find("nan") != std::string::npos) return std::nan("");
      if (!value && name.find("inf") != std::string::npos) return HUGE_VAL;
      if (word.empty() && in_.eof()) throw cut();
      if (!value) {
        throw InputError(path_, line_, fmt::format("'{}' where a number is needed", word),
                         mesh_number_cure(word));
      }
      return *value;
    }
    std::array<char, 8> bytes{};
    const std::size_t size = size_of(type);
    if (!in_.read(bytes.data(), static_cast<std::streamsize>(size))) {
      throw InputError(path_, 0, "ends within its data", kPlyCutShort);
    }
    if (big_ != (std::endian::native == std::endian::big))
      std::reverse(bytes.begin(), bytes.begin() + static_cast<long>(size));
    const auto as = [&bytes]<typename T>(T value) {
      std::memcpy(&value, bytes.data(), sizeof value);
      return static_cast<double>(value);
    };
    switch (type) {
      case PlyType::Int8:
        return as(std::int8_t{});
      case PlyType::Uint8:
        return as(std::uint8_t{});
      case PlyType::Int16:
        return as(std::int16_t{});
      case PlyType::Uint16:
        return as(std::uint16_t{});
      case PlyType::Int32:
        return as(std::int32_t{});
      case PlyType::Uint32:
        return as(std::uint32_t{});
      case PlyType::Float:
        return as(float{});
      case PlyType::Double:
        return as(double{});
    }
    return 0;
  }

  const std::filesystem::path& path_;
  std::ifstream in_;
  std::uintmax_t size_ = 0, vertices_ = 0, lines_ = 0, read_lines_ = 0, longer_lines_ = 0;
  bool ascii_ = false, big_ = false;
  int line_ = 0;
  std::vector<PlyElement> elements_;
  std::vector<std::string> notes_;
  std::string text_;
  std::vector<std::string_view> words_;
  std::size_t word_ = 0;
};

}  // namespace

std::vector<std::string> check_ply(const std::filesystem::path& path) {
  return PlyCheck(path).check();
}

}  // namespace canyon::city
