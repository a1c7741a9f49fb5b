#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"

namespace canyon {

/// Where a record stands.
struct RecordPlace {
  std::filesystem::path file;
  int line = 0;  ///< 0: not known
};

/// Warnings about the records of files, one line each. Of those that are left out the first twenty are named
/// and the rest counted.
class RecordNotes {
 public:
  static constexpr std::size_t kListed = 20;

  /// @param path of places that are lines alone
  explicit RecordNotes(std::filesystem::path path) : path_(std::move(path)) {}

  /// A record that is left out.
  void add(const RecordPlace& place, std::string_view what, std::string_view cure = "left out") {
    if (++count_ == 1) {
      first_line_ = place.line;
      first_ = what;
    }
    if (count_ <= kListed) say(place, what, cure);
  }
  void add(int line, std::string_view what, std::string_view cure = "left out") {
    add({path_, line}, what, cure);
  }
  /// Anything else.
  void say(const RecordPlace& place, std::string_view what, std::string_view cure = {}) {
    lines_.emplace_back(InputError(place.file, place.line, what, cure).what());
  }
  void say(int line, std::string_view what, std::string_view cure = {}) { say({path_, line}, what, cure); }

  /// How many are left out, and the first of them.
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] int first_line() const { return first_line_; }
  [[nodiscard]] const std::string& first() const { return first_; }

  [[nodiscard]] std::vector<std::string> take() {
    if (count_ > kListed)
      say(0, std::to_string(count_ - kListed) + " more damaged records", "left out as well");
    count_ = 0;
    return std::exchange(lines_, {});
  }

 private:
  std::filesystem::path path_;
  std::vector<std::string> lines_;
  std::size_t count_ = 0;
  int first_line_ = 0;
  std::string first_;
};

}  // namespace canyon
