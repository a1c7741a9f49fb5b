// Declared in canyon/city/mesh_file_format.hpp.
// check_obj() and check_stl(). Formats: Wavefront, "Object Files (.obj)", appendix B1 of Advanced Visualizer;
// 3D Systems, "StereoLithography Interface Specification", 1989.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/input_file.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_file_format.hpp"

namespace canyon::city {
namespace {

constexpr std::string_view kTextDamaged = "export or copy it again: it is damaged";

class ObjCheck {
 public:
  explicit ObjCheck(const std::filesystem::path& path) : path_(path), in_(path, std::ios::binary) {}

  std::vector<std::string> check() {
    while (next_line()) {
      const auto words = split_blanks(text_);
      if (words.empty()) continue;
      if (words[0].front() == '#') {
        if (unit_.empty()) unit_ = unit_note(text_.substr(text_.find_first_not_of('#')));
        continue;
      }
      if (line_ == 1) refuse_hidden(words[0]);
      if (words[0] == "v") {
        take_vertex(words);
      } else if (words[0] == "f" || words[0] == "l" || words[0] == "p") {
        for (std::size_t i = 1; i < words.size(); ++i) take_corner(words[i]);
      } else if (words[0] == "mtllib") {
        for (std::size_t i = 1; i < words.size(); ++i) check_companion(path_.parent_path() / words[i]);
      } else if (!is_keyword(words[0])) {
        if (foreign_++ == 0) first_foreign_ = fmt::format("line {}: '{}'", line_, trim(text_).substr(0, 40));
      }
    }
    if (highest_ > used_.size()) {
      throw InputError(path_, highest_line_, fmt::format("names vertex {} of {}", highest_, used_.size()),
                       kTextDamaged);
    }
    std::vector<std::string> notes;
    if (foreign_ > 0)
      notes.push_back(fmt::format("{} lines are not OBJ and are passed over ({})", foreign_, first_foreign_));
    if (!unit_.empty()) notes.push_back(unit_);
    const auto unused = std::count(used_.begin(), used_.end(), false);
    if (unused > 0) notes.push_back(fmt::format("{} vertices belong to no face", unused));
    return notes;
  }

 private:
  /// A line, with those that a backslash continues it by.
  bool next_line() {
    text_.clear();
    for (std::string piece; std::getline(in_, piece); piece.clear()) {
      ++line_;
      text_ += trim(piece);
      if (text_.empty() || text_.back() != '\\') return true;
      text_.back() = ' ';
    }
    return !text_.empty();
  }

  /// Assimp passes over the line behind a byte order mark: all numbers of vertices would be off.
  void refuse_hidden(std::string_view word) const {
    constexpr std::string_view kMark = "\xef\xbb\xbf";
    if (!word.starts_with(kMark)) return;
    word.remove_prefix(kMark.size());
    if (word.empty() || word.front() == '#' || word == "mtllib") return;
    throw InputError(path_, 1, "begins with a byte order mark, which hides its first line",
                     "save it as UTF-8 without a mark");
  }

  static bool is_keyword(std::string_view word) {
    constexpr std::array kWords{
        "vt",     "vn",     "vp",   "o",     "g",         "s",     "mg",   "usemtl",   "mtllib",
        "usemap", "maplib", "lod",  "bevel", "c_interp",  "bmat",  "step", "d_interp", "shadow_obj",
        "deg",    "cstype", "curv", "curv2", "trace_obj", "parm",  "trim", "hole",     "surf",
        "scrv",   "sp",     "end",  "con",   "ctech",     "stech", "call", "csh",      "vs"};
    return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
  }

  void take_vertex(const std::vector<std::string_view>& words) {
    // x y z, with a weight or a colour behind them.
    if (words.size() < 4 || words.size() > 8) {
      throw InputError(path_, line_, fmt::format("has a vertex of {} numbers", words.size() - 1),
                       kTextDamaged);
    }
    for (std::size_t i = 1; i < words.size(); ++i) {
      if (!mesh_number(words[i])) {
        throw InputError(path_, line_, fmt::format("'{}' is not a coordinate", words[i]),
                         mesh_number_cure(words[i]));
      }
    }
    // Appendix B1: the weight of rational curves. Assimp divides by it.
    if (words.size() == 5 && mesh_number(words[4]) != 1.0) {
      throw InputError(path_, line_, fmt::format("has a vertex with the weight {}", words[4]),
                       "export x, y and z alone");
    }
    used_.push_back(false);
  }

