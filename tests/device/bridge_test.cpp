// tests/device: the bridge. The arm's end (runtime/arm_server) lends the simulated arms of fake_hd, a millisecond at a time, to
// a simulator that is a few lines of this test; the simulator's end (device/bridge) is tested against that arm's end, and
// against an arm written in Python. Every port is one that the system gives.
#include "device/bridge.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstring>
#include <functional>
#include <random>
#include <thread>

#include "device/touch.h"
#include "fake_hd/load.h"
#include "haptic/servo.h"
#include "runtime/arm_server.h"

namespace catgut {
namespace {

std::atomic<uint64_t> test_ns{1000000000};

// Until `done`, or ten seconds: this machine may be busy.
bool wait_for(const std::function<bool()>& done) {
  for (int k = 0; k < 100000; ++k) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::microseconds(k < 1000 ? 10 : 100));
  }
  return false;
}

// A simulator, as far as the arm's end can tell.
struct Simulator {
  int fd = -1;
  uint64_t session = 0, sequence = 0;
  std::array<uint64_t, 2> sampled{};  // times of the newest samples
  std::array<ArmSample, 2> sample;
  std::array<Vec3, 2> felt;
  std::array<ArmInfo, 2> info;
  int infos = 0, byes = 0;
  uint32_t refused = 0;
  uint16_t refused_version = 0;

  explicit Simulator(uint16_t port, uint64_t own_session = 77) : session(own_session) {
    std::string why;
    fd = bridge_socket("127.0.0.1:" + std::to_string(port), false, why);
    if (fd < 0) ADD_FAILURE() << why;
  }
  ~Simulator() { ::close(fd); }
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;
  BridgeHead head(BridgeKind kind, size_t arm = 0) {
    BridgeHead h;
    h.kind = kind, h.arm = static_cast<uint8_t>(arm), h.session = session, h.sequence = ++sequence;
    return h;
  }
  void send(const BridgeBytes& b) const { EXPECT_EQ(::send(fd, b.data(), b.size(), 0), static_cast<ssize_t>(b.size())); }
  void hello() {
    BridgeBytes b;
    write_plain(b, head(BridgeKind::hello));
    send(b);
  }
  BridgeBytes order(size_t arm, Vec3 force) {
    BridgeBytes b;
    BridgeCommand c;
    c.force = force, c.answers_ns = sampled[arm];
    write_command(b, head(BridgeKind::command, arm), c);
    return b;
  }
  void take() {
    uint8_t data[300];
    for (ssize_t n; (n = recv(fd, data, sizeof data, MSG_DONTWAIT)) > 0;) {
      BridgeHead h;
      const BridgeFault fault = read_bridge(data, static_cast<size_t>(n), h);
      ASSERT_TRUE(fault == BridgeFault::none);
      if (h.kind == BridgeKind::refused) refused = read_word(data), refused_version = h.version;
      if (h.kind == BridgeKind::bye) ++byes;
      if (h.kind == BridgeKind::info) info[h.arm] = read_info(data), ++infos;
      if (h.kind == BridgeKind::sample) sampled[h.arm] = h.time_ns, sample[h.arm] = read_sample(data, felt[h.arm]);
    }
  }
};

// The simulated arms, lent. What is measured is measured in their own milliseconds.
struct Lent {
  FakeHd fake{true};
  std::vector<std::string> told;
  std::unique_ptr<ArmServer> server;
  std::unique_ptr<Simulator> simulator;
  std::array<Vec3, 2> force{};              // the simulator orders
  std::array<bool, 2> answers{true, true};  // and whether it does

