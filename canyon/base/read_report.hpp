#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"

namespace canyon {

/// Notes of a reader about a file: one note per reason, with its first location and the number of records.
/// Reasons that differ only in numbers and quoted texts are the same reason.
/// A reader either reads a record, or skips the record with a note here, or rejects the file with an
/// InputError. It checks the rules of the format; it does not check whether a value is plausible.
class ReadReport {
 public:
  enum class Level : std::uint8_t {
    Loss,   ///< a record or a piece of the world that should have been read and is missing in the results
    Guess,  ///< the input is ambiguous or probably mistaken; results may be off by metres
    Remark  ///< worth knowing, such as sound records that Canyon does not use
  };
  /// "loss", "guess", "remark".
  [[nodiscard]] static std::string_view name(Level level);
  /// The first twenty losses of a file are listed by reason; the records of the rest are counted.
  static constexpr std::size_t kListed = 20;
  /// Number of ids of a kind that are listed.
  static constexpr std::size_t kIds = 20;
  static constexpr std::string_view kLeftOut = "left out";

  ReadReport() = default;
  /// @param path for locations that are only a line
  explicit ReadReport(std::filesystem::path path) : path_(std::move(path)) {}

  /// `count` records that are damaged. @param outcome what is done with them
  void loss(const InputError& reason, std::size_t count = 1, std::string_view outcome = kLeftOut) {
    if (!first_loss_) first_loss_ = reason;
    losses_ += count;
    add(Level::Loss, reason, count, outcome);
  }
  void loss(int line, std::string_view what, std::string_view outcome = kLeftOut) {
    loss(InputError(path_, line, what), 1, outcome);
  }
  /// A sound record that lacks a required value, or is not used: a loss that does not count in losses() and
  /// require_majority().
  void drop(const InputError& reason, std::string_view outcome = kLeftOut) {
    add(Level::Loss, reason, 1, outcome);
  }
  void drop(int line, std::string_view what, std::string_view outcome = kLeftOut) {
    drop(InputError(path_, line, what), outcome);
  }
  /// Calls `read`; if it throws InputError, the record is a loss.
  template <typename Read>
  void guard(const Read& read) {
    try {
      read();
    } catch (const InputError& error) {
      loss(error);
    }
  }
  /// @param taken how it is interpreted
  void guess(int line, std::string_view what, std::string_view taken) {
    count_or_add(Level::Guess, line, what, taken);
  }
  void remark(int line, std::string_view what, std::string_view outcome = {}) {
    count_or_add(Level::Remark, line, what, outcome);
  }
  void remark(const InputError& note) { add(Level::Remark, note, 1, note.hint()); }
  /// A whole line. Equal lines are one note.
  void add_line(Level level, std::string_view line);
  void add_line(Level level, const std::vector<std::string>& lines) {
    for (const std::string& line : lines) add_line(level, line);
  }
  /// `count` things of one kind.
  /// @param what "{} ways without nodes, left out": the first {} is the count; without {}, the line ends in
  /// "(3 times)" or in the ids
  /// @param id of one of them; may be empty
  void add_counted(Level level, std::string_view what, std::string_view id = {}, std::size_t count = 1);

  /// Appends the notes of another report. @param file for notes that name no file
  void append(const ReadReport& other, const std::filesystem::path& file = {});

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Records that are damaged, and the first of them.
  [[nodiscard]] std::size_t losses() const { return losses_; }
  [[nodiscard]] const std::optional<InputError>& first_loss() const { return first_loss_; }
  /// Number of records noted for a reason.
  [[nodiscard]] std::size_t count(std::string_view what) const;

  /// Throws the first loss unless more than half of all records are good: the file is probably of another
  /// kind.
  void require_majority(std::size_t good) const;

  /// A line with its level.
  using Entry = std::pair<Level, std::string>;
  /// "FILE:LINE: what (the first of 5); left out" up to a level, in the order of first occurrence.
  [[nodiscard]] std::vector<Entry> entries(Level up_to = Level::Remark) const;
  [[nodiscard]] std::vector<std::string> lines(Level up_to = Level::Remark) const;
  /// The notes that commands, hosts and Python show by default: losses, then guesses.
  [[nodiscard]] std::vector<std::string> warnings() const;
  /// Number of warnings that commands show.
  static constexpr std::size_t kShown = 5;
  /// The first kShown warnings, losses first, up to two guesses; then "7 more warnings: WHERE".
  [[nodiscard]] std::vector<std::string> shown(std::string_view where) const;
  /// Writes FOLDER/report.txt: "loss: LINE", "guess: LINE" and "remark: LINE", without passwords.
  void write(const std::filesystem::path& folder) const;
  [[nodiscard]] bool empty() const { return notes_.empty(); }

 private:
  struct Note {
    Level level;
    InputError first;
    std::string outcome;
    std::size_t count;
    enum class Form : std::uint8_t { Record, Line, Things } form = Form::Record;
    std::vector<std::string> ids = {};

    [[nodiscard]] std::string line() const;
  };

  void add(Level level, const InputError& reason, std::size_t count, std::string_view outcome);
  Note& note_of(Note::Form form, Level level, const std::string& file, std::string_view what);
  void count_or_add(Level level, int line, std::string_view what, std::string_view outcome);

  std::filesystem::path path_;
  std::vector<Note> notes_;
  std::map<std::string, std::size_t, std::less<>> index_;  ///< of notes, by file and common part
  std::size_t losses_ = 0;
  std::optional<InputError> first_loss_;
};

}  // namespace canyon
