// core/jobs: the workers behind Jobs::each. Reads the published job; writes nothing but what the job's own blocks write.
// One 64-bit ticket holds (generation, blocks left). A worker claims a block by decrementing it, so a worker that wakes late
// finds nothing to claim and never touches a job that is over; the caller works too and waits only for claimed blocks.
#include "core/jobs.h"

#include <atomic>
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

constexpr int kSpins = 2000;  // about 30 us: longer than the gaps between the stages of a substep
constexpr int kYields = 64;   // then give the core to others, then sleep until the next tick

}  // namespace

struct Jobs::Pool {
  alignas(64) std::atomic<uint64_t> ticket{0};  // generation << 32 | blocks left to claim
  alignas(64) std::atomic<uint32_t> done{0};    // blocks finished in this generation
  // The job: written before the ticket is published, stable until every claimed block is done.
  Call call = nullptr;
  void* work = nullptr;
  size_t count = 0, block = 0;

  alignas(64) std::atomic<int> asleep{0};
  std::atomic<bool> stop{false};
  std::mutex mutex;
  std::condition_variable wake;
  std::vector<std::thread> threads;

  bool claim_and_run() {
    uint64_t t = ticket.load(std::memory_order_acquire);
    while ((t & 0xffffffffu) != 0) {
      if (ticket.compare_exchange_weak(t, t - 1, std::memory_order_acq_rel, std::memory_order_acquire)) {
        call(work, (t & 0xffffffffu) - 1, count, block);
        done.fetch_add(1, std::memory_order_release);
        return true;
      }
    }
    return false;
  }

  void work_loop() {
    int idle = 0;
    while (!stop.load(std::memory_order_relaxed)) {
      if (claim_and_run()) {
        idle = 0;
      } else if (++idle < kSpins) {
        relax();
      } else if (idle < kSpins + kYields) {
        std::this_thread::yield();
      } else {
        std::unique_lock<std::mutex> lock(mutex);
        asleep.fetch_add(1);
        wake.wait(lock, [&] { return stop.load() || (ticket.load() & 0xffffffffu) != 0; });
        asleep.fetch_sub(1);
        idle = 0;
      }
    }
  }
};

Jobs::Jobs(int threads) : threads_(threads < 1 ? 1 : threads > 64 ? 64 : threads) {
  if (threads_ == 1) return;
  pool_ = std::make_unique<Pool>();
  for (int i = 1; i < threads_; ++i) pool_->threads.emplace_back([pool = pool_.get()] { pool->work_loop(); });
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
  if (!pool_ || blocks == 1) {
    for (size_t b = 0; b < blocks; ++b) call(work, b, count, block);
    return;
  }
  Pool& p = *pool_;
  p.call = call;
  p.work = work;
  p.count = count;
  p.block = block;
  p.done.store(0, std::memory_order_relaxed);
  const uint64_t generation = (p.ticket.load(std::memory_order_relaxed) >> 32) + 1;
  p.ticket.store(generation << 32 | blocks);
  if (p.asleep.load() > 0) {
    // Taking the mutex orders this against a worker that is just about to sleep.
    { std::lock_guard<std::mutex> lock(p.mutex); }
    p.wake.notify_all();
  }
  while (p.claim_and_run()) {}
  for (int spins = 0; p.done.load(std::memory_order_acquire) != blocks;) {
    if (++spins < 20 * kSpins) relax();
    else std::this_thread::yield();
  }
}

}  // namespace catgut