  explicit Lent(float forget = 1) {
    ArmServerOptions o;
    o.listen = "127.0.0.1:0";
    o.clock = [] { return test_ns.load(); };
    o.forget = forget;
    server = std::make_unique<ArmServer>(open_touch({}, told), o);
    EXPECT_TRUE(told.empty());
  }
  void connect() {
    simulator = std::make_unique<Simulator>(server->port());
    simulator->hello();
    ASSERT_TRUE(wait_for([&] { return simulator->take(), simulator->infos == 2; }));
  }
  void ms() {
    test_ns += 1000000;
    fake.step(1);
    if (!simulator) return;
    ASSERT_TRUE(
        wait_for([&] { return simulator->take(), simulator->sampled[0] == test_ns && simulator->sampled[1] == test_ns; }));
    const uint64_t before = server->counts().accepted;
    uint64_t sent = 0;
    for (size_t k = 0; k < 2; ++k)
      if (answers[k]) simulator->send(simulator->order(k, force[k])), ++sent;
    ASSERT_TRUE(wait_for([&] { return server->counts().accepted >= before + sent; }));
  }
  template <typename F>
  void run(int count, const F& each) {
    for (int k = 0; k < count && !testing::Test::HasFatalFailure(); ++k) ms(), each(k);
  }
  void run(int count) {
    run(count, [](int) {});
  }
  // Lets force in, as a hand that touches nothing for a moment does, and then holds these.
  void engage(Vec3 right, Vec3 left, int settle = 1500) {
    connect();
    run(2100);
    force = {right, left};
    run(settle);  // the hand comes to rest
    server->news();
    fake.zero(0), fake.zero(1);
  }
};

// The layout is a promise to programs in other languages: byte for byte.
TEST(Bridge, a_packet_is_what_it_says) {
  BridgeBytes b;
  BridgeHead h{BridgeKind::command, 1, kBridgeVersion, 0x0102030405060708, 9, 10};
  write_command(b, h, {{1.0f, -2.0f, 0.5f}, 0.02f, 11});
  const uint8_t begin[] = {0x43, 0x41, 0x47, 0x42, 1, 0, 4, 1, 8, 7, 6, 5, 4,    3,    2, 1, 9, 0,    0, 0, 0, 0,
                           0,    0,    10,   0,    0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f};
  EXPECT_EQ(std::memcmp(b.data(), begin, sizeof begin), 0);
  EXPECT_EQ(b[48], 11);
  const uint8_t crc[] = {0xd1, 0x1f, 0x8c, 0x22};
  EXPECT_EQ(std::memcmp(&b[252], crc, 4), 0) << "zlib's CRC-32 of the same bytes";

  BridgeHead read;
  ASSERT_TRUE(read_bridge(b.data(), b.size(), read) == BridgeFault::none);
  EXPECT_TRUE(read.kind == BridgeKind::command && read.arm == 1 && read.session == h.session && read.sequence == 9);
  const BridgeCommand c = read_command(b.data());
  EXPECT_TRUE(c.force == (Vec3{1.0f, -2.0f, 0.5f}) && c.answers_ns == 11);

  ArmSample s;
  s.state = ArmState::ready;
  s.pose = {{0.01f, -0.02f, 0.03f}, axis_angle(normalized(Vec3{1, 2, 3}), 1)};
  s.velocity = {0.1f, 0, -0.1f};
  s.buttons = 3, s.warmth = 0.25f, s.forced_off = true;
  write_sample(b, h, s, {0, 1, 0});
  ASSERT_TRUE(read_bridge(b.data(), b.size(), read) == BridgeFault::none);
  Vec3 felt;
  const ArmSample t = read_sample(b.data(), felt);
  EXPECT_TRUE(t.state == ArmState::ready && t.pose.p == s.pose.p && t.velocity == s.velocity && t.forced_off);
  EXPECT_LT(length(rotation_vector(t.pose.q * conjugate(s.pose.q))), 1e-5f);
  EXPECT_TRUE(t.buttons == 3 && t.warmth == 0.25f && felt == (Vec3{0, 1, 0}));
  s.pose.p.y = std::nanf("");
  write_sample(b, h, s, {});
  ASSERT_TRUE(read_bridge(b.data(), b.size(), read) == BridgeFault::none);
  EXPECT_TRUE(read_sample(b.data(), felt).state == ArmState::absent) << "no number ever travels";

  ArmInfo info;
  info.present = true;
  info.name = std::string(100, 'n'), info.serial = "s\n\x1b[2J";
  info.limits.force = 2;
  info.most = {1, 2, 3};
  write_info(b, h, info);
  ASSERT_TRUE(read_bridge(b.data(), b.size(), read) == BridgeFault::none);
  const ArmInfo back = read_info(b.data());
  EXPECT_TRUE(back.present && back.name == std::string(39, 'n') && back.limits.force == 2 && back.most == info.most);
  EXPECT_EQ(back.serial, "s??[2J") << "shown on terminals";
}

