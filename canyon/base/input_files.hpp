#pragma once

#include <filesystem>
#include <mutex>
#include <set>
#include <string_view>

namespace canyon {

/// The input and output files of a run. No output may replace an input; links are resolved. Thread-safe.
/// check_input_file(), which every reader calls, adds to current(); OutputFile checks against it.
class InputFiles {
 public:
  /// The set of this thread's newest Scope, else of the process.
  [[nodiscard]] static InputFiles& current();
  /// For a program that is one run: the process records its inputs from this call on, and none before.
  static void begin_run();

  /// Adds a file that is read. Throws InputError if it is one of the outputs or inside one.
  void add(const std::filesystem::path& path);
  void add(const InputFiles& others);
  /// Removes a file that the program itself rewrites.
  void remove(const std::filesystem::path& path);
  /// Whether the path is an input, or a folder with one.
  [[nodiscard]] bool has(const std::filesystem::path& path) const;

  /// Adds an output before it is written; returns the key for remove_output(). Throws InputError if has().
  std::filesystem::path add_output(const std::filesystem::path& path);
  void remove_output(const std::filesystem::path& noted);
  /// Throws as add_output() does.
  void refuse(const std::filesystem::path& path) { remove_output(add_output(path)); }

  /// During its lifetime, `files` is current() on this thread.
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
  std::multiset<std::filesystem::path> inputs_, outputs_;  ///< links resolved
};

/// Whether a file or folder, with all links resolved, is in or below the folder of `by`: that of the name
/// itself or of the file it links to. @param other a folder relative to by's, used instead of by's folder
[[nodiscard]] bool is_in_folder_of(const std::filesystem::path& path, const std::filesystem::path& by,
                                   const std::filesystem::path& other = {});

/// The path of a file that is named in the file `by`: an address without file://, relative to by's folder.
/// All readers resolve such names by it. Throws InputError unless the file is_in_folder_of() `by`.
[[nodiscard]] std::filesystem::path file_named_by(const std::filesystem::path& by, std::string_view name);

}  // namespace canyon
