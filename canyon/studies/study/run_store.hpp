#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/studies/study/record.hpp"

namespace canyon::study {

/// The study of a folder of results, as far as its end needs it beside the records themselves.
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
  std::vector<std::string> realizations;  ///< names of axes whose values choose noise realizations
  bool epochs = false;
  std::uint64_t seed = 1;
  double confidence = 0.95;
  std::uint32_t bootstrap = 1000;
  std::optional<double> available_m, along_m;
};

/// Records of finished runs in a folder: `study.json` (the manifest) and `runs/NAME.jsonl`, one line a run
/// with its checksum in front, appended and flushed to the disk before add() returns: whatever ends the
/// process, finished runs stay. Epochs, where they are kept, are whole-or-nothing files `runs/epochs-N.bin`.
/// Each process writes a file of its own; any number may share a folder that all see.
class RunStore {
 public:
  /// Makes the folder where needed. Throws InputError where it holds another study, or something else.
  RunStore(std::filesystem::path folder, const Manifest& manifest);
  ~RunStore();
  RunStore(const RunStore&) = delete;
  RunStore& operator=(const RunStore&) = delete;

  /// Keeps a finished run, of its notes those that this process has not kept with another one. Thread-safe.
  /// Throws OutputError where the disk does not take it; then the run is not finished, and what was kept
  /// before stays readable.
  void add(RunRecord record);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Throws InputError where the folder has none, or a damaged one.
[[nodiscard]] Manifest read_manifest(const std::filesystem::path& folder);
/// The records of a folder by number of run, `runs` of them; empty where a run is not finished. A line that a
/// killed process left half written at the end of its file is passed over; any other damage is an InputError
/// with file and line. @param with_epochs reads ReceiverRecord::kept as well
[[nodiscard]] std::vector<std::optional<RunRecord>> read_records(const std::filesystem::path& folder,
                                                                 std::size_t runs);
/// ReceiverRecord::kept of a record; throws InputError where its file is missing or damaged.
void read_epochs(const std::filesystem::path& folder, RunRecord& record);

}  // namespace canyon::study