// Any bytes at all: refused by the reader, and neither end falls over or moves an arm.
TEST(Bridge, whatever_bytes_come) {
  Lent t;
  t.engage({0.8f, 0, 0}, {0, 0.6f, 0});
  const std::array<Vec3, 2> held{t.fake.force(0), t.fake.force(1)};
  ASSERT_NEAR(length(held[0]), 0.8f, 0.01f);
  std::mt19937 draw(7);
  const auto any = [&draw](uint32_t below) { return draw() % below; };
  const BridgeCounts before = t.server->counts();
  Simulator stranger(t.server->port(), 5);
  uint64_t sent = 0;
  for (int round = 0; round < 60; ++round) {
    for (int k = 0; k < 50; ++k, ++sent) {
      BridgeBytes good = t.simulator->order(any(2), {3, 3, 3});
      std::vector<uint8_t> bad(good.begin(), good.end());
      if (any(3) == 0) {
        bad.resize(any(300));
        for (uint8_t& b : bad) b = static_cast<uint8_t>(draw());
      } else if (any(2)) {
        bad[any(256)] ^= static_cast<uint8_t>(1 + any(255));
      } else {
        bad.resize(any(256));
      }
      BridgeHead h;
      EXPECT_TRUE(read_bridge(bad.data(), bad.size(), h) == BridgeFault::garbage);
      // From the simulator's own address and from a stranger's.
      (void)!::send(any(2) ? t.simulator->fd : stranger.fd, bad.data(), bad.size(), 0);
      if (any(4) == 0) stranger.send(good), ++sent;  // well made, but not the one who has the arms
    }
    t.ms();
    ASSERT_TRUE(t.fake.force(0) == held[0] && t.fake.force(1) == held[1]) << "nothing of it reaches the motors";
  }
  ASSERT_TRUE(wait_for([&] { return t.server->counts().dropped() >= before.dropped() + sent; }));
  EXPECT_GT(t.server->counts().garbage, 2000u);
  EXPECT_GT(t.server->counts().stranger, 100u);
}

// Each for itself: what is dropped is dropped for the reason that is counted.
TEST(Bridge, what_is_dropped_and_why) {
  Lent t;
  t.engage({0.8f, 0, 0}, {});
  const Vec3 held = t.fake.force(0);
  const auto drops = [&](const char* what, uint64_t BridgeCounts::*counter, const std::function<void()>& send) {
    const BridgeCounts before = t.server->counts();
    send();
    EXPECT_TRUE(wait_for([&] { return t.server->counts().dropped() > before.dropped(); })) << what;
    EXPECT_EQ(t.server->counts().*counter, before.*counter + 1) << what;
    EXPECT_EQ(t.server->counts().accepted, before.accepted) << what;
    t.ms();
    EXPECT_TRUE(t.fake.force(0) == held) << what;
  };
  Simulator& s = *t.simulator;
  drops("checksum", &BridgeCounts::garbage, [&] {
    BridgeBytes b = s.order(0, {3, 0, 0});
    b[40] ^= 1;
    s.send(b);
  });
  drops("version", &BridgeCounts::version, [&] {
    BridgeBytes b;
    BridgeHead h = s.head(BridgeKind::hello);
    h.version = 2;
    write_plain(b, h);
    s.send(b);
  });
  EXPECT_EQ(s.refused, kOtherVersion) << "and whoever asked is told";
  EXPECT_EQ(s.refused_version, kBridgeVersion);
  drops("another session", &BridgeCounts::stranger, [&] {
    s.session = 78;
    s.send(s.order(0, {3, 0, 0}));
    s.session = 77;
  });
  drops("an arm beyond two", &BridgeCounts::nonsense, [&] {
    BridgeBytes b;
    BridgeHead h = s.head(BridgeKind::bye);
    h.arm = 2;
    write_plain(b, h);
    s.send(b);
  });
  drops("a kind that is none", &BridgeCounts::nonsense, [&] {
    BridgeBytes b;
    write_plain(b, s.head(static_cast<BridgeKind>(99)));
    s.send(b);
  });
  drops("a force that no arm has", &BridgeCounts::nonsense, [&] { s.send(s.order(0, {1e20f, 0, 0})); });
  drops("an old sequence number", &BridgeCounts::old, [&] {
    s.sequence -= 100;
    s.send(s.order(0, {3, 0, 0}));
    s.sequence += 200;
  });
  drops("another simulator", &BridgeCounts::stranger, [&] {
    Simulator other(t.server->port(), 6);
    other.hello();
    EXPECT_TRUE(wait_for([&] { return other.take(), other.refused == kArmsTaken; }));
  });
  // Well packed, rightly sent, and still not what the motors get: the limits are here, too.
  t.force[0] = {500, 0, 0};
  float most = 0;
  t.run(300, [&](int) { most = std::max(most, length(t.fake.force(0))); });
  EXPECT_LE(most, 3.3f + 1e-4f);
  EXPECT_LE(t.fake.at(0).step_most, 0.5 + 1e-4);
}

