// SPDX-License-Identifier: Apache-2.0
// tests/sim: a recording survives damaged files: cut anywhere, a flipped bit, another version.
#include "sim/recording.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/check.h"
#include "core/random.h"

namespace catgut {
namespace {

TickInput hands(uint64_t tick) {
  Random random(tick + 1);
  TickInput in;
  in.tick = tick;
  for (ToolInput& h : in.hand) {
    h.pose.p = {random.normal(), random.normal(), random.normal()};
    h.pose.q = normalized(Quat{random.normal(), random.normal(), random.normal(), random.normal()});
    h.velocity = {random.normal(), random.normal(), random.normal()};
    h.angular_velocity = {random.normal(), random.normal(), random.normal()};
    h.jaw = random.uniform();
    h.buttons = random.next();
    h.time_ns = static_cast<uint64_t>(random.next()) << 32 | random.next();
    h.sequence = random.next();
    h.connected = random.next() & 1;
  }
  return in;
}

std::string recorded(size_t ticks, bool finish = true) {
  const std::string path = testing::TempDir() + "catgut_recording_" + std::to_string(::getpid()) + ".cgrec";
  {
    Recorder recorder(path, {"0.1.0", 1, "title = \"small\"\n"}, std::vector<std::byte>(37, std::byte{7}));
    for (size_t t = 0; t < ticks; ++t) recorder.tick(hands(t), t * 11 + 3);
    if (finish) recorder.finish(false);
  }
  std::ifstream in(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  std::filesystem::remove(path);
  return bytes.str();
}

void expect_prefix(const Recording& r) {
  for (size_t t = 0; t < r.tick.size(); ++t) {
    const TickInput want = hands(t);
    ASSERT_EQ(r.tick[t].hash, t * 11 + 3);
    ASSERT_EQ(r.tick[t].input.tick, t);
    for (int h = 0; h < 2; ++h) {
      const ToolInput &a = r.tick[t].input.hand[h], &b = want.hand[h];
      ASSERT_TRUE(a.pose == b.pose && a.velocity == b.velocity && a.angular_velocity == b.angular_velocity);
      ASSERT_TRUE(a.jaw == b.jaw && a.buttons == b.buttons && a.time_ns == b.time_ns);
      ASSERT_TRUE(a.sequence == b.sequence && a.connected == b.connected);
    }
  }
}

TEST(Recording, comes_back_as_it_was) {
  const Recording r = parse_recording(recorded(150), "r");
  EXPECT_EQ(r.header.catgut_version, "0.1.0");
  EXPECT_EQ(r.header.state_version, 1u);
  EXPECT_EQ(r.header.scene, "title = \"small\"\n");
  EXPECT_EQ(r.start, std::vector<std::byte>(37, std::byte{7}));
  EXPECT_EQ(r.tick.size(), 150u);
  EXPECT_FALSE(r.truncated);
  EXPECT_TRUE(r.fault.empty());
  expect_prefix(r);
}

TEST(Recording, without_finish_is_whole_but_marked) {
  const Recording r = parse_recording(recorded(70, false), "r");
  EXPECT_EQ(r.tick.size(), 70u);
  EXPECT_TRUE(r.truncated);
  expect_prefix(r);
}

TEST(Recording, cut_at_any_byte_reads_a_prefix_or_says_so) {
  const std::string whole = recorded(130);
  size_t refused = 0, longest = 0;
  for (size_t cut = 0; cut < whole.size(); ++cut) {
    try {
      const Recording r = parse_recording(whole.substr(0, cut), "r");
      EXPECT_TRUE(r.truncated) << cut;
      EXPECT_FALSE(r.fault.empty()) << cut;
      EXPECT_GE(r.tick.size(), longest) << "a longer file holds no fewer ticks";
      longest = r.tick.size();
      if (cut % 997 == 0) expect_prefix(r);
    } catch (const InputError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
  EXPECT_EQ(longest, 130u);  // only the end mark is missing at the last cuts
  EXPECT_LT(refused, 250u);  // magic, header, start state
}

TEST(Recording, a_flipped_bit_never_gives_wrong_ticks) {
  const std::string whole = recorded(65);
  for (size_t byte = 0; byte < whole.size(); ++byte) {
    std::string bent = whole;
    bent[byte] = static_cast<char>(bent[byte] ^ (1 << (byte % 8)));
    try {
      const Recording r = parse_recording(bent, "r");
      EXPECT_TRUE(r.truncated) << byte;
      expect_prefix(r);
    } catch (const InputError&) {}
  }
}

TEST(Recording, says_what_it_is_not) {
  std::string other = recorded(1);
  other[8] = 9;
  try {
    parse_recording(other, "old.cgrec");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("old.cgrec: the recording has format 9"), std::string::npos) << error.what();
  }
  EXPECT_THROW(parse_recording("", "r"), InputError);
  EXPECT_THROW(parse_recording("title = 1\nnot a recording at all", "r"), InputError);
  EXPECT_THROW(read_recording("/nowhere/at/all.cgrec"), InputError);
  EXPECT_THROW(Recorder("/nowhere/at/all.cgrec", {}, {}), InputError);
}

// The header that release 0.1 wrote, byte by byte: magic, format 1, and a chunk of its kind.
TEST(Recording, of_release_0_1_is_refused_in_one_line) {
  const std::string old("CATGUT\x1a\n\x01\0\0\0\x01\0\0\0", 16);
  try {
    parse_recording(old + std::string(200, 'x'), "session.cgrec");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "session.cgrec: the recording has format 1, this version reads format 3; replay it with the version that "
                 "recorded it");
  }
}

// Heads of a headset's wearer beside the hands: between chunks of ticks, at most one per tick; they change no tick.
TEST(Recording, heads_come_back_with_their_tick) {
  const std::string path = testing::TempDir() + "catgut_heads_" + std::to_string(::getpid()) + ".cgrec";
  const auto head = [](uint64_t t) { return Pose{{0.01f * static_cast<float>(t), 1.6f, 0}, axis_angle({0, 1, 0}, 0.1f)}; };
  {
    Recorder recorder(path, {"0.1.0", 1, "title = \"small\"\n"}, std::vector<std::byte>(37, std::byte{7}));
    recorder.head(head(99));  // before the first tick: there is none that it belongs to
    for (uint64_t t = 0; t < 150; ++t) {
      recorder.tick(hands(t), t * 11 + 3);
      if (t % 3 == 0) recorder.head(head(t)), recorder.head(head(77));
    }
    recorder.finish(false);
  }
  const Recording r = read_recording(path);
  std::filesystem::remove(path);
  EXPECT_FALSE(r.truncated) << r.fault;
  ASSERT_EQ(r.tick.size(), 150u);
  expect_prefix(r);
  ASSERT_EQ(r.head.size(), 50u);
  for (size_t i = 0; i < r.head.size(); ++i) {
    EXPECT_EQ(r.head[i].tick, 3 * i);
    EXPECT_EQ(r.head[i].pose, head(3 * i));
  }
}

TEST(Recording, commands_come_back_with_their_hand_and_suture) {
  const std::string path = testing::TempDir() + "catgut_commands_" + std::to_string(::getpid()) + ".cgrec";
  {
    Recorder recorder(path, {"0.2.0", 1, ""}, {});
    TickInput in;
    in.commands.push({CommandKind::cut, 2, 1});
    in.commands.push({CommandKind::new_suture, 0, 300});
    recorder.tick(in, 0);
    recorder.finish(false);
  }
  const Recording r = read_recording(path);
  std::filesystem::remove(path);
  ASSERT_EQ(r.tick.size(), 1u);
  const CommandList& c = r.tick[0].input.commands;
  ASSERT_EQ(c.count, 2u);
  EXPECT_TRUE(c.row[0].kind == CommandKind::cut && c.row[0].hand == 2 && c.row[0].argument == 1);
  EXPECT_TRUE(c.row[1].kind == CommandKind::new_suture && c.row[1].hand == 0 && c.row[1].argument == 300);
}

}  // namespace
}  // namespace catgut
