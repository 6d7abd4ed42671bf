// SPDX-License-Identifier: Apache-2.0
// core/jobs: fork-join over fixed blocks. A tick has hundreds of stages of 5..50 us, so waiting is a bounded spin, then yield
// (a futex round trip alone takes 3 us). The blocks depend only on the amount of work, never on the number of workers, and one
// worker computes a block from start to end. The same bits for any worker count. Each worker has the same part of the blocks in
// every stage, so that most of its data is still in its cache.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>

namespace catgut {

class Jobs {
 public:
  // threads: including the caller's, 1..64. With 1 no thread is started.
  explicit Jobs(int threads = 1);
  ~Jobs();
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;
  int threads() const { return threads_; }

  // Calls work(first, last) for consecutive blocks of at most `block` items that cover [0, count); returns when all are done.
  // When another program takes a worker's core, the caller runs that worker's blocks. It works alone for 50 ms if it had
  // to wait for a started block.
  template <typename Work>
  void each(size_t count, size_t block, Work&& work) {
    run((count + block - 1) / block,
        [](void* w, size_t b, size_t n, size_t bl) {
          const size_t first = b * bl;
          (*static_cast<std::remove_reference_t<Work>*>(w))(first, first + bl < n ? first + bl : n);
        },
        &work, count, block);
  }

 private:
  using Call = void (*)(void* work, size_t block_index, size_t count, size_t block);
  void run(size_t blocks, Call call, void* work, size_t count, size_t block);
  bool fallback_active();
  struct Pool;
  std::unique_ptr<Pool> pool_;
  int threads_ = 1;
};

}  // namespace catgut
