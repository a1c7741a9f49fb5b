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

/// The machine does not take an output: a full disk, a quota, a disk that is gone. The input is not to blame,
/// so the CLI exits 1. An InputError, so that what reports a file and its cure reports both.
class OutputError final : public InputError {
 public:
  using InputError::InputError;
};

/// A new file or folder under a random name beside an output's, locked while it lives and removed at its end
/// with all that it holds, unless it was put in place. What killed processes left in a folder nobody holds
/// any more: it goes when this process first writes there.
class Temporary {
 public:
  enum class Kind : std::uint8_t { File, Folder };
  /// Throws InputError where the folder is missing or not writable, OutputError where the disk is full or too
  /// many files are open, and as InputFiles::add_output() does.
  Temporary(std::filesystem::path path, Kind kind);
  ~Temporary();
  Temporary(Temporary&& other) noexcept;
  Temporary& operator=(Temporary&& other) = delete;

  /// Gives it the output's name; what had that name goes. Throws InputError where that cannot be.
  void put_in_place();

  /// The output's name, and its own.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const std::filesystem::path& temporary_path() const { return temporary_; }
  /// Changes the open handle, which holds the lock and is closed with this; gives the one before.
  [[nodiscard]] int hold(int handle) { return std::exchange(handle_, handle); }

 private:
  static std::filesystem::path noted_output(const std::filesystem::path& path, Kind kind);

  std::filesystem::path path_, temporary_, noted_;
  InputFiles* files_ = nullptr;
  int handle_ = -1;
};

/// Whether a file has a name as Temporary gives them.
[[nodiscard]] bool is_temporary_name(const std::string& name);

/// A file that appears whole or not at all: bytes go to a temporary name in the same folder, commit() flushes
/// and renames. Without commit() the destructor removes the temporary file and leaves an older file of that
/// name as it was. A file that the disk did not take never appears.
class OutputFile {
 public:
  /// Opens the temporary file. Throws as Temporary does.
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) = delete;
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Throws OutputError where the disk does not take it (full, quota, gone).
  void write(std::string_view bytes);
  /// Replaces bytes that were written before, from byte `offset`; later write()s go on at the end. For
  /// headers that name what is only known at the end. Throws like write(). Precondition: offset + size within
  /// the file.
  void overwrite(std::size_t offset, std::string_view bytes);
  /// Makes the file appear under its name. Throws like write(), also where an earlier write() failed, and
  /// InputError where the name is taken by a folder. Call once.
  void commit();

  [[nodiscard]] const std::filesystem::path& path() const { return temporary_.path(); }
  /// Where the bytes are until commit(): for libraries that write to a name themselves. They may lock it.
  [[nodiscard]] const std::filesystem::path& hand_over() const;

 private:
  [[noreturn]] void fail(std::string_view what);

  Temporary temporary_;
  std::FILE* file_ = nullptr;
  int failure_ = 0;  ///< errno of the first one
};

/// Writes a whole file. Throws as OutputFile does.
void write_file(const std::filesystem::path& path, std::string_view bytes);
/// write_file() over a file of the program's own that it may have read: of a cache, of a view.
void write_own_file(const std::filesystem::path& path, std::string_view bytes);

/// Creates the folder (with parents) where needed and proves that files can be made in it.
/// Throws InputError otherwise.
void make_output_folder(const std::filesystem::path& folder);

/// Keeps all other commands out of a folder while it lives, on this machine. A process that ends, however,
/// holds it no longer.
class FolderLock {
 public:
  /// Makes the folder where needed; it goes again where it stays empty. Throws InputError where another
  /// command works there.
  /// @param shared several that say so may work together
  explicit FolderLock(const std::filesystem::path& folder, bool shared = false);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  std::filesystem::path made_;
  int handle_ = -1;
};

/// A folder of results while a command works in it: locked, with its list FOLDER/.canyon-results. Files that
/// stand there already are replaced where this command has written them, and refused where they are the
/// user's. No link is followed.
class ResultFiles {
 public:
  /// Throws InputError where another command works there, or where results of another one stand.
  /// @param command its word: simulate
  /// @param store a folder in it whose files are listed elsewhere
  /// @param shared of FolderLock
  ResultFiles(std::filesystem::path folder, const std::string& command, std::string store = {},
              bool shared = false);
  ~ResultFiles();
  ResultFiles(const ResultFiles&) = delete;
  ResultFiles& operator=(const ResultFiles&) = delete;

  /// Removes what earlier runs of this command wrote and this one did not, unless it has changed since. Call
  /// it after a run that writes all results anew. Returns how many files it removed.
  std::size_t finish();

  /// Whether earlier runs wrote files that stand there still, and that this one did not write.
  [[nodiscard]] bool has_others() const;

  /// Throws InputError where an output would replace an input, a folder, or the user's file in a folder of
  /// results. For names that are written at the end of the work, before it.
  static void refuse(const std::filesystem::path& path);
  /// Lists a file that gets its name in another way than by Temporary.
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
  bool begun_ = false;  ///< the list ends in names of this command
  /// Names within the folder; those of `earlier_` are of versions that noted no command.
  std::set<std::string> last_, mine_, earlier_;
};

/// Texts that grow side by side and are read at the end of a run of any length. All but their last bytes wait
/// in one file in the folder for temporary files, which has no name and goes with the process.
class Spool {
 public:
  /// One of the texts. The spool must outlive it.
  class Text {
   public:
    explicit Text(Spool& spool) : spool_(&spool) {}
    /// Throws OutputError where the disk does not take it.
    void add(std::string_view bytes);
    [[nodiscard]] bool empty() const { return rest_.empty() && places_.empty(); }
    void read(const std::function<void(std::string_view)>& put) const;

   private:
    Spool* spool_;
    std::string rest_;
    std::vector<std::uint32_t> places_;  // of its blocks in the file
  };

 private:
  static constexpr std::size_t kBlock = std::size_t{16} * 1024;

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::unique_ptr<std::FILE, Close> file_;  // null: nothing waits in it yet
  std::uint32_t blocks_ = 0;
};

}  // namespace canyon
