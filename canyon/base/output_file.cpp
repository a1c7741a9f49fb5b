#include "canyon/base/output_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <sstream>
#include <system_error>

namespace canyon {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHint = "choose an existing, writable folder";
// Temporary names: the output's name, this mark, and kPartRandom of these letters.
constexpr std::string_view kPartMark = ".part-", kPartLetters = "0123456789abcdefghijklmnopqrstuv";
constexpr std::size_t kPartRandom = 12;
constexpr std::string_view kListHead = "# files of canyon ";

[[noreturn]] void throw_failure(const fs::path& path, std::string_view what, int code) {
  throw OutputError(path, 0, std::string(what) + ": " + std::strerror(code != 0 ? code : EIO),
                    code == ENOSPC                     ? "free disk space and run again"
                    : code == EMFILE || code == ENFILE ? "allow more open files (ulimit -n)"
                                                       : "");
}

[[noreturn]] void fail(int code) {
  throw OutputError(std::filesystem::temp_directory_path(), 0,
                    std::string("a temporary file cannot be written there: ") + std::strerror(code),
                    "free disk space, or name another folder in TMPDIR");
}

std::FILE* open_nameless() {
  std::string name = std::filesystem::temp_directory_path() / "canyon-XXXXXX";
  const int handle = ::mkostemp(name.data(), O_CLOEXEC);
  if (handle < 0) fail(errno);
  ::unlink(name.c_str());
  return ::fdopen(handle, "w+b");
}

/// Removes unlocked temporary files and folders. @param with_folders also those in its subfolders
void remove_left(const fs::path& folder, bool with_folders) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (!is_temporary_name(entry.path().filename().string())) {
      std::error_code entry_error;
      if (with_folders && !entry.is_symlink(entry_error) && entry.is_directory(entry_error))
        remove_left(entry.path(), false);
      continue;
    }
    if (entry.path().filename().string().find(".live.part-") != std::string::npos) continue;  // of a log
    const int handle = ::open(entry.path().c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (handle < 0) continue;
    if (::flock(handle, LOCK_EX | LOCK_NB) == 0) fs::remove_all(entry.path(), error);
    ::close(handle);
  }
}

/// Removes the leftovers of killed processes in a folder and in its subfolders, which they may have made for
/// other receivers; once per folder.
void sweep(const fs::path& folder) {
  static std::mutex mutex;
  static std::set<fs::path> swept;
  std::error_code error;
  const fs::path whole = fs::canonical(folder.empty() ? "." : folder, error);
  const std::lock_guard<std::mutex> lock(mutex);
  if (!error && swept.insert(whole).second) remove_left(whole, true);
}

int open_new(const fs::path& path, bool folder) {
  if (folder && ::mkdir(path.c_str(), 0777) != 0) return -1;
  const int how = folder ? O_RDONLY | O_DIRECTORY : O_RDWR | O_CREAT | O_EXCL;
  return ::open(path.c_str(), how | O_NOFOLLOW | O_CLOEXEC, 0666);
}

std::mutex results_mutex;
std::vector<ResultFiles*> results;

}  // namespace

bool is_temporary_name(const std::string& name) {
  if (name.size() <= kPartMark.size() + kPartRandom) return false;
  const std::size_t at = name.size() - kPartRandom;
  return name.compare(at - kPartMark.size(), kPartMark.size(), kPartMark) == 0 &&
         name.find_first_not_of(kPartLetters, at) == std::string::npos;
}

fs::path Temporary::noted_output(const fs::path& path, Kind kind) {
  if (kind == Kind::File) ResultFiles::refuse(path);
  return InputFiles::current().add_output(path);
}

