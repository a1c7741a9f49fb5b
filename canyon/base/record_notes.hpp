#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"

namespace canyon {

/// Notes about records that a reader leaves out or doubts: one line for each reason, with the first place and
/// how many there are. Reasons that differ in numbers and in quoted texts alone are one.
class RecordNotes {
 public:
  /// The first twenty reasons why records are bad are listed; the records of the rest are counted.
  static constexpr std::size_t kListed = 20;
  static constexpr std::string_view kLeftOut = "left out";

  /// @param path of places that are lines alone
  explicit RecordNotes(std::filesystem::path path = {}) : path_(std::move(path)) {}

  /// `count` records that are damaged or contradict others. @param outcome what becomes of them
  void bad(const InputError& error, std::size_t count = 1, std::string_view outcome = kLeftOut);
  void bad(int line, std::string_view what, std::string_view outcome = kLeftOut) {
    bad(InputError(path_, line, what), 1, outcome);
  }
  /// Calls `read`; a record that it refuses by an InputError is bad.
  template <typename Read>
  void guard(const Read& read) {
    try {
      read();
    } catch (const InputError& error) {
      bad(error);
    }
  }
  /// A good record, or a value of it, that is not taken.
  void skip(int line, std::string_view what, std::string_view outcome = kLeftOut) {
    if (Reason* known = find(what))
      ++known->count;
    else
      add(InputError(path_, line, what), 1, outcome, false);
  }
  /// A remark; those of one reason are not counted together.
  void say(const InputError& remark) { reasons_.push_back({remark, remark.cure()}); }
  void say(int line, std::string_view what, std::string_view cure = {}) {
    say(InputError(path_, line, what, cure));
  }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Bad records, and the first of them.
  [[nodiscard]] std::size_t bad_count() const { return bad_count_; }
  [[nodiscard]] const std::optional<InputError>& first_bad() const { return first_bad_; }
  /// How many records have been left out for a reason.
  [[nodiscard]] std::size_t count(std::string_view what) const;

  /// Throws the first fault where no more than half of all records are good: then the file is of another
  /// kind.
  void require_most(std::size_t good) const;

  /// "FILE:LINE: what (the first of 5); left out", in the order in which the reasons came up.
  [[nodiscard]] std::vector<std::string> lines() const;

 private:
  struct Reason {
    InputError first;
    std::string outcome;
    std::size_t count = 1;
    bool bad = false;
  };

  [[nodiscard]] Reason* find(std::string_view what);
  void add(const InputError& record, std::size_t count, std::string_view outcome, bool is_bad);

  std::filesystem::path path_;
  std::vector<Reason> reasons_;
  std::map<std::string, std::size_t, std::less<>>
      index_;  ///< of counted reasons, by what they have in common
  std::size_t bad_count_ = 0;
  std::optional<InputError> first_bad_;
};

}  // namespace canyon
