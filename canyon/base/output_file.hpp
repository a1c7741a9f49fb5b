#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>

#include "canyon/base/input_error.hpp"

namespace canyon {

/// The machine does not take an output: a full disk, a quota, a disk that is gone. The input is not to blame,
/// so the CLI exits 1. An InputError, so that what reports a file and its cure reports both.
class OutputError final : public InputError {
 public:
  using InputError::InputError;
};

/// A file that appears whole or not at all: bytes go to a temporary name in the same folder, commit() flushes
/// and renames. Without commit() the destructor removes the temporary file and leaves an older file of that
/// name as it was.
class OutputFile {
 public:
  /// Opens the temporary file. Throws InputError where the folder is missing or not writable, OutputError
  /// where the disk is full or too many files are open.
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
  /// Makes the file appear under its name. Throws like write(), and InputError where the name is taken by a
  /// folder. Call once.
  void commit();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Where the bytes are until commit(): for libraries that write to a name themselves.
  [[nodiscard]] const std::filesystem::path& temporary_path() const { return temporary_; }

 private:
  [[noreturn]] void fail(std::string_view what) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::FILE* file_ = nullptr;
};

/// Writes a whole file. Throws as OutputFile does.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Creates the folder (with parents) where needed and proves that files can be made in it.
/// Throws InputError otherwise.
void make_output_folder(const std::filesystem::path& folder);

}  // namespace canyon