Temporary::Temporary(fs::path path, Kind kind)
    : path_(std::move(path)), noted_(noted_output(path_, kind)), files_(&InputFiles::current()) {
  sweep(path_.parent_path());
  for (;;) {
    std::array<unsigned char, kPartRandom> random{};
    (void)::getentropy(random.data(), random.size());
    std::string mark(kPartMark);
    for (const unsigned char each : random) mark += kPartLetters[each % kPartLetters.size()];
    temporary_ = path_;
    temporary_ += mark;
    handle_ = open_new(temporary_, kind == Kind::Folder);
    if (handle_ >= 0) {
      ::flock(handle_, LOCK_EX);
      if (::access(temporary_.c_str(), F_OK) == 0) return;
      ::close(std::exchange(handle_, -1));  // another process removed it before it was locked
    } else if (const int code = errno; code != EEXIST) {
      files_->remove_output(noted_);
      if (code == ENOSPC || code == EDQUOT || code == EIO || code == EMFILE || code == ENFILE)
        throw_failure(path_, "cannot be written", code);
      throw InputError(path_, 0,
                       (kind == Kind::Folder ? "folder cannot be made: " : "cannot be written: ") +
                           std::string(std::strerror(code)),
                       kHint);
    }
  }
}

Temporary::Temporary(Temporary&& other) noexcept
    : path_(std::move(other.path_)),
      temporary_(std::exchange(other.temporary_, {})),
      noted_(std::move(other.noted_)),
      files_(std::exchange(other.files_, nullptr)),
      handle_(std::exchange(other.handle_, -1)) {}

Temporary::~Temporary() {
  std::error_code ignored;
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
  if (handle_ >= 0) ::close(handle_);
  if (files_ != nullptr) files_->remove_output(noted_);
}

void Temporary::rename_to_target() {
  ResultFiles::note(path_);
  std::error_code error;
  bool exchanged = false;
  if (fs::is_directory(temporary_, error) && fs::exists(path_, error)) {
    // The two exchange their names, and the old folder is removed under the temporary name.
    exchanged = ::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, path_.c_str(), RENAME_EXCHANGE) == 0;
    if (!exchanged) fs::remove_all(path_, error);
  }
  if (!exchanged) {
    fs::rename(temporary_, path_, error);
    if (error) throw InputError(path_, 0, "cannot be renamed to this name: " + error.message());
    temporary_.clear();
  }
  std::exchange(files_, nullptr)->remove_output(noted_);  // from now on it may be read
}

OutputFile::OutputFile(fs::path path)
    : temporary_(std::move(path), Temporary::Kind::File), file_(::fdopen(temporary_.hold(-1), "wb")) {}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : temporary_(std::move(other.temporary_)),
      file_(std::exchange(other.file_, nullptr)),
      failure_(other.failure_) {}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
}

void OutputFile::fail(std::string_view what) {
  if (failure_ == 0) failure_ = errno != 0 ? errno : EIO;
  throw_failure(path(), what, failure_);
}

void OutputFile::write(std::string_view bytes) {
  errno = 0;
  if (failure_ != 0 || std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size())
    fail("cannot be written");
}

void OutputFile::overwrite(std::size_t offset, std::string_view bytes) {
  errno = 0;
  if (std::fseek(file_, static_cast<long>(offset), SEEK_SET) != 0) fail("cannot be written");
  write(bytes);
  if (std::fseek(file_, 0, SEEK_END) != 0) fail("cannot be written");
}

void OutputFile::commit() {
  errno = 0;
  (void)temporary_.hold(::dup(::fileno(file_)));
  const bool flushed = std::fflush(file_) == 0;
  const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
  if (!flushed || !closed || failure_ != 0) fail("cannot be written");
  temporary_.rename_to_target();
}

const fs::path& OutputFile::external_path() const {
  ::flock(::fileno(file_), LOCK_UN);
  return temporary_.temporary_path();
}

void write_file(const fs::path& path, std::string_view bytes) {
  OutputFile file(path);
  file.write(bytes);
  file.commit();
}

void overwrite_cache_file(const fs::path& path, std::string_view bytes) {
  InputFiles::current().remove(path);
  write_file(path, bytes);
}