// "Killing the bridge peer at any moment brings the force to zero within 100 ms without a step beyond the slew limit."
TEST(Bridge, the_simulator_dies) {
  Lent t;
  t.engage({2.5f, 0, 0}, {0, 0.9f, 0}, 400);  // not longer: 2.5 N make motors warm
  ASSERT_GT(length(t.fake.force(0)), 2.2f);
  t.answers = {false, false};
  int zero[2] = {0, 0};
  std::array<float, 2> last{length(t.fake.force(0)), length(t.fake.force(1))};
  t.run(300, [&](int k) {
    for (size_t a = 0; a < 2; ++a) {
      const float f = length(t.fake.force(static_cast<int>(a)));
      if (f == 0 && zero[a] == 0) zero[a] = k + 1;
      if (k > 20) { EXPECT_LE(f, last[a] + 1e-5f) << "only ever less"; }
      last[a] = f;
    }
  });
  std::printf("peer dead at 2.5 and 0.9 N: zero after %d and %d ms; largest step %.3f N/ms\n", zero[0], zero[1],
              t.fake.at(0).step_most);
  for (int a = 0; a < 2; ++a) {
    EXPECT_GT(zero[a], 20);
    EXPECT_LE(zero[a], 100);
    EXPECT_EQ(length(t.fake.force(a)), 0);
    EXPECT_LE(t.fake.at(a).step_most, 0.5 + 1e-4);
  }
  bool told = false;
  for (const std::string& line : t.server->news()) told |= line.find("silent") != std::string::npos;
  EXPECT_TRUE(told);
  // It comes back with the force it had wanted: nothing is let in until little is wanted, and then over two seconds.
  t.answers = {true, true};
  t.run(100);
  EXPECT_EQ(length(t.fake.force(0)), 0);
  t.force = {};
  t.run(20);
  t.force = {Vec3{1, 0, 0}, Vec3{}};
  t.run(200);
  EXPECT_GT(length(t.fake.force(0)), 0);
  EXPECT_LT(length(t.fake.force(0)), 0.2f);
}

