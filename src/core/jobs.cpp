// SPDX-License-Identifier: Apache-2.0
// core/jobs: the workers behind Jobs::each. Reads the published job; the job's own blocks write all results.
// Every worker has a queue: one cache line with the job and a ticket (generation, first, last) of its blocks not yet started.
// It takes them from the front; a caller that has waited too long takes them from the back. A claim names the generation, so a
// worker that wakes late has nothing to claim and never touches a finished job.
#include "core/jobs.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace catgut {
namespace {

inline void relax() {
#if defined(__x86_64__)
  _mm_pause();
#endif
}

constexpr int kSpins = 2000;   // 20 to 100 us: longer than the gaps between the stages of a substep
constexpr int kYields = 64;    // then yield the core to others, then sleep until the next tick
constexpr int kPatience = 40;  // 1 to 2 us: the others are nearly done, with their blocks in their caches, so wait
// A worker preempted by another program delays all others by a scheduler's time slice. After one such wait the caller works
// without workers for a while.
constexpr auto kLate = std::chrono::milliseconds(1);
constexpr auto kAlone = std::chrono::milliseconds(50);

// A ticket: generation (32 bits), first and last block not yet started (16 bits each).
constexpr uint64_t make_ticket(uint64_t generation, uint64_t first, uint64_t last) {
  return generation << 32 | first << 16 | last;
}
constexpr uint64_t first_of(uint64_t ticket) { return ticket >> 16 & 0xffff; }
constexpr uint64_t last_of(uint64_t ticket) { return ticket & 0xffff; }
constexpr bool is_empty(uint64_t ticket) { return first_of(ticket) >= last_of(ticket); }
constexpr size_t kMostBlocks = 0xffff;

}  // namespace

struct Jobs::Pool {
  struct alignas(64) WorkQueue {
    std::atomic<uint64_t> ticket{0};
    // The job: written before the ticket is published, stable until every claimed block is done.
    Call call = nullptr;
    void* work = nullptr;
    size_t count = 0, block = 0;
  };
  std::vector<WorkQueue> queue;  // the caller's first
  uint64_t generation = 0;
  alignas(64) std::atomic<size_t> done{0};  // blocks finished in this generation

  alignas(64) std::atomic<int> asleep{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::condition_variable wake;
  std::vector<std::thread> threads;
  std::chrono::steady_clock::time_point alone_until{};

  explicit Pool(int workers) : queue(static_cast<size_t>(workers)) {}

  // Runs the remaining blocks of a queue, from the front if it is the worker's own; returns their number.
  static size_t drain(WorkQueue& d, bool own) {
    size_t n = 0;
    uint64_t t = d.ticket.load(std::memory_order_acquire);
    while (!is_empty(t)) {
      const uint64_t next = own ? t + (uint64_t{1} << 16) : t - 1;
      if (!d.ticket.compare_exchange_weak(t, next, std::memory_order_acq_rel, std::memory_order_acquire)) continue;
      d.call(d.work, own ? first_of(t) : last_of(next), d.count, d.block);
      ++n;
      t = next;
      if (!own) break;  // one at a time: its owner may be back
    }
    return n;
  }

  void work_loop(size_t me) {
    int idle = 0;
    while (!stop.load(std::memory_order_relaxed)) {
      const size_t n = drain(queue[me], true);
      if (n > 0) {
        done.fetch_add(n, std::memory_order_release);
        idle = 0;
      } else if (++idle < kSpins) {
        relax();
      } else if (idle < kSpins + kYields) {
        std::this_thread::yield();
      } else {
        std::unique_lock<std::mutex> lock(mutex);
        asleep.fetch_add(1);
        wake.wait(lock, [&] { return stop.load() || !is_empty(queue[me].ticket.load()); });
        asleep.fetch_sub(1);
        idle = 0;
      }
    }
  }

  // The caller, after its own share: waits for the others, and takes over blocks of late workers.
  void finish(size_t blocks, size_t finished) {
    int spins = 0;
    std::chrono::steady_clock::time_point waiting{};
    while (finished + done.load(std::memory_order_acquire) != blocks) {
      if (++spins < kPatience) {
        relax();
        continue;
      }
      size_t n = 0;
      for (size_t k = 1; k < queue.size() && n == 0; ++k) n = drain(queue[k], false);
      finished += n;
      if (n > 0) continue;
      if (spins < kSpins) {
        relax();
        continue;
      }
      const auto now = std::chrono::steady_clock::now();
      if (waiting == std::chrono::steady_clock::time_point{}) waiting = now;
      if (now - waiting > kLate) alone_until = now + kAlone;
      std::this_thread::yield();
    }
  }
};

Jobs::Jobs(int threads) : threads_(threads < 1 ? 1 : threads > 64 ? 64 : threads) {
  if (threads_ == 1) return;
  pool_ = std::make_unique<Pool>(threads_);
  for (size_t i = 1; i < static_cast<size_t>(threads_); ++i)
    pool_->threads.emplace_back([pool = pool_.get(), i] { pool->work_loop(i); });
}

Jobs::~Jobs() {
  if (!pool_) return;
  {
    std::lock_guard<std::mutex> lock(pool_->mutex);
    pool_->stop.store(true);
  }
  pool_->wake.notify_all();
  for (std::thread& t : pool_->threads) t.join();
}

void Jobs::run(size_t blocks, Call call, void* work, size_t count, size_t block) {
  if (blocks == 0) return;
  const bool alone = !pool_ || blocks == 1 || blocks > kMostBlocks ||
                     (pool_->alone_until != std::chrono::steady_clock::time_point{} && fallback_active());
  if (alone) {
    for (size_t b = 0; b < blocks; ++b) call(work, b, count, block);
    return;
  }
  Pool& p = *pool_;
  p.done.store(0, std::memory_order_relaxed);
  ++p.generation;
  // Block b of any job with the same number of blocks goes to the same worker: its data of the previous stage is cached.
  const size_t workers = p.queue.size();
  for (size_t k = workers; k-- > 0;) {
    Pool::WorkQueue& d = p.queue[k];
    d.call = call, d.work = work, d.count = count, d.block = block;
    d.ticket.store(make_ticket(p.generation, blocks * k / workers, blocks * (k + 1) / workers));
  }
  if (p.asleep.load() > 0) {
    // Taking the mutex orders this against a worker that is about to sleep.
    { std::lock_guard<std::mutex> lock(p.mutex); }
    p.wake.notify_all();
  }
  p.finish(blocks, Pool::drain(p.queue[0], true));
}

bool Jobs::fallback_active() {
  if (std::chrono::steady_clock::now() < pool_->alone_until) return true;
  pool_->alone_until = {};
  return false;
}

}  // namespace catgut
