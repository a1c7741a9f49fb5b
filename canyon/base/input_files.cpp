#include "canyon/base/input_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <system_error>

#include "canyon/base/input_error.hpp"

namespace canyon {
namespace {

namespace fs = std::filesystem;

thread_local InputFiles* thread_files = nullptr;
InputFiles process_files;
std::atomic<bool> is_one_run{false};

fs::path without_links(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? path : whole.has_filename() ? whole : whole.parent_path();
}

/// Whether `some` contains the file, a folder above it, or a file below it.
bool meet(const std::multiset<fs::path>& some, const fs::path& path) {
  // Paths are sorted by their parts: the contents of a folder directly follow the folder.
  const auto at = some.lower_bound(path);
  if (at != some.end() && std::mismatch(path.begin(), path.end(), at->begin(), at->end()).first == path.end())
    return true;
  for (fs::path about = path; about.has_relative_path(); about = about.parent_path())
    if (some.count(about) > 0) return true;
  std::error_code error;
  const auto is_same = [&](const fs::path& each) { return fs::equivalent(each, path, error); };
  return fs::hard_link_count(path, error) > 1 && !error && std::any_of(some.begin(), some.end(), is_same);
}

InputError refused(const fs::path& path) {
  return {path, 0, "is an input of this run and would be replaced", "choose another --out or name"};
}

}  // namespace

InputFiles& InputFiles::current() {
  return thread_files != nullptr ? *thread_files : process_files;
}

void InputFiles::begin_run() {
  is_one_run = true;
}

void InputFiles::add(const fs::path& path) {
  if (this == &process_files && !is_one_run) return;
  const fs::path whole = without_links(path);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (meet(outputs_, whole)) throw refused(path);
  if (inputs_.count(whole) == 0) inputs_.insert(whole);
}

void InputFiles::add(const InputFiles& others) {
  if (&others == this) return;
  const std::scoped_lock lock(mutex_, others.mutex_);
  inputs_.insert(others.inputs_.begin(), others.inputs_.end());
}

void InputFiles::remove(const fs::path& path) {
  const std::lock_guard<std::mutex> lock(mutex_);
  inputs_.erase(without_links(path));
}

bool InputFiles::has(const fs::path& path) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return meet(inputs_, without_links(path));
}

fs::path InputFiles::add_output(const fs::path& path) {
  if (has(path)) throw refused(path);
  const std::lock_guard<std::mutex> lock(mutex_);
  return *outputs_.insert(without_links(path));
}

void InputFiles::remove_output(const fs::path& noted) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const auto at = outputs_.find(noted); at != outputs_.end()) outputs_.erase(at);
}

InputFiles::Scope::Scope(InputFiles& files) : before_(thread_files) {
  thread_files = &files;
}

InputFiles::Scope::~Scope() {
  thread_files = before_;
}

namespace fs = std::filesystem;

bool is_in_folder_of(const fs::path& path, const fs::path& by, const fs::path& other) {
  std::error_code error;
  const auto whole = [&error](const fs::path& any) {
    return fs::weakly_canonical(fs::absolute(any, error), error);
  };
  const fs::path file = whole(path);
  const auto is_about = [&](const fs::path& of) {
    fs::path folder = whole(other.empty() ? of.parent_path() : (of.parent_path() / other).lexically_normal());
    if (!folder.has_filename()) folder = folder.parent_path();
    return !error &&
           std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first == folder.end();
  };
  return !error && (is_about(fs::absolute(by, error)) || is_about(whole(by)));
}

fs::path file_named_by(const fs::path& by, std::string_view name) {
  constexpr std::string_view kScheme = "file://";
  if (name.starts_with(kScheme)) name.remove_prefix(kScheme.size());
  fs::path path = by.parent_path() / name;
  if (!is_in_folder_of(path, by))
    throw InputError(by, 0, fmt::format("names '{}', which is outside the folder of this file", name),
                     "move it into the folder, and name it relative to the folder");
  return path;
}

}  // namespace canyon