// The same where only one arm's orders stop, or one arm is lost at this end: the other's force goes on to the bit.
TEST(Bridge, the_other_hand_never_notices) {
  for (const bool lost : {false, true}) {
    SCOPED_TRACE(lost);
    Lent t;
    t.engage({0.9f, 0, 0}, {0, 0.7f, 0});
    const Vec3 left = t.fake.force(1);
    ASSERT_NEAR(length(left), 0.7f, 0.01f);
    if (lost) t.fake.fault(0, kFakeCommError, 1);
    else t.answers[0] = false;
    int zero = 0, bad = 0;
    t.run(200, [&](int k) {
      if (length(t.fake.force(0)) == 0 && zero == 0) zero = k + 1;
      bad += !(t.fake.force(1) == left);
    });
    EXPECT_GT(zero, 0);
    EXPECT_LE(zero, lost ? 1 : 100);
    EXPECT_EQ(bad, 0);
    EXPECT_EQ(t.fake.at(1).step_most, 0);
    EXPECT_TRUE((t.simulator->sample[0].state == ArmState::ready) == !lost) << "and the simulator is told which it was";
    EXPECT_TRUE(t.simulator->sample[1].state == ArmState::ready);
  }
}

// A delayed answer is judged by the age of the sample it answers, by the arm's clock: a queue that stands still and then comes
// in all at once does not look fresh.
TEST(Bridge, late_is_late) {
  Lent t;
  t.engage({0.9f, 0, 0}, {});
  t.answers[0] = false;
  const uint64_t old = t.simulator->sampled[0];
  int zero = 0;
  t.run(150, [&](int k) {
    const uint64_t now = t.simulator->sampled[0];
    t.simulator->sampled[0] = old;
    t.simulator->send(t.simulator->order(0, {0.9f, 0, 0}));
    t.simulator->sampled[0] = now;
    if (length(t.fake.force(0)) == 0 && zero == 0) zero = k + 1;
  });
  EXPECT_GT(zero, 20);
  EXPECT_LE(zero, 100);
}

TEST(Bridge, arms_are_given_back_and_lent_again) {
  Lent t;
  t.engage({0.9f, 0, 0}, {});
  BridgeBytes b;
  write_plain(b, t.simulator->head(BridgeKind::bye));
  t.simulator->send(b);
  ASSERT_TRUE(wait_for([&] {
    for (const std::string& line : t.server->news())
      if (line.find("given back") != std::string::npos) return true;
    return false;
  }));
  t.simulator.reset();
  t.run(10);
  EXPECT_EQ(length(t.fake.force(0)), 0);
  EXPECT_LE(t.fake.at(0).step_most, 0.5 + 1e-4);
  t.connect();  // another one, at once
  t.run(5);
  // One that crashed is forgotten after a second.
  t.simulator.reset();
  test_ns += 1500000000;
  t.connect();
  t.run(5);
  t.server->stop();
  EXPECT_TRUE(wait_for([&] { return t.simulator->take(), t.simulator->byes == 1; }));
}