void make_output_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw InputError(folder, 0, "folder cannot be made: " + error.message(), kHint);
  const Temporary probe(folder / ".canyon-probe", Temporary::Kind::File);
}

ResultFiles::ResultFiles(fs::path folder, const std::string& command, std::string store, bool shared)
    : folder_(std::move(folder)),
      list_(folder_ / ".canyon-results"),
      head_(std::string(kListHead) + command),
      store_(std::move(store)),
      lock_(folder_, shared) {
  refuse(list_);
  read_list();
  const std::lock_guard<std::mutex> lock(results_mutex);
  results.push_back(this);
}

ResultFiles::~ResultFiles() {
  const std::lock_guard<std::mutex> lock(results_mutex);
  results.erase(std::find(results.begin(), results.end(), this));
}

void ResultFiles::read_list() {
  std::error_code error;
  if (fs::symlink_status(list_, error).type() != fs::file_type::regular) return;
  listed_at_ = fs::last_write_time(list_, error);
  std::ifstream last(list_);
  std::string head;
  std::map<std::string, std::string> heads;  // the last head for each name
  for (std::string line; std::getline(last, line);)
    if (line.starts_with(kListHead))
      head = line;
    else
      heads[line] = head;
  started_ = head == head_;
  for (const auto& [name, of] : heads) {
    if (of == head_ || of.empty()) {
      (of.empty() ? earlier_ : last_).insert(name);
    } else if (fs::exists(folder_ / name, error)) {
      throw InputError(folder_, 0,
                       "has the results of another command, 'canyon " + of.substr(kListHead.size()) + "'",
                       "choose another folder, or remove them first");
    }
  }
}

void ResultFiles::refuse(const fs::path& path) {
  InputFiles::current().refuse(path);
  std::error_code error;
  const fs::file_status there = fs::status(path, error);
  if (fs::is_directory(there)) throw InputError(path, 0, "is a folder", "give the name of a file");
  if (fs::is_other(there)) throw InputError(path, 0, "is a device", "give the name of a file");
  const std::lock_guard<std::mutex> lock(results_mutex);
  for (ResultFiles* each : results) each->check(path);
}

void ResultFiles::note(const fs::path& path) {
  const std::lock_guard<std::mutex> lock(results_mutex);
  for (ResultFiles* each : results) each->add(path);
}

std::string ResultFiles::name_of(const fs::path& path) const {
  const fs::path name = path.lexically_normal().lexically_relative(folder_.lexically_normal());
  const auto is_temporary = [](const fs::path& part) { return is_temporary_name(part.string()); };
  const bool own = !name.empty() && *name.begin() != ".." && *name.begin() != store_ &&
                   name.filename() != list_.filename() &&
                   std::none_of(name.begin(), name.end(), is_temporary);
  return own ? name.generic_string() : "";
}

void ResultFiles::check(const fs::path& path) {
  const std::string name = name_of(path);
  const auto is_listed = [&] { return last_.count(name) + mine_.count(name) + earlier_.count(name) > 0; };
  std::error_code error;
  if (name.empty() || is_listed() || !fs::is_regular_file(path, error)) return;
  read_list();  // another process may use this folder
  if (is_listed()) return;
  throw InputError(path, 0, "exists already and was not written by Canyon",
                   "move it, or choose another folder");
}

