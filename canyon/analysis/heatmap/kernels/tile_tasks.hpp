#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cstddef>

namespace canyon::heatmap {

/// Calls call(i) for i in [0, count) on the threads of the calling task arena, each i a task. Isolated: a
/// waiting thread does not start other work of the arena, so that memory stays that of one unit per thread,
/// and a caller's thread-local lists are not used concurrently. Rethrows exceptions of call().
template <class Call>
void spread(std::size_t count, const Call& call) {
  // Tasks already order the threads; ThreadSanitizer cannot see into TBB and needs this.
  std::atomic<std::size_t> started{0}, done{0};
  started.store(1, std::memory_order_release);
  tbb::this_task_arena::isolate([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          (void)started.load(std::memory_order_acquire);
          for (std::size_t i = range.begin(); i != range.end(); ++i) call(i);
          done.fetch_add(1, std::memory_order_release);
        },
        tbb::simple_partitioner());
  });
  (void)done.load(std::memory_order_acquire);
}

}  // namespace canyon::heatmap
