#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/study/record.hpp"

namespace canyon::study {

/// The study of a folder of results: the data other than records that its evaluation needs.
struct Manifest {
  struct Coordinate {
    std::string name, key;
    enum class Kind : std::uint8_t { Number, Time, Text } kind = Kind::Text;
    bool groups = false;
    std::vector<std::string> texts, labels;  ///< of listed values whose labels differ from their texts

    /// A value's text for users.
    [[nodiscard]] std::string label(const std::string& text) const;
  };
  std::string key;  ///< StudyPlan::key()
  std::string title;
  std::size_t runs = 0;
  std::vector<Coordinate> axes;
  std::vector<std::string> receivers;
  std::vector<std::string> realizations;  ///< names of axes that select noise realizations
  bool epochs = false;
  std::uint64_t seed = 1;
  double confidence = 0.95;
  std::uint32_t bootstrap = 1000;
  std::optional<double> available_m, along_m;
};

/// Records of finished runs in a folder: `study.json` (the manifest) and `runs/NAME.jsonl`, one line a run,
/// starting with its checksum, appended and flushed to the disk before add() returns: finished runs survive
/// any end of the process. Stored epochs are files `runs/epochs-N.bin`, written completely or not at all.
/// Each process writes its own file; any number may share a folder that all can access.
class RunStore {
 public:
  /// Creates the folder if needed. Throws InputError if it contains another study, or other files.
  RunStore(std::filesystem::path folder, const Manifest& manifest);
  ~RunStore();
  RunStore(const RunStore&) = delete;
  RunStore& operator=(const RunStore&) = delete;

  /// Stores a finished run, and those of its notes that this process has not yet stored. Thread-safe. Throws
  /// OutputError if the disk is not writable; then the run is not finished, and earlier records stay
  /// readable.
  void add(RunRecord record);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Throws InputError if the folder has none, or a damaged one.
[[nodiscard]] Manifest read_manifest(const std::filesystem::path& folder);
/// The records of a folder by number of run, `runs` of them; empty if a run is not finished. An incomplete
/// line of a killed process at the end of its file is ignored; any other damage is an InputError with file
/// and line.
[[nodiscard]] std::vector<std::optional<RunRecord>> read_records(const std::filesystem::path& folder,
                                                                 std::size_t runs);
/// ReceiverRecord::kept of a record; throws InputError if its file is missing or damaged.
void read_epochs(const std::filesystem::path& folder, RunRecord& record);

}  // namespace canyon::study