  /// "7", "7/1", "7//3" or "7/1/3"; negative numbers count back from the last vertex.
  void take_corner(std::string_view word) {
    const std::optional<long long> number = parse_integer(word.substr(0, word.find('/')));
    const auto count = static_cast<long long>(used_.size());
    if (!number || *number == 0 || *number < -count)
      throw InputError(path_, line_, fmt::format("'{}' is not a corner of a face", word), kTextDamaged);
    const auto vertex = static_cast<std::size_t>(*number < 0 ? count + *number + 1 : *number);
    if (vertex <= used_.size()) used_[vertex - 1] = true;
    if (vertex <= highest_) return;
    highest_ = vertex;
    highest_line_ = line_;
  }

  const std::filesystem::path& path_;
  std::ifstream in_;
  std::string text_;
  int line_ = 0, highest_line_ = 0;
  std::vector<bool> used_;  ///< of each vertex
  std::size_t highest_ = 0, foreign_ = 0;
  std::string first_foreign_, unit_;
};

/// The words of an ASCII STL file one by one: a facet has three corners of three numbers.
class StlCheck {
 public:
  explicit StlCheck(const std::filesystem::path& path) : path_(path), in_(path, std::ios::binary) {}

  void check() {
    for (std::string line; std::getline(in_, line);) {
      ++line_;
      const std::string lower = lower_case(line);
      for (const std::string_view word : split_blanks(lower)) {
        if (word == "solid" || word == "endsolid") break;  // a name follows
        take(word);
      }
    }
    if (open_ || numbers_ > 0) throw fault("ends within a facet");
  }

 private:
  [[nodiscard]] InputError fault(std::string_view what) const { return {path_, line_, what, kTextDamaged}; }

  void take(std::string_view word) {
    if (numbers_ > 0) {
      if (!mesh_number(word)) {
        throw InputError(path_, line_, fmt::format("'{}' where a number is needed", word),
                         mesh_number_cure(word));
      }
      --numbers_;
    } else if (word == "facet") {
      if (open_) throw fault("begins a facet within another");
      open_ = true;
      corners_ = 0;
    } else if (word == "vertex" || word == "normal") {
      if (!open_) throw fault(fmt::format("has a {} outside a facet", word));
      corners_ += word == "vertex" ? 1 : 0;
      numbers_ = 3;
    } else if (word == "endfacet") {
      if (!open_ || corners_ != 3) throw fault(fmt::format("ends a facet of {} corners", corners_));
      open_ = false;
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      throw fault(fmt::format("'{}' is not a word of STL", word));
    }
  }

  const std::filesystem::path& path_;
  std::ifstream in_;
  int line_ = 0, numbers_ = 0, corners_ = 0;
  bool open_ = false;
};

}  // namespace

std::vector<std::string> check_obj(const std::filesystem::path& path) {
  return ObjCheck(path).check();
}

std::vector<std::string> check_stl(const std::filesystem::path& path) {
  constexpr std::uintmax_t kBinaryHeader = 84, kText = 80;
  constexpr std::uintmax_t kBinaryTriangle = 50;
  const std::string head = read_head(path, kBinaryHeader);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return {};
  const bool solid = head.starts_with("solid");
  if (head.size() == kBinaryHeader) {  // binary files may begin with "solid" as well
    std::uintmax_t triangles = 0;
    for (std::size_t byte = 4; byte-- > 0;)
      triangles = (triangles << 8) | static_cast<unsigned char>(head[kText + byte]);
    if (size == kBinaryHeader + triangles * kBinaryTriangle) {
      const std::string note = unit_note(std::string_view(head).substr(0, std::min(head.find('\0'), kText)));
      return note.empty() ? std::vector<std::string>() : std::vector{note};
    }
  }
  if (!solid && lower_case(head).starts_with("solid") && head.find('\0') == std::string::npos) {
    throw InputError(path, 0, "is an ASCII STL file in capitals, which the importer does not read",
                     "write its words in lower case, for instance by tr A-Z a-z");
  }
  if (!solid || head.find('\0') != std::string::npos) {
    throw InputError(path, 0, "is a binary STL file whose size is not that of the triangles that it says",
                     "export or copy it again: it is damaged");
  }
  const std::uintmax_t tail = std::min<std::uintmax_t>(size, 4096);
  std::ifstream in(path, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(size - tail));
  std::string text(static_cast<std::size_t>(tail), '\0');
  in.read(text.data(), static_cast<std::streamsize>(tail));
  if (text.find("endsolid") == std::string::npos)
    throw InputError(path, 0, "has no endsolid", "export or copy it again: it is cut short");
  StlCheck(path).check();
  return {};
}

}  // namespace canyon::city
