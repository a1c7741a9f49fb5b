#pragma once

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"

namespace canyon::simulation {

inline constexpr int kMaxThreads = 4096;

/// Throws InputError unless `threads` is 0 (as many as cores) to kMaxThreads.
inline void check_threads(int threads) {
  if (threads >= 0 && threads <= kMaxThreads) return;
  throw InputError(std::to_string(threads) + " threads are out of range",
                   "give 0 (as many as cores) to " + std::to_string(kMaxThreads));
}

/// `threads`, at most as many as cores; 0: as many as cores. Throws InputError if out of range.
[[nodiscard]] inline int threads_of(int threads) {
  check_threads(threads);
  // More threads than cores bring no gain, and TBB warns about them on stderr.
  const int cores = tbb::this_task_arena::max_concurrency();
  return threads == 0 ? cores : std::min(threads, cores);
}

/// Calls make(i) for i in [0, count) on `threads` (0: as many as cores; at most that), and take(i, item) in
/// ascending order on the calling thread while the next block is made. At most two blocks of items exist at a
/// time. Ends early, between items, once running() is false; items made before that may be dropped. An
/// exception of make(i) is rethrown after take() of all items before i; one of take() at once.
template <typename Item, typename Running, typename Make, typename BlockHandler>
void for_each_in_order(std::size_t count, std::size_t block_size, int threads, const Running& running,
                       const Make& make, const BlockHandler& take) {
  struct Slot {
    std::optional<Item> item;
    std::exception_ptr error;
  };
  using Block = std::vector<Slot>;
  tbb::task_arena arena(threads_of(threads));
  tbb::task_group group;
  std::atomic<std::size_t> failed{count};  // the first one: no item after it is started
  // The group's wait already orders the threads; ThreadSanitizer cannot see into TBB and needs this.
  std::atomic<std::size_t> made{0};
  const auto make_item = [&](std::size_t i, Slot& slot) {
    if (i > failed.load(std::memory_order_relaxed) || !running()) return;
    try {
      slot.item.emplace(make(i));
    } catch (...) {
      slot.error = std::current_exception();
      std::size_t earlier = failed.load();
      while (i < earlier && !failed.compare_exchange_weak(earlier, i)) {
      }
    }
    made.fetch_add(1, std::memory_order_release);
  };
  const auto begin_block = [&](std::size_t first) {
    auto block = std::make_unique<Block>(std::min(block_size, count - first));
    arena.execute([&, first, slots = block.get()] {
      group.run([&make_item, first, slots] {
        tbb::parallel_for(std::size_t{0}, slots->size(),
                          [&](std::size_t i) { make_item(first + i, (*slots)[i]); });
      });
    });
    return block;
  };
  const auto wait = [&] { arena.execute([&group] { group.wait(); }); };
  /// Passes items to take() until one is missing, which is the end; rethrows exceptions of making them.
  const auto take_block = [&](std::size_t first, Block& block) {
    for (Slot& slot : block) {
      if (slot.error) std::rethrow_exception(slot.error);
      if (!slot.item || !running()) return false;
      take(first++, *slot.item);
    }
    return true;
  };

  std::unique_ptr<Block> next = count > 0 ? begin_block(0) : nullptr;
  try {
    for (std::size_t first = 0; next != nullptr; first += block_size) {
      wait();
      (void)made.load(std::memory_order_acquire);
      const std::unique_ptr<Block> block = std::move(next);
      if (count - first > block_size && running()) next = begin_block(first + block_size);
      if (!take_block(first, *block)) break;
    }
  } catch (...) {
    wait();  // tasks of the next block refer to local variables
    throw;
  }
  wait();
}

}  // namespace canyon::simulation
