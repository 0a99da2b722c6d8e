#include "toile/base/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <memory>
#include <thread>

namespace toile {
namespace {
int configured_threads = 0;
std::unique_ptr<tbb::task_arena> arena;
std::unique_ptr<tbb::global_control> allowance;  // for more threads than processors, as determinism tests ask for
}  // namespace

void set_thread_count(int threads) {
  configured_threads = threads;
  arena.reset();
  allowance.reset();
}

int thread_count() {
  if (configured_threads > 0) return configured_threads;
  return std::max(1u, std::thread::hardware_concurrency());
}

namespace detail {
void run_chunks(std::size_t chunks, const std::function<void(std::size_t)>& body) {
  const int threads = thread_count();
  if (threads == 1 || chunks == 1) {
    for (std::size_t c = 0; c < chunks; ++c) body(c);
    return;
  }
  if (!allowance) allowance = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  if (!arena) arena = std::make_unique<tbb::task_arena>(threads);
  arena->execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, chunks, 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t c = range.begin(); c < range.end(); ++c) body(c);
        },
        tbb::simple_partitioner());
  });
}
}  // namespace detail

}  // namespace toile
