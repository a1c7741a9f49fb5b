#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"

namespace canyon {

/// A new file or folder under a random name in the folder of an output. It is locked during its lifetime and
/// removed at its end with all contents, unless it was renamed to the output's name. Leftovers of killed
/// processes are unlocked; they are deleted at this process's first write to the folder.
class Temporary {
 public:
  enum class Kind : std::uint8_t { File, Folder };
  /// Throws InputError if the folder is missing or not writable, OutputError if the disk is full or too many
  /// files are open, and as InputFiles::add_output() does.
  Temporary(std::filesystem::path path, Kind kind);
  ~Temporary();
  Temporary(Temporary&& other) noexcept;
  Temporary& operator=(Temporary&& other) = delete;

  /// Renames it to the output's name and replaces an older file. Throws InputError if this fails.
  void rename_to_target();

  /// The output's name; and the temporary name.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const std::filesystem::path& temporary_path() const { return temporary_; }
  /// Replaces the open handle, which holds the lock and is closed by the destructor; returns the old one.
  [[nodiscard]] int hold(int handle) { return std::exchange(handle_, handle); }

 private:
  static std::filesystem::path noted_output(const std::filesystem::path& path, Kind kind);

  std::filesystem::path path_, temporary_, noted_;
  InputFiles* files_ = nullptr;
  int handle_ = -1;
};

/// Whether a file name has the form of Temporary's names.
[[nodiscard]] bool is_temporary_name(const std::string& name);

/// A file that is written completely or not at all: bytes go to a temporary name in the same folder; commit()
/// flushes and renames. Without commit() the destructor removes the temporary file and leaves an older file
/// of the name unchanged. A file that could not be stored completely never appears.
class OutputFile {
 public:
  /// Opens the temporary file. Throws as Temporary does.
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) = delete;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Throws OutputError if the bytes cannot be stored (full, quota, gone).
  void write(std::string_view bytes);
  /// Replaces bytes that were written before, from byte `offset`; later write()s continue at the end. For
  /// headers with values known only later. Throws like write(). Precondition: offset + size within the file.
  void overwrite(std::size_t offset, std::string_view bytes);
  /// Renames the file to its final name. Throws like write(), also if an earlier write() failed, and
  /// InputError if the name is a folder. Call once.
  void commit();

  [[nodiscard]] const std::filesystem::path& path() const { return temporary_.path(); }
  /// The temporary file before commit(), for libraries that open a name themselves. They may lock it.
  [[nodiscard]] const std::filesystem::path& external_path() const;

 private:
  [[noreturn]] void fail(std::string_view what);

  Temporary temporary_;
  std::FILE* file_ = nullptr;
  int failure_ = 0;  ///< errno of the first one
};

/// Writes a whole file. Throws as OutputFile does.
void write_file(const std::filesystem::path& path, std::string_view bytes);
/// write_file() over a file of the program itself that it may have read, such as a cache or a view.
void overwrite_cache_file(const std::filesystem::path& path, std::string_view bytes);

/// Creates the folder (with parents) if needed. Throws InputError if files cannot be created in it.
void make_output_folder(const std::filesystem::path& folder);

/// Locks a folder against all other commands on this machine during its lifetime. The lock of a process ends
/// with the process, also if it is killed.
class FolderLock {
 public:
  /// Creates the folder if needed; the destructor removes a created folder that is still empty. Throws
  /// InputError if another command has locked it.
  /// @param shared commands that all set it may use the folder at the same time
  explicit FolderLock(const std::filesystem::path& folder, bool shared = false);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  std::filesystem::path made_;
  int handle_ = -1;
};

/// A folder of results while a command writes to it: locked, with its list FOLDER/.canyon-results. Existing
/// files of this command are replaced; replacing the user's files is an error. Links are not followed.
class ResultFiles {
 public:
  /// Throws InputError if another command has locked the folder, or if it has results of another command.
  /// @param command the command's word: simulate
  /// @param store a subfolder whose files are listed elsewhere
  /// @param shared as for FolderLock
  ResultFiles(std::filesystem::path folder, const std::string& command, std::string store = {},
              bool shared = false);
  ~ResultFiles();
  ResultFiles(const ResultFiles&) = delete;
  ResultFiles& operator=(const ResultFiles&) = delete;

  /// Removes files that earlier runs of this command wrote and this run did not, unless they were changed
  /// since. Call it after a run that has rewritten all results. Returns the number of removed files.
  std::size_t finish();

  /// Whether files of earlier runs exist that this run did not write.
  [[nodiscard]] bool has_others() const;

  /// Throws InputError if an output would replace an input, a folder, or the user's file in a folder of
  /// results. Call it before the work for outputs that are written at the end.
  static void refuse(const std::filesystem::path& path);
  /// Lists a file that is not written by Temporary.
  static void note(const std::filesystem::path& path);

 private:
  void check(const std::filesystem::path& path);
  void read_list();
  void add(const std::filesystem::path& path);
  [[nodiscard]] std::string name_of(const std::filesystem::path& path) const;
  [[nodiscard]] bool is_own(const std::filesystem::path& name) const;

  std::filesystem::path folder_, list_;
  std::string head_, store_;  ///< head_: the line of the list before this command's names
  FolderLock lock_;
  std::filesystem::file_time_type listed_at_{};
  bool started_ = false;  ///< the list ends with names of this command
  /// Names within the folder; `earlier_` is from versions that did not record the command.
  std::set<std::string> last_, mine_, earlier_;
};

/// Texts that grow at the same time and are read at the end of a run of any length. All but their last bytes
/// are in one unnamed file in the folder for temporary files, which is deleted with the process.
class Spool {
 public:
  /// One of the texts. The spool must outlive it.
  class Text {
   public:
    explicit Text(Spool& spool) : spool_(&spool) {}
    /// Throws OutputError if the bytes cannot be stored.
    void add(std::string_view bytes);
    [[nodiscard]] bool empty() const { return rest_.empty() && block_numbers_.empty(); }
    void read(const std::function<void(std::string_view)>& put) const;

   private:
    Spool* spool_;
    std::string rest_;
    std::vector<std::uint32_t> block_numbers_;  // of its blocks in the file
  };

 private:
  static constexpr std::size_t kBlock = std::size_t{16} * 1024;

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;  // null: nothing written to it yet
  std::uint32_t blocks_ = 0;
};

}  // namespace canyon
