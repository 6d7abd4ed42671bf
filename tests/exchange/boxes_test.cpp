// SPDX-License-Identifier: Apache-2.0
// tests/exchange: the queues between threads: newest value wins and is never torn; nothing lost, in order, no allocation.
// Meaningful under the thread sanitizer: payloads are plain data, so a missing order between the threads would show as a race.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <thread>
#include <vector>

#include "exchange/latest.h"
#include "exchange/ring.h"
#include "exchange/snapshot.h"
#include "exchange/tool_input.h"

namespace catgut {
namespace {

TEST(Latest, gives_the_newest_and_says_when_there_is_none) {
  Latest<int> box(7);
  EXPECT_EQ(box.seen(), 7);
  EXPECT_FALSE(box.update());
  for (int i = 1; i <= 5; ++i) {
    box.draft() = i;
    box.publish();
  }
  EXPECT_EQ(box.seen(), 7) << "what the reader looks at does not change under its eyes";
  EXPECT_TRUE(box.update());
  EXPECT_EQ(box.seen(), 5);
  EXPECT_FALSE(box.update());
  EXPECT_EQ(box.seen(), 5);
}

TEST(Latest, every_order_of_writes_and_reads_is_right) {
  // Bits of `order` say who is next; 2^12 orders of twelve turns.
  for (uint32_t order = 0; order < 4096; ++order) {
    Latest<int> box(0);
    int newest = 0, had = 0;
    for (int turn = 0; turn < 12; ++turn)
      if (order >> turn & 1) {
        box.draft() = ++newest;
        box.publish();
      } else {
        EXPECT_EQ(box.update(), newest != had);
        had = newest;
        EXPECT_EQ(box.seen(), newest);
      }
  }
}

TEST(Latest, a_snapshot_keeps_its_memory) {
  Latest<Snapshot> box;
  const auto fill = [&] {
    box.draft().particle.resize(1403);
    box.publish();
    box.update();
  };
  for (int i = 0; i < 4; ++i) fill();
  std::vector<const void*> memory;
  for (int i = 0; i < 3; ++i) fill(), memory.push_back(box.seen().particle.data());
  for (int i = 0; i < 30; ++i) {
    fill();
    EXPECT_EQ(box.seen().particle.data(), memory[static_cast<size_t>(i % 3)]);
  }
}

// One thread writes, one reads, at full speed: every value read is consistent, and none is older than the previous one.
TEST(Latest, no_value_is_ever_torn) {
  struct Payload {
    ToolInput hand;
    std::array<uint64_t, 32> word{};
    std::vector<uint64_t> more;
  };
  constexpr uint64_t kRounds = 20000;
  Latest<Payload> box;
  std::atomic<bool> begun{false};  // the reader has a value: the second half is written while it reads
  std::thread writer([&] {
    for (uint64_t i = 1; i <= kRounds; ++i) {
      while (i > kRounds / 2 && !begun) std::this_thread::yield();
      Payload& p = box.draft();
      p.hand.sequence = static_cast<uint32_t>(i);
      p.word.fill(i);
      p.more.assign(100, i);
      box.publish();
      if (i % 64 == 0) std::this_thread::yield();  // otherwise a machine with one core would never read in between
    }
  });
  uint64_t last = 0, torn = 0, older = 0, read = 0;
  while (last < kRounds) {
    if (!box.update()) {
      std::this_thread::yield();
      continue;
    }
    const Payload& p = box.seen();
    const uint64_t now = p.word[0];
    for (uint64_t w : p.word) torn += w != now;
    for (uint64_t w : p.more) torn += w != now;
    torn += p.hand.sequence != now || p.more.size() != 100;
    older += now <= last;
    last = now;
    ++read;
    begun = true;
  }
  writer.join();
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(older, 0u);
  EXPECT_GT(read, 1u);
  EXPECT_FALSE(box.update());
}

TEST(Ring, is_in_order_and_says_when_it_is_full) {
  Ring<int, 4> ring;
  int value = 0;
  EXPECT_FALSE(ring.pop(value));
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 4; ++i) EXPECT_TRUE(ring.push(i));
    EXPECT_FALSE(ring.push(4));
    for (int i = 0; i < 4; ++i) {
      EXPECT_TRUE(ring.pop(value));
      EXPECT_EQ(value, i);
    }
    EXPECT_FALSE(ring.pop(value));
  }
}

TEST(Ring, loses_nothing_between_threads) {
  constexpr uint64_t kCount = 50000;
  Ring<std::array<uint64_t, 4>, 64> ring;
  std::thread writer([&] {
    for (uint64_t i = 0; i < kCount; ++i)
      while (!ring.push({i, i, i, i})) std::this_thread::yield();
  });
  uint64_t wrong = 0;
  for (uint64_t i = 0; i < kCount; ++i) {
    std::array<uint64_t, 4> value{};
    while (!ring.pop(value)) std::this_thread::yield();
    for (uint64_t w : value) wrong += w != i;
  }
  writer.join();
  EXPECT_EQ(wrong, 0u);
}

}  // namespace
}  // namespace catgut
