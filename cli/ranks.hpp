#pragma once

#include <functional>
#include <memory>

#include "canyon/heatmap/engine/mpi.hpp"

namespace canyon::cli {

/// The processes that mpirun started for one map or study; one alone where it did not. One object in a
/// process.
class Ranks {
 public:
  /// Throws InputError under mpirun with several processes where this build cannot share work among them.
  Ranks();

  [[nodiscard]] int rank() const { return processes_->rank(); }
  [[nodiscard]] int size() const { return processes_->ranks(); }
  /// Waits for all.
  void barrier() const { processes_->barrier(); }
  /// Over all of them; each waits for the others.
  [[nodiscard]] std::size_t sum(std::size_t here) const {
    return static_cast<std::size_t>(processes_->sum(here));
  }
  /// Places in one queue of all of them, see MpiProcesses.
  void begin_queue() { processes_->begin_queue(); }
  [[nodiscard]] std::size_t next() { return processes_->next(); }
  /// Runs `work` and returns its result. If it throws and there are several processes, prints the error as
  /// main() does and ends all of them: the others would wait for this one for ever.
  [[nodiscard]] int guard(const std::function<int()>& work) const;

 private:
  std::unique_ptr<heatmap::MpiProcesses> processes_;
};

}  // namespace canyon::cli
