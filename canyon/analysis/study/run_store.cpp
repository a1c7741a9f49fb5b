#include "canyon/analysis/study/run_store.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <mutex>
#include <set>
#include <utility>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/text_file.hpp"

namespace canyon::study {
namespace {

namespace fs = std::filesystem;

constexpr const char* kManifest = "study.json";
constexpr const char* kRuns = "runs";
constexpr const char* kFormat = "canyon study";
constexpr int kVersion = 3;

std::uint32_t crc_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<z_size_t>(bytes.size())));
}

Json to_json(const Manifest& manifest) {
  Json axes = Json::array();
  for (const Manifest::Coordinate& axis : manifest.axes) {
    axes.push_back({{"name", axis.name},
                    {"key", axis.key},
                    {"kind", static_cast<int>(axis.kind)},
                    {"groups", axis.groups},
                    {"texts", axis.texts},
                    {"labels", axis.labels}});
  }
  Json json{{"format", kFormat},
            {"version", kVersion},
            {"key", manifest.key},
            {"title", manifest.title},
            {"runs", manifest.runs},
            {"axes", axes},
            {"realizations", manifest.realizations},
            {"receivers", manifest.receivers},
            {"epochs", manifest.epochs},
            {"seed", manifest.seed},
            {"confidence", manifest.confidence},
            {"bootstrap", manifest.bootstrap}};
  if (manifest.available_m) json["available_m"] = *manifest.available_m;
  if (manifest.along_m) json["along_m"] = *manifest.along_m;
  return json;
}

template <typename T>
void take(const Json& from, const char* key, T& value) {
  value = from.at(key).get<T>();
}

fs::path epochs_path(const fs::path& folder, std::size_t run) {
  return folder / kRuns / fmt::format("epochs-{:07}.bin", run);
}

template <typename T>
void put(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <typename T>
bool get(std::string_view& bytes, T& value) {
  if (bytes.size() < sizeof value) return false;
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes.remove_prefix(sizeof value);
  return true;
}

template <typename T>
void put_all(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <typename T>
bool get_all(std::string_view& bytes, std::vector<T>& values, std::size_t count) {
  if (bytes.size() / sizeof(T) < count) return false;
  values.resize(count);
  std::memcpy(values.data(), bytes.data(), count * sizeof(T));
  bytes.remove_prefix(count * sizeof(T));
  return true;
}

/// Checksum of the names of stored columns: other versions of Canyon store other columns.
std::uint32_t kept_names_crc() {
  std::string names;
  for (const encoding::Column* column : stored_columns()) names.append(column->kept) += '\n';
  return crc_of(names);
}

/// Flushes a file's contents to the disk.
void flush_to_disk(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::fsync(file);
  ::close(file);
}

void write_epochs(const fs::path& folder, const RunRecord& record) {
  std::string bytes;
  put(bytes, static_cast<std::uint64_t>(record.number));
  put(bytes, static_cast<std::uint64_t>(record.receivers.size()));
  put(bytes, kept_names_crc());
  for (const ReceiverRecord& receiver : record.receivers) {
    put(bytes, static_cast<std::uint64_t>(receiver.kept.size()));
    put_all(bytes, receiver.kept.time_s);
    put_all(bytes, receiver.kept.travelled_m);
    for (const std::vector<float>& column : receiver.kept.columns) put_all(bytes, column);
  }
  std::string crc;
  put(crc, crc_of(bytes));
  const fs::path path = epochs_path(folder, record.number);
  OutputFile file(path);
  file.write(crc);
  file.write(bytes);
  file.commit();
  flush_to_disk(path);
}

std::string host_name() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return "host";
  std::string text = name.data();
  for (char& c : text)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '-';
  return text;
}

}  // namespace

std::string Manifest::Coordinate::label(const std::string& text) const {
  const auto at = std::find(texts.begin(), texts.end(), text);
  return at == texts.end() ? text : labels[static_cast<std::size_t>(at - texts.begin())];
}

struct RunStore::Impl {
  fs::path folder, path;
  int file = -1;
  std::size_t bytes = 0;
  std::set<std::string> configured;  // notes in the file
  std::mutex mutex;

  // A separate file of this process, created with its first run.
  void open() {
    for (int i = 0; file < 0; ++i) {
      path = folder / kRuns / fmt::format("{}-{}-{}.jsonl", host_name(), ::getpid(), i);
      file = ::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_APPEND | O_CLOEXEC, 0666);
      if (file < 0 && errno != EEXIST)
        throw OutputError(path, 0, fmt::format("cannot be written: {}", std::strerror(errno)));
    }
  }

  [[noreturn]] void fail(int code) {
    // Removes the part of the line that was written before the disk was full.
    [[maybe_unused]] const int cut = ::ftruncate(file, static_cast<off_t>(bytes));
    throw OutputError(path, 0, fmt::format("cannot be written: {}", std::strerror(code)),
                      "finished runs are kept: free disk space and run the same command again");
  }
};

RunStore::RunStore(fs::path folder, const Manifest& manifest) : impl_(std::make_unique<Impl>()) {
  impl_->folder = std::move(folder);
  make_output_folder(impl_->folder);
  make_output_folder(impl_->folder / kRuns);
  std::error_code ignored;
  if (fs::exists(impl_->folder / kManifest, ignored)) {
    const Manifest there = read_manifest(impl_->folder);
    if (there.key == manifest.key) return;
    throw InputError(
        impl_->folder, 0,
        fmt::format("the folder contains the runs of another study ('{}', {} runs), or of an earlier version "
                    "of this one",
                    there.title, there.runs),
        "give another folder, or remove this one if its results are no longer needed");
  }
  write_file(impl_->folder / kManifest, to_json(manifest).dump(1) + "\n");
}

