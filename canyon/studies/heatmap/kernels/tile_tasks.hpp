#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cstddef>

namespace canyon::heatmap {

/// call(i) for i in [0, count) on the threads of the task arena that this is called in, each i a task.
/// Isolated: a thread that waits here takes no other work of the arena in hand, so that memory stays that of
/// one unit a thread and nobody meets the thread-local lists of a caller. Exceptions of call() come out.
template <class Call>
void spread(std::size_t count, const Call& call) {
  // Tasks order the threads already; this says so to ThreadSanitizer, which cannot see into TBB.
  std::atomic<std::size_t> begun{0}, done{0};
  begun.store(1, std::memory_order_release);
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          (void)begun.load(std::memory_order_acquire);
          for (std::size_t i = range.begin(); i != range.end(); ++i) call(i);
          done.fetch_add(1, std::memory_order_release);
        },
        tbb::simple_partitioner());
  });
  (void)done.load(std::memory_order_acquire);
}

}  // namespace canyon::heatmap
