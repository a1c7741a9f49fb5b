#pragma once

#include <filesystem>
#include <string_view>
#include <utility>

#include "canyon/base/output_file.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::output {

/// What the file sinks share: epochs of one receiver, streamed into a file that appears whole at finish() and
/// not at all when something throws before. The file's temporary name is taken at construction, so that a
/// folder that cannot be written to is found before the run.
class FileSink : public simulation::EpochSink {
 public:
  /// Throws InputError where the file cannot be made.
  FileSink(const std::filesystem::path& path, std::size_t receiver) : file_(path), receiver_(receiver) {}

  void write(const simulation::Epoch& epoch) final {
    if (epoch.receiver == receiver_) write_epoch(epoch);
  }
  /// The first call puts the file in place; later ones do nothing.
  void finish() final {
    if (std::exchange(finished_, true)) return;
    write_end();
    file_.commit();
  }

 protected:
  virtual void write_epoch(const simulation::Epoch& epoch) = 0;
  virtual void write_end() {}
  /// Throws InputError where the disk does not take it.
  void put(std::string_view bytes) { file_.write(bytes); }
  OutputFile& file() { return file_; }

 private:
  OutputFile file_;
  std::size_t receiver_;
  bool finished_ = false;
};

}  // namespace canyon::output