// Both ends and a servo: the simulated arms, lent in lock step to device/bridge.
struct Both : Lent {
  ArmPort port;
  std::array<ServoHand, 2> hand;
  std::array<ServoOptions, 2> options;
  std::array<std::atomic<float>, 2> pull{};  // [N] along x
  std::array<std::atomic<bool>, 2> there{};
  std::array<std::atomic<float>, 2> at{};  // [m] along x
  std::atomic<uint64_t> physics_ns{0};     // 0: the physics lives; else it died then
  std::atomic<bool> hangs{false};          // the whole simulator, as one that was killed without a word
  static Vec3 step(void* user, size_t k, const ArmSample& s) {
    Both& t = *static_cast<Both*>(user);
    const uint64_t now = test_ns;
    ForcePatch p;
    while (t.hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    p.period = 0.016f, p.time_ns = t.physics_ns ? t.physics_ns.load() : now;
    p.force = {t.pull[k], 0, 0};
    p.point = s.pose.p;
    const ServoOut out = servo_step(t.hand[k], t.options[k], s, &p, now);
    t.there[k] = out.hand.connected, t.at[k] = s.pose.p.x;
    return out.force;
  }
  explicit Both(BridgeOptions o = {}) {
    o.where = "127.0.0.1:" + std::to_string(server->port());
    o.patience = 5;
    port = open_bridge(o, told);
    for (const std::string& line : told) ADD_FAILURE() << line;
    for (size_t k = 0; k < 2; ++k) fit_to_arm(options[k], port.arm[k].limits);
    std::string why;
    EXPECT_TRUE(port.any() && port.start(port.self, {step, this}, why));
    // The thread says hello; samples come from then on.
    EXPECT_TRUE(wait_for([&] { return server->counts().accepted >= 2; }));
  }
  ~Both() { port.reset(); }
  // A millisecond of the arms, and the simulator's answers to it.
  void both(int count, const std::function<void(int)>& each = {}) {
    for (int k = 0; k < count; ++k) {
      const uint64_t before = server->counts().accepted;
      test_ns += 1000000;
      fake.step(1);
      ASSERT_TRUE(wait_for([&] { return server->counts().accepted >= before + 2; }));
      if (each) each(k);
    }
  }
};

TEST(Bridge, both_ends) {
  Both t;
  EXPECT_EQ(t.port.arm[0].serial, "right-0001");
  EXPECT_EQ(t.port.arm[1].serial, "left-0002");
  EXPECT_FLOAT_EQ(t.port.arm[1].limits.continuous, 0.88f);
  t.fake.put(0, {0.02f, 0, 0});
  t.fake.wish(0, {0.02f, 0, 0});
  t.both(2200);
  EXPECT_NEAR(t.at[0], 0.02f, 1e-4f);
  t.pull[0] = 0.8f, t.pull[1] = -0.5f;
  t.both(2200);
  EXPECT_NEAR(t.fake.force(0).x, 0.8f, 0.02f);
  EXPECT_NEAR(t.fake.force(1).x, -0.5f, 0.02f);
  EXPECT_TRUE(t.port.status(t.port.self, 0).ready);
  t.fake.zero(0), t.fake.zero(1);

  // The device: its left arm's line breaks.
  const Vec3 right = t.fake.force(0);
  t.fake.fault(1, kFakeCommError, 1);
  t.both(50, [&](int) { EXPECT_TRUE(t.fake.force(0) == right); });
  EXPECT_FALSE(t.there[1]);
  EXPECT_TRUE(t.there[0]);
  EXPECT_NE(t.port.error_text(t.port.self, t.port.status(t.port.self, 1).error).find("has lost it"), std::string::npos);

  // The bridge peer: the whole simulator stops, without a word.
  t.hangs = true;
  int zero = 0;
  for (int k = 1; k <= 150; ++k) {
    test_ns += 1000000;
    t.fake.step(1);
    if (length(t.fake.force(0)) == 0 && zero == 0) zero = k;
  }
  std::printf("simulator killed at 0.8 N: zero after %d ms\n", zero);
  EXPECT_GT(zero, 0);
  EXPECT_LE(zero, 100);
  EXPECT_EQ(length(t.fake.force(0)), 0);
  EXPECT_LE(t.fake.at(0).step_most, 0.5 + 1e-4);
  t.hangs = false;
}

// The physics dies, everything else lives: as without a bridge.
TEST(Bridge, the_physics_dies) {
  Both t;
  t.both(2200);
  t.pull[0] = 0.8f;
  t.both(2200);
  ASSERT_NEAR(t.fake.force(0).x, 0.8f, 0.02f);
  t.fake.zero(0);
  t.physics_ns = test_ns.load();
  int zero = 0;
  t.both(150, [&](int k) {
    if (length(t.fake.force(0)) == 0 && zero == 0) zero = k + 1;
  });
  std::printf("physics killed at 0.8 N: zero after %d ms\n", zero);
  EXPECT_GT(zero, 30);
  EXPECT_LE(zero, 100);
  EXPECT_LE(t.fake.at(0).step_most, 0.5 + 1e-4);
}

// The arm's end dies and is started again at the same place: both hands are lost, and come back by themselves.
TEST(Bridge, the_arms_end_is_restarted) {
  Both t;
  t.both(20);
  ASSERT_TRUE(t.there[0] && t.there[1]);
  const uint16_t port = t.server->port();
  t.server.reset();
  ASSERT_TRUE(wait_for([&] { return !t.there[0] && !t.there[1]; }));
  EXPECT_FALSE(t.port.status(t.port.self, 0).ready);
  ArmServerOptions o;
  o.listen = "127.0.0.1:" + std::to_string(port);
  o.clock = [] { return test_ns.load(); };
  t.fake.reset();
  t.server = std::make_unique<ArmServer>(open_touch({}, t.told), o);
  ASSERT_TRUE(wait_for([&] {
    test_ns += 1000000;
    t.fake.step(1);
    return t.there[0] && t.there[1];
  }));
  EXPECT_TRUE(wait_for([&] { return t.port.status(t.port.self, 1).ready; }));
}

// What the simulator's end makes of garbage that comes from the very address it is connected to.
TEST(Bridge, garbage_from_the_arms_end) {
  std::string why;
  const int fd = bridge_socket("127.0.0.1:0", true, why);
  ASSERT_GE(fd, 0) << why;
  sockaddr_storage own{}, peer{};
  socklen_t bytes = sizeof own;
  getsockname(fd, reinterpret_cast<sockaddr*>(&own), &bytes);
  BridgeOptions o;
  o.where = "127.0.0.1:" + std::to_string(ntohs(reinterpret_cast<sockaddr_in*>(&own)->sin_port));
  o.patience = 5;
  std::atomic<bool> quit{false};
  // An arm that answers every hello, mixed with noise.
  std::thread arm([&] {
    std::mt19937 draw(3);
    uint64_t sequence = 0;
    while (!quit) {
      uint8_t data[300];
      socklen_t size = sizeof peer;
      pollfd wait{fd, POLLIN, 0};
      poll(&wait, 1, 1);
      const ssize_t n = recvfrom(fd, data, sizeof data, MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&peer), &size);
      BridgeHead h;
      if (n <= 0 || read_bridge(data, static_cast<size_t>(n), h) != BridgeFault::none) continue;
      ArmInfo info;
      info.present = true;
      const auto send = [&](const void* what, size_t count) {
        sendto(fd, what, count, 0, reinterpret_cast<sockaddr*>(&peer), size);
      };
      BridgeBytes b;
      for (int k = 0; k < 20; ++k) {
        for (uint8_t& byte : b) byte = static_cast<uint8_t>(draw());
        send(b.data(), draw() % 257);
        write_plain(b, {BridgeKind::bye, 0, kBridgeVersion, h.session ^ 1, ++sequence, 0});
        send(b.data(), b.size());
      }
      for (uint8_t k = 0; k < 2; ++k) {
        BridgeHead out{BridgeKind::info, k, kBridgeVersion, h.session, ++sequence, 5};
        if (h.kind == BridgeKind::hello) write_info(b, out, info), send(b.data(), b.size());
        out.kind = BridgeKind::sample;
        ArmSample s;
        s.state = ArmState::ready;
        write_sample(b, out, s, {});
        send(b.data(), b.size());
        send(b.data(), b.size());  // twice: the network may do that
      }
    }
  });
  std::vector<std::string> told;
  ArmPort port = open_bridge(o, told);
  EXPECT_TRUE(port.any());
  if (port.any()) {
    static std::atomic<int> ready{0};
    ready = 0;
    const auto step = [](void*, size_t, const ArmSample& s) {
      ready += s.state == ArmState::ready;
      return Vec3{std::nanf(""), 0, 0};
    };
    EXPECT_TRUE(port.start(port.self, {step, nullptr}, why));
    EXPECT_TRUE(wait_for([&] {
      const BridgeCounts c = bridge_counts(port);
      return ready > 50 && c.garbage > 500 && c.stranger > 500 && c.old > 20;
    })) << ready;
  }
  port.reset();
  quit = true;
  arm.join();
  ::close(fd);
}

