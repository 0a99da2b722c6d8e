// Parallel loops whose result does not depend on the number of threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <vector>

namespace toile {

/// Number of threads that parallel loops use from now on; 0 is one per processor. Results never depend on it.
void set_thread_count(int threads);
int thread_count();

namespace detail {
void run_chunks(std::size_t chunks, const std::function<void(std::size_t)>& body);
}

/// Calls body(begin, end) over [0, n) in chunks of `grain` items (the last may be shorter). Chunk borders depend on
/// n and grain only. Chunks must not write to the same place.
template <class Body>
void parallel_chunks(std::size_t n, std::size_t grain, const Body& body) {
  if (n == 0) return;
  const std::size_t chunks = (n + grain - 1) / grain;
  if (chunks == 1) return body(std::size_t{0}, n);
  detail::run_chunks(chunks, [&](std::size_t c) { body(c * grain, std::min(n, (c + 1) * grain)); });
}

/// Calls body(i) for each i in [0, n).
template <class Body>
void parallel_for(std::size_t n, std::size_t grain, const Body& body) {
  parallel_chunks(n, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

/// Combines chunk(begin, end) over all chunks from left to right: the same rounding at any thread count.
template <class T, class Chunk, class Combine>
T parallel_reduce(std::size_t n, std::size_t grain, T identity, const Chunk& chunk, const Combine& combine) {
  if (n == 0) return identity;
  const std::size_t chunks = (n + grain - 1) / grain;
  std::vector<T> partial(chunks, identity);
  detail::run_chunks(chunks, [&](std::size_t c) { partial[c] = chunk(c * grain, std::min(n, (c + 1) * grain)); });
  T total = identity;
  for (const T& value : partial) total = combine(total, value);
  return total;
}

}  // namespace toile
