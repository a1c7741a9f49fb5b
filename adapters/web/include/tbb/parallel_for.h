#pragma once
// Serial stand-ins for what Canyon takes of oneTBB: a page has one thread.
#include <cstddef>
#include <utility>
namespace tbb {
template <typename I>
class blocked_range {
 public:
  using const_iterator = I;
  blocked_range(I b, I e, std::size_t = 1) : b_(b), e_(e) {}
  I begin() const { return b_; }
  I end() const { return e_; }

 private:
  I b_, e_;
};
struct simple_partitioner {};
template <typename I, typename F>
void parallel_for(I b, I e, F&& f) {
  for (I i = b; i < e; ++i) f(i);
}
template <typename I, typename F>
void parallel_for(const blocked_range<I>& r, F&& f) {
  if (r.begin() < r.end()) f(r);
}
template <typename I, typename F, typename P>
void parallel_for(const blocked_range<I>& r, F&& f, P&&) {
  if (r.begin() < r.end()) f(r);
}
class task_arena {
 public:
  static constexpr int automatic = -1;
  explicit task_arena(int = automatic) {}
  template <typename F>
  auto execute(F&& f) {
    return f();
  }
  int max_concurrency() const { return 1; }
};
namespace this_task_arena {
inline int max_concurrency() {
  return 1;
}
template <typename F>
auto isolate(F&& f) {
  return f();
}
}  // namespace this_task_arena
class task_group {
 public:
  template <typename F>
  void run(F&& f) {
    f();
  }
  void wait() {}
};
}  // namespace tbb
