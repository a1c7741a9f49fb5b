#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

namespace canyon::heatmap {

/// The processes that compute one map together, started by mpirun or a scheduler: a thin wrapper of MPI; no
/// other code calls MPI. A process that was started alone is rank 0 of 1, and MPI's library is not loaded.
///
/// Ranks have in common only a folder of results (rank 0 opens it, then a barrier, then the others) and the
/// numbers of next(). All calls are collective: every rank makes the same calls in the same order, from the
/// thread that constructed the object. Only next() may be called on other threads (MPI_THREAD_SERIALIZED).
class MpiProcesses {
 public:
  /// Joins the other processes. A process may make one object during its lifetime. Throws InputError if there
  /// are several processes and the MPI library is missing or does not support threads.
  MpiProcesses();
  /// Leaves when all ranks do. During an exception the other ranks would wait for this one forever, so the
  /// whole job ends, as by abort(1); to report the reason, a caller must catch the exception earlier.
  ~MpiProcesses();
  MpiProcesses(const MpiProcesses&) = delete;
  MpiProcesses& operator=(const MpiProcesses&) = delete;

  [[nodiscard]] int rank() const { return rank_; }    ///< [0, ranks())
  [[nodiscard]] int ranks() const { return ranks_; }  ///< 1 if alone

  /// Returns after every rank has called it.
  void barrier() const;
  /// Sum over the ranks, at each of them.
  [[nodiscard]] std::uint64_t sum(std::uint64_t value) const;
  /// Starts the count of next(), which then returns 0, 1, 2, ..., each number once over all ranks and
  /// threads. Returns after every rank has called it; a single process counts alone.
  void begin_queue();
  /// The next number of the queue. Not collective; one thread of a rank at a time.
  [[nodiscard]] std::size_t next();

  /// Ends the processes of all ranks at once, this one included. Not collective.
  [[noreturn]] void abort(int status) const;

 private:
  int rank_ = 0, ranks_ = 1;
  bool joined_ = false;
  int exceptions_ = 0;    ///< in flight when it was made
  std::size_t next_ = 0;  ///< of next() in a single process
  struct Counter;
  std::unique_ptr<Counter> counter_;  ///< of next() among several
};

}  // namespace canyon::heatmap