TEST(Bridge, nothing_to_work_with_is_one_line) {
  const auto line = [](const std::string& where, const char* needle) {
    std::vector<std::string> told;
    BridgeOptions o;
    o.where = where;
    o.patience = 0.1f;
    EXPECT_FALSE(open_bridge(o, told).any()) << where;
    ASSERT_EQ(told.size(), 1u) << where;
    EXPECT_NE(told[0].find(needle), std::string::npos) << told[0];
    EXPECT_EQ(told[0].find('\n'), std::string::npos);
  };
  std::string why;
  const int fd = bridge_socket("127.0.0.1:0", true, why);  // somebody who never answers
  ASSERT_GE(fd, 0);
  sockaddr_storage own{}, peer{};
  socklen_t bytes = sizeof own;
  getsockname(fd, reinterpret_cast<sockaddr*>(&own), &bytes);
  const std::string there = "127.0.0.1:" + std::to_string(ntohs(reinterpret_cast<sockaddr_in*>(&own)->sin_port));
  line(there, "start `catgut bridge` where the arm is");
  line("127.0.0.1:99999", "is no HOST:PORT");
  line("127.0.0.1:x", "is no HOST:PORT");
  line(":5", "is no HOST:PORT");
  // Another version, one that has lent its arms, one that has none.
  for (const int kind : {0, 1, 2}) {
    std::atomic<bool> quit{false};
    std::thread arm([&] {
      while (!quit) {
        uint8_t data[300];
        socklen_t size = sizeof peer;
        pollfd wait{fd, POLLIN, 0};
        if (poll(&wait, 1, 1) <= 0) continue;
        const ssize_t n = recvfrom(fd, data, sizeof data, MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&peer), &size);
        BridgeHead h;
        if (n <= 0 || read_bridge(data, static_cast<size_t>(n), h) != BridgeFault::none) continue;
        BridgeBytes b;
        h.kind = BridgeKind::refused;
        if (kind == 0) h.version = 3;
        write_plain(b, h, kArmsTaken);
        if (kind == 2) h.kind = BridgeKind::info, write_info(b, h, {});
        sendto(fd, b.data(), b.size(), 0, reinterpret_cast<sockaddr*>(&peer), size);
        h.arm = 1;
        if (kind == 2) write_info(b, h, {}), sendto(fd, b.data(), b.size(), 0, reinterpret_cast<sockaddr*>(&peer), size);
      }
    });
    line(there, kind == 0 ? "speaks version 3 of the bridge" : kind == 1 ? "another simulator has the arms" : "has no arm");
    quit = true;
    arm.join();
  }
  ::close(fd);
}

