#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

namespace canyon::heatmap {

/// The processes that compute one map together, started by mpirun or a scheduler: a thin wrapper of MPI, so
/// that no other code calls MPI. Where nothing started the process as one of several it is alone, rank 0 of
/// 1, and MPI's library is not loaded.
///
/// Ranks share nothing but a folder of results (rank 0 opens it, then a barrier, then the others) and the
/// numbers that next() gives. All calls are collective: every rank makes the same
/// ones in the same order, from the thread that made the object; next() alone may come from others
/// (MPI_THREAD_SERIALIZED).
class MpiProcesses {
 public:
  /// Joins the other processes. A process may make one object in its life. Throws InputError where the MPI
  /// library does not support threads, and in one of several processes where it is not there.
  MpiProcesses();
  /// Leaves when all ranks do. During an exception the other ranks would wait for this one for ever, so the
  /// whole job ends, as by abort(1); a caller that reports the reason catches the exception before.
  ~MpiProcesses();
  MpiProcesses(const MpiProcesses&) = delete;
  MpiProcesses& operator=(const MpiProcesses&) = delete;

  [[nodiscard]] int rank() const { return rank_; }    ///< [0, ranks())
  [[nodiscard]] int ranks() const { return ranks_; }  ///< 1 where alone

  /// Returns once every rank is here.
  void barrier() const;
  /// Sum over the ranks, at each of them.
  [[nodiscard]] std::uint64_t sum(std::uint64_t value) const;
  /// Starts the count of next(), which then gives 0, 1, 2, ..., each number once over all ranks and threads.
  /// Returns once every rank is here; alone it counts by itself.
  void begin_queue();
  /// The next number of the queue. Not collective; one thread of a rank at a time.
  [[nodiscard]] std::size_t next();

  /// Ends the processes of all ranks at once, this one included. Not collective.
  [[noreturn]] void abort(int status) const;

 private:
  int rank_ = 0, ranks_ = 1;
  bool joined_ = false;
  int exceptions_ = 0;    ///< in flight when it was made
  std::size_t next_ = 0;  ///< of next() where alone
  struct Counter;
  std::unique_ptr<Counter> counter_;  ///< of next() among several
};

}  // namespace canyon::heatmap