void ResultFiles::add(const fs::path& path) {
  const std::string name = name_of(path);
  if (name.empty() || !mine_.insert(name).second || last_.count(name) > 0) return;
  // Listed before the rename, so that a run after a killed one may replace it.
  const std::string line = (std::exchange(started_, true) ? "" : head_ + "\n") + name + "\n";
  const int handle = ::open(list_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (handle < 0) return;
  (void)!::write(handle, line.data(), line.size());
  ::close(handle);
}

bool ResultFiles::is_own(const fs::path& name) const {
  const auto is_plain = [](const fs::path& part) { return part != "." && part != ".." && part != "/"; };
  const auto parts = std::distance(name.begin(), name.end());
  const fs::path folder = name.parent_path();
  std::error_code error;
  return (parts == 1 || parts == 2) && std::all_of(name.begin(), name.end(), is_plain) &&
         (parts == 1 || fs::symlink_status(folder_ / folder, error).type() == fs::file_type::directory) &&
         fs::symlink_status(folder_ / name, error).type() == fs::file_type::regular;
}

bool ResultFiles::has_others() const {
  return std::any_of(last_.begin(), last_.end(), [this](const std::string& name) {
    return mine_.count(name) == 0 && fs::exists(folder_ / name);
  });
}

std::size_t ResultFiles::finish() {
  std::error_code error;
  std::size_t removed = 0;
  for (const std::string& name : last_) {
    const fs::path file = folder_ / name;
    if (mine_.count(name) > 0 || !is_own(name) || fs::last_write_time(file, error) > listed_at_ ||
        InputFiles::current().has(file))
      continue;
    removed += fs::remove(file, error) ? 1U : 0U;
    if (file.parent_path() != folder_) fs::remove(file.parent_path(), error);  // if empty
  }
  std::string text;
  for (const std::string& name : earlier_) text += mine_.count(name) > 0 ? "" : name + "\n";
  text += head_ + "\n";
  for (const std::string& name : mine_) text += name + "\n";
  write_file(list_, text);
  return removed;
}

FolderLock::FolderLock(const fs::path& folder, bool shared) {
  std::error_code error;
  if (!fs::exists(folder, error)) made_ = folder;
  make_output_folder(folder);
  handle_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle_ < 0 || ::flock(handle_, (shared ? LOCK_SH : LOCK_EX) | LOCK_NB) == 0 || errno != EWOULDBLOCK)
    return;
  struct stat status {};
  ::fstat(handle_, &status);
  ::close(handle_);
  // A line of the file: "1: FLOCK ADVISORY WRITE 1234 08:01:5678 0 EOF".
  std::string who, number, kind, how, what, process, file;
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream(line) >> number >> kind >> how >> what >> process >> file;
    if (kind == "FLOCK" && file.ends_with(":" + std::to_string(status.st_ino)))
      who = " (process " + process + ")";
  }
  throw InputError(folder, 0, "another run uses this folder" + who,
                   "wait for its end, or choose another folder");
}

FolderLock::~FolderLock() {
  std::error_code not_empty;
  if (!made_.empty()) fs::remove(made_, not_empty);
  if (handle_ >= 0) ::close(handle_);
}

void Spool::Text::add(std::string_view bytes) {
  rest_ += bytes;
  if (rest_.size() < kBlock) return;
  if (!spool_->file_) spool_->file_.reset(open_nameless());
  const int handle = ::fileno(spool_->file_.get());
  std::size_t at = 0;
  for (; rest_.size() - at >= kBlock; at += kBlock) {
    const auto position = static_cast<off_t>(spool_->blocks_) * static_cast<off_t>(kBlock);
    errno = 0;
    if (::pwrite(handle, rest_.data() + at, kBlock, position) != static_cast<ssize_t>(kBlock))
      fail(errno != 0 ? errno : ENOSPC);
    block_numbers_.push_back(spool_->blocks_++);
  }
  rest_.erase(0, at);
}

void Spool::Text::read(const std::function<void(std::string_view)>& put) const {
  std::string block(kBlock, '\0');
  for (const std::uint32_t each : block_numbers_) {
    const auto position = static_cast<off_t>(each) * static_cast<off_t>(kBlock);
    errno = 0;
    if (::pread(::fileno(spool_->file_.get()), block.data(), kBlock, position) !=
        static_cast<ssize_t>(kBlock))
      fail(errno != 0 ? errno : EIO);
    put(block);
  }
  put(rest_);
}

}  // namespace canyon