// The sample in another language is an arm: it answers, moves, and feels the force.
TEST(Bridge, an_arm_in_python) {
  if (std::system("python3 -c 'import zlib' >/dev/null 2>&1") != 0) GTEST_SKIP() << "python3 is not installed";
  int out[2];
  ASSERT_EQ(pipe(out), 0);
  const pid_t child = fork();
  if (child == 0) {
    dup2(out[1], 1);
    ::close(out[0]);
    execlp("python3", "python3", CATGUT_SOURCE_DIR "/samples/bridge_arm.py", "0", nullptr);
    _exit(127);
  }
  ::close(out[1]);
  std::string text;
  for (char c = 0; read(out[0], &c, 1) == 1 && c != '\n';) text += c;
  BridgeOptions o;
  o.where = "127.0.0.1:" + text.substr(text.find_last_of(' ') + 1);
  o.patience = 5;
  std::vector<std::string> told;
  ArmPort port = open_bridge(o, told);
  for (const std::string& line : told) ADD_FAILURE() << line;
  EXPECT_TRUE(port.arm[0].present && !port.arm[1].present);
  EXPECT_EQ(port.arm[0].serial, "py-1");
  if (port.any()) {
    static std::atomic<float> at{0};
    std::string why;
    const auto step = [](void*, size_t, const ArmSample& s) {
      if (s.state == ArmState::ready) at = s.pose.p.x;
      return Vec3{0.4f, 0, 0};
    };
    EXPECT_TRUE(port.start(port.self, {step, nullptr}, why));
    EXPECT_TRUE(wait_for([] { return at > 0.035f; })) << "0.4 N on 20 N/m are 20 mm from where it was: " << at;
    // Killed: the arm is lost, nothing hangs.
    kill(child, SIGKILL);
    EXPECT_TRUE(wait_for([&] { return !port.status(port.self, 0).ready; }));
  }
  port.reset();
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  ::close(out[0]);
}

}  // namespace
}  // namespace catgut
