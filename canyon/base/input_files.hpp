#pragma once

#include <filesystem>
#include <mutex>
#include <set>
#include <string_view>

namespace canyon {

/// The files that a run reads, and those that it writes: no output may replace an input, and links do not
/// hide one. Thread-safe. check_input_file(), which every reader calls, adds to current(); OutputFile asks
/// it.
class InputFiles {
 public:
  /// Those of this thread's newest Scope, else of the process.
  [[nodiscard]] static InputFiles& current();
  /// For a program that is one run: from here on the process notes what it reads. Before, it notes nothing.
  static void begin_run();

  /// Notes a file that is read. Throws InputError where it is, or lies in, one of the outputs.
  void add(const std::filesystem::path& path);
  void add(const InputFiles& others);
  /// Forgets a file of the program's own that it writes anew.
  void remove(const std::filesystem::path& path);
  /// Whether it is an input, or a folder with one.
  [[nodiscard]] bool has(const std::filesystem::path& path) const;

  /// Notes an output before it is written; returns what remove_output() takes. Throws InputError where has().
  std::filesystem::path add_output(const std::filesystem::path& path);
  void remove_output(const std::filesystem::path& noted);
  /// Throws as add_output() does.
  void refuse(const std::filesystem::path& path) { remove_output(add_output(path)); }

  /// While it lives, `files` are current() on this thread.
  class Scope {
   public:
    explicit Scope(InputFiles& files);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    InputFiles* before_;
  };

 private:
  mutable std::mutex mutex_;
  std::multiset<std::filesystem::path> inputs_, outputs_;  ///< without links
};

/// Whether a file or folder, all links followed, lies in the folder of the file `by` or below: in that of its
/// name, or of what its name is a link to. @param other a folder as seen from by's, which takes its place
[[nodiscard]] bool lies_beside(const std::filesystem::path& path, const std::filesystem::path& by,
                               const std::filesystem::path& other = {});

/// The file that `by` names: an address without file://, from by's folder. Every reader asks it of what a
/// file says. Throws InputError unless the file lies_beside() `by`.
[[nodiscard]] std::filesystem::path file_named_by(const std::filesystem::path& by, std::string_view name);

}  // namespace canyon