RunStore::~RunStore() {
  if (impl_->file >= 0) ::close(impl_->file);
}

void RunStore::add(RunRecord record) {
  const auto keeps = [](const ReceiverRecord& receiver) { return receiver.kept.size() > 0; };
  if (std::any_of(record.receivers.begin(), record.receivers.end(), keeps))
    write_epochs(impl_->folder, record);
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  std::erase_if(record.notes, [this](const std::string& note) { return impl_->configured.count(note) > 0; });
  const std::string json = to_line(record);
  const std::string line = fmt::format("{:08x} {}\n", crc_of(json), json);
  if (impl_->file < 0) impl_->open();
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t n = ::write(impl_->file, line.data() + done, line.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) impl_->fail(n < 0 ? errno : ENOSPC);
    done += static_cast<std::size_t>(n);
  }
  if (::fsync(impl_->file) != 0 && errno != EINVAL) impl_->fail(errno);
  impl_->bytes += line.size();
  impl_->configured.insert(record.notes.begin(), record.notes.end());
}

Manifest read_manifest(const fs::path& folder) {
  const fs::path path = folder / kManifest;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    throw InputError(folder, 0, fmt::format("contains no study: there is no '{}'", kManifest),
                     "give a folder that 'canyon study' has written");
  }
  try {
    const Json from = Json::parse(TextFile(path).text());
    if (from.at("format") != kFormat || from.at("version") != kVersion) {
      throw InputError(path, 0, "is from another program or version",
                       "give another folder, or remove this one and run the study again");
    }
    Manifest manifest;
    take(from, "key", manifest.key);
    take(from, "title", manifest.title);
    take(from, "runs", manifest.runs);
    take(from, "realizations", manifest.realizations);
    take(from, "receivers", manifest.receivers);
    take(from, "epochs", manifest.epochs);
    take(from, "seed", manifest.seed);
    take(from, "confidence", manifest.confidence);
    take(from, "bootstrap", manifest.bootstrap);
    if (from.contains("available_m")) manifest.available_m = from["available_m"].get<double>();
    if (from.contains("along_m")) manifest.along_m = from["along_m"].get<double>();
    for (const Json& each : from.at("axes")) {
      Manifest::Coordinate axis;
      take(each, "name", axis.name);
      take(each, "key", axis.key);
      axis.kind = static_cast<Manifest::Coordinate::Kind>(std::clamp(each.at("kind").get<int>(), 0, 2));
      take(each, "groups", axis.groups);
      take(each, "texts", axis.texts);
      take(each, "labels", axis.labels);
      if (axis.texts.size() != axis.labels.size()) throw InputError(path, 0, "is damaged");
      manifest.axes.push_back(std::move(axis));
    }
    return manifest;
  } catch (const JsonError& e) {
    throw InputError(path, 0, fmt::format("is damaged: {}", e.what()),
                     "remove the folder's 'study.json' and run the same command again; finished runs stay");
  }
}

std::vector<std::optional<RunRecord>> read_records(const fs::path& folder, std::size_t runs) {
  std::vector<std::optional<RunRecord>> records(runs);
  std::error_code ignored;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / kRuns, ignored))
    if (entry.path().extension() == ".jsonl") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& path : files) {
    std::error_code unknown;
    if (fs::file_size(path, unknown) == 0) continue;
    TextFile file(path, std::size_t{1} << 36);
    while (const auto line = file.next_line()) {
      const bool last = !file.peek_line();
      std::uint32_t crc = 0;
      const bool whole = line->size() > 9 &&
                         std::from_chars(line->data(), line->data() + 8, crc, 16).ptr == line->data() + 8 &&
                         crc_of(line->substr(9)) == crc;
      if (!whole && last) break;  // written by a killed process
      if (!whole) {
        throw file.error("the record is damaged",
                         "remove this line and run the same command again: only its run is computed again");
      }
      try {
        RunRecord record = from_line(line->substr(9));
        if (record.number >= runs) throw InputError(fmt::format("the study has no run {}", record.number));
        std::optional<RunRecord>& there = records[record.number];
        if (there) record.notes.insert(record.notes.end(), there->notes.begin(), there->notes.end());
        there = std::move(record);
      } catch (const InputError& e) {
        throw file.error(e.problem(), "remove this line and run the same command again");
      }
    }
  }
  return records;
}

void read_epochs(const fs::path& folder, RunRecord& record) {
  const fs::path path = epochs_path(folder, record.number);
  const std::string all = read_bytes(path);
  const auto damaged = [&] {
    return InputError(path, 0, "is damaged", "remove the folder and run the study again");
  };
  std::string_view bytes = all;
  std::uint32_t crc = 0, names = 0;
  std::uint64_t number = 0, receivers = 0;
  if (!get(bytes, crc) || crc_of(bytes) != crc || !get(bytes, number) || !get(bytes, receivers) ||
      !get(bytes, names) || number != record.number || receivers != record.receivers.size())
    throw damaged();
  if (names != kept_names_crc()) {
    throw InputError(path, 0, "has other columns than this version of Canyon stores",
                     "remove the folder and run the study again");
  }
  for (ReceiverRecord& receiver : record.receivers) {
    std::uint64_t count = 0;
    if (!get(bytes, count) || count > bytes.size()) throw damaged();
    if (count > 0) receiver.kept.columns.resize(stored_columns().size());
    bool whole =
        get_all(bytes, receiver.kept.time_s, count) && get_all(bytes, receiver.kept.travelled_m, count);
    for (std::vector<float>& column : receiver.kept.columns) whole = whole && get_all(bytes, column, count);
    if (!whole) throw damaged();
  }
}

}  // namespace canyon::study
