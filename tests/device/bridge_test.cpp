// SPDX-License-Identifier: Apache-2.0
// tests/device: the bridge. The device server (runtime/arm_server) serves the simulated devices of fake_hd, a millisecond at a
// time, to a minimal simulator in this test. The simulator's side (device/bridge) is tested with that device server, and
// with one written in Python. The system assigns every port.
#include "device/bridge.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <random>
#include <thread>

#include "core/check.h"
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

// A simulator, as seen by the device server.
struct Simulator {
  int fd = -1;
  BridgeCaller caller;
  BridgeKey in{}, out{};
  uint64_t counter = 0;
  uint64_t bytes_in = 0, bytes_out = 0;
  std::array<uint64_t, 2> sampled{}, newest{};  // times and counters of the newest samples
  std::array<ArmSample, 2> sample;
  std::array<ArmForce, 2> felt;
  std::array<ArmInfo, 2> info;
  int infos = 0, byes = 0, samples = 0, forged = 0;
  bool cookie = false, opened = false;
  uint32_t refused = 0;
  uint16_t refused_version = 0;
  BridgeBytes hello{}, open{};  // as sent

  explicit Simulator(uint16_t port, const BridgeKey& shared = {}) {
    std::string why;
    fd = bridge_socket("127.0.0.1:" + std::to_string(port), false, why);
    if (fd < 0) ADD_FAILURE() << why;
    caller.shared = shared;
    begin_call(caller);
  }
  ~Simulator() { ::close(fd); }
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;
  void send(const void* data, size_t size) {
    bytes_out += size;
    (void)!::send(fd, data, size, 0);
  }
  void send(const BridgeBytes& b) { send(b.data(), b.size()); }
  BridgeBytes sealed(BridgeKind kind, size_t arm, const BridgePayload& payload) {
    BridgeBytes b;
    seal(out, {kind, static_cast<uint8_t>(arm), kBridgeVersion, ++counter}, payload, b);
    return b;
  }
  BridgeBytes order(size_t arm, Vec3 force) {
    ForcePatch p;
    p.point = sample[arm].pose.p, p.force = force, p.time_ns = sampled[arm], p.period = 0.001f;
    BridgePayload payload;
    write_patch(p, payload);
    return sealed(BridgeKind::patch, arm, payload);
  }
  void take() {
    uint8_t data[300];
    for (ssize_t n; (n = recv(fd, data, sizeof data, MSG_DONTWAIT)) > 0;) {
      bytes_in += static_cast<uint64_t>(n);
      process(data, static_cast<size_t>(n));
    }
  }
  void process(const uint8_t* data, size_t n) {
    BridgeHead h;
    ASSERT_TRUE(read_head(data, n, h) == BridgeFault::none);
    BridgePayload p;
    uint32_t faults = 0;
    if (h.kind == BridgeKind::refused) refused = refused_why(data), refused_version = h.version;
    else if (h.kind == BridgeKind::cookie) cookie |= take_cookie(caller, data);
    else if (h.kind == BridgeKind::opened) opened |= take_opened(caller, data, in, out);
    else if (!unseal(in, data, p)) ++forged;
    else if (h.kind == BridgeKind::bye) ++byes;
    else if (h.kind == BridgeKind::info) infos += read_info(p, info[h.arm]);
    else if (h.kind == BridgeKind::sample && h.counter > newest[h.arm])
      newest[h.arm] = h.counter, samples += read_sample(p, sample[h.arm], felt[h.arm], faults),
      sampled[h.arm] = sample[h.arm].time_ns;
  }
  // Each step repeated until it is answered; false: it never was.
  bool connect() {
    const auto step = [this](const BridgeBytes& b, const auto& done) {
      send(b);
      return wait_for([&] { return take(), done() || refused; }) && !refused;
    };
    return step(hello = hello_packet(caller), [this] { return cookie; }) &&
           step(open = open_packet(caller), [this] { return opened; }) &&
           step(sealed(BridgeKind::ask, 0, {}), [this] { return infos >= 2; });
  }
};

// The simulated devices, served. Measurements are in their own milliseconds.
struct Lent {
  FakeHd fake{true};
  std::vector<std::string> messages;
  std::unique_ptr<ArmServer> server;
  std::unique_ptr<Simulator> simulator;
  std::array<Vec3, 2> force{};              // in the simulator's patches
  std::array<bool, 2> answers{true, true};  // and whether it sends them
  uint64_t heard_ns = 0;                    // time of its last packet

  explicit Lent(float forget = 1) {
    ArmServerOptions o;
    o.listen = "127.0.0.1:0";
    o.clock = [] { return test_ns.load(); };
    o.forget = forget;
    server = std::make_unique<ArmServer>(open_touch({}, messages), o);
    EXPECT_TRUE(messages.empty());
  }
  void connect() {
    simulator = std::make_unique<Simulator>(server->port());
    ASSERT_TRUE(simulator->connect());
    heard_ns = test_ns;
  }
  bool streams() const { return test_ns < heard_ns + 200000000; }
  void ms() {
    test_ns += 1000000;
    fake.step(1);
    if (!simulator || !streams()) return;
    ASSERT_TRUE(
        wait_for([&] { return simulator->take(), simulator->sampled[0] == test_ns && simulator->sampled[1] == test_ns; }));
    const uint64_t before = server->counts().accepted;
    uint64_t sent = 0;
    for (size_t k = 0; k < 2; ++k)
      if (answers[k]) simulator->send(simulator->order(k, force[k])), ++sent;
    if (sent > 0) heard_ns = test_ns;
    ASSERT_TRUE(wait_for([&] { return server->counts().accepted >= before + sent; }));
  }
  template <typename F>
  void run(int count, const F& each) {
    for (int k = 0; k < count && !testing::Test::HasFatalFailure(); ++k) ms(), each(k);
  }
  void run(int count) {
    run(count, [](int) {});
  }
  // Engages the force, with a hand in free air at first, then renders these.
  void engage(Vec3 right, Vec3 left, int settle = 1500) {
    connect();
    run(2100);
    force = {right, left};
    run(settle);  // the hand settles
    server->news();
    fake.zero(0), fake.zero(1);
  }
};

// The layout is a contract with programs in other languages: byte for byte.
TEST(Bridge, a_packet_is_what_it_says) {
  ForcePatch f;
  f.time_ns = 11, f.tick = 12, f.epoch = 13, f.discontinuity_id = 14, f.period = 0.5f;
  f.point = {1, -2, 0.5f}, f.force = {3, 0, 0}, f.stiffness = {1, 2, 3, 4, 5, 6}, f.damping = identity(2);
  f.normal = {0, 1, 0}, f.gap = 0.25f, f.along = {1, 0, 0}, f.pierce = {0, 0, 1}, f.pierce_force = 0.75f, f.cap = 2;
  BridgePayload p;
  write_patch(f, p);
  const uint8_t begin[] = {11, 0, 0, 0, 0, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 13, 0, 0, 0, 14, 0, 0, 0, 0, 0, 0, 0x3f};
  EXPECT_EQ(std::memcmp(p.data(), begin, sizeof begin), 0);
  const uint8_t point[] = {0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f, 0, 0, 0x40, 0x40};
  EXPECT_EQ(std::memcmp(&p[32], point, sizeof point), 0);
  const uint8_t cap[] = {0, 0, 0, 0x40, 0, 0, 0, 0};
  EXPECT_EQ(std::memcmp(&p[168], cap, sizeof cap), 0);
  ForcePatch g;
  ASSERT_TRUE(read_patch(p, g));
  BridgePayload q;
  write_patch(g, q);
  EXPECT_EQ(p, q);
  f.force.x = std::nanf("");
  write_patch(f, p);
  EXPECT_FALSE(read_patch(p, g)) << "no number ever travels";

  BridgeKey key = random_key(), other = key;
  other[31] ^= 1;
  BridgeBytes b;
  seal(key, {BridgeKind::patch, 1, kBridgeVersion, 0x0102030405060708}, q, b);
  const uint8_t head[] = {0x43, 0x41, 0x47, 0x42, 2, 0, 9, 1, 8, 7, 6, 5, 4, 3, 2, 1};
  EXPECT_EQ(std::memcmp(b.data(), head, sizeof head), 0);
  EXPECT_TRUE(unseal(key, b.data(), p));
  EXPECT_EQ(p, q);
  EXPECT_FALSE(unseal(other, b.data(), p));
  for (size_t k = 0; k < b.size(); ++k) {  // the head is sealed, too
    BridgeBytes bad = b;
    bad[k] ^= 1;
    EXPECT_FALSE(unseal(key, bad.data(), p)) << k;
  }

  ArmSample s;
  s.state = ArmState::ready;
  s.time_ns = 9;
  s.pose = {{0.01f, -0.02f, 0.03f}, axis_angle(normalized(Vec3{1, 2, 3}), 1)};
  s.velocity = {0.1f, 0, -0.1f};
  s.buttons = 3, s.warmth = 0.25f, s.forced_off = true;
  s.jaw = 0.5f;
  write_sample(s, {{0, 1, 0}, {0.01f, 0, -0.02f}, 1.5f}, 5, p);
  ArmForce felt;
  ArmSample t;
  uint32_t faults = 0;
  ASSERT_TRUE(read_sample(p, t, felt, faults));
  EXPECT_TRUE(t.state == ArmState::ready && t.pose.p == s.pose.p && t.velocity == s.velocity && t.forced_off);
  EXPECT_LT(length(rotation_vector(t.pose.q * conjugate(s.pose.q))), 1e-5f);
  EXPECT_TRUE(t.buttons == 3 && t.warmth == 0.25f && t.jaw == 0.5f && felt.force == (Vec3{0, 1, 0}) && faults == 5 &&
              t.time_ns == 9);
  EXPECT_TRUE(felt.torque == (Vec3{0.01f, 0, -0.02f}) && felt.grip == 1.5f);
  s.pose.p.y = std::nanf("");
  write_sample(s, {}, 0, p);
  ASSERT_TRUE(read_sample(p, t, felt, faults));
  EXPECT_TRUE(t.state == ArmState::absent);

  ArmInfo info, back;
  info.present = true;
  info.name = std::string(100, 'n'), info.serial = "s\n\x1b[2J";
  info.limits = {2, 1, 300, 4, 0.2f, 1, 0.07f, 8, 2000};
  info.most = {1, 2, 3};
  write_info(info, p);
  ASSERT_TRUE(read_info(p, back));
  EXPECT_TRUE(back.present && back.name == std::string(39, 'n') && back.limits.force == 2 && back.most == info.most);
  EXPECT_TRUE(back.limits.torque == 0.2f && back.limits.turn_stiffness == 1 && back.limits.turn_damping == 0.07f);
  EXPECT_TRUE(back.limits.grip == 8 && back.limits.grip_stiffness == 2000);
  EXPECT_EQ(back.serial, "s??[2J") << "shown on terminals";

  ForcePatch patch, same;
  patch.turn = axis_angle({0, 0, 1}, 0.5f), patch.lever = {0.01f, 0.02f, 0.03f}, patch.couple = {0, 0.004f, 0};
  patch.couple_stiffness = 0.1f, patch.grip_from = 0.35f, patch.grip_stiffness = 12, patch.cap = 2;
  write_patch(patch, p);
  ASSERT_TRUE(read_patch(p, same));
  EXPECT_TRUE(same.lever == patch.lever && same.couple == patch.couple && same.couple_stiffness == patch.couple_stiffness);
  EXPECT_TRUE(same.grip_from == patch.grip_from && same.grip_stiffness == patch.grip_stiffness && same.cap == 2);
  EXPECT_LT(length(rotation_vector(same.turn * conjugate(patch.turn))), 1e-6f);
}

// Arbitrary bytes: dropped; neither side crashes or moves a device.
TEST(Bridge, whatever_bytes_come) {
  Lent t;
  t.engage({0.8f, 0, 0}, {0, 0.6f, 0});
  const std::array<Vec3, 2> held{t.fake.force(0), t.fake.force(1)};
  ASSERT_NEAR(length(held[0]), 0.8f, 0.01f);
  std::mt19937 draw(7);
  const auto any = [&draw](uint32_t below) { return draw() % below; };
  const BridgeCounts before = t.server->counts();
  Simulator unknown_peer(t.server->port());
  uint64_t sent = 0;
  for (int round = 0; round < 60; ++round) {
    for (int k = 0; k < 50; ++k, ++sent) {
      const BridgeBytes good = t.simulator->order(any(2), {3, 3, 3});
      std::vector<uint8_t> bad(good.begin(), good.end());
      if (any(3) == 0) {
        bad.resize(any(300));
        for (uint8_t& b : bad) b = static_cast<uint8_t>(draw());
      } else if (any(2)) {
        bad[any(256)] ^= static_cast<uint8_t>(1 + any(255));
      } else {
        bad.resize(any(256));
      }
      // From the simulator's own address and from an unknown one.
      (any(2) ? *t.simulator : unknown_peer).send(bad.data(), bad.size());
      if (any(4) == 0) unknown_peer.send(good), ++sent;  // authentic, but from another address
    }
    t.ms();
    ASSERT_TRUE(t.fake.force(0) == held[0] && t.fake.force(1) == held[1]) << "nothing of it reaches the motors";
  }
  ASSERT_TRUE(wait_for([&] { return t.server->counts().dropped() >= before.dropped() + sent; }));
  EXPECT_GT(t.server->counts().garbage, 1000u);
  EXPECT_GT(t.server->counts().forged, 100u);
  EXPECT_GT(t.server->counts().unknown_peer, 100u);
}

// One by one: each packet is dropped for the counted reason.
TEST(Bridge, what_is_dropped_and_why) {
  Lent t;
  t.engage({0.8f, 0, 0}, {});
  const Vec3 held = t.fake.force(0);
  const auto drops = [&](const char* what, uint64_t BridgeCounts::*counter, const std::function<void()>& send) {
    const BridgeCounts before = t.server->counts();
    send();
    EXPECT_TRUE(wait_for([&] { return t.server->counts().dropped() > before.dropped(); })) << what;
    EXPECT_EQ(t.server->counts().*counter, before.*counter + 1) << what;
    t.ms();
    EXPECT_TRUE(t.fake.force(0) == held) << what;
  };
  Simulator& s = *t.simulator;
  drops("magic", &BridgeCounts::garbage, [&] {
    BridgeBytes b = s.order(0, {3, 0, 0});
    b[0] ^= 1;
    s.send(b);
  });
  drops("a bit", &BridgeCounts::forged, [&] {
    BridgeBytes b = s.order(0, {3, 0, 0});
    b[40] ^= 1;
    s.send(b);
  });
  drops("another session's", &BridgeCounts::forged, [&] {
    const BridgeKey own = s.out;
    s.out = random_key();
    s.send(s.order(0, {3, 0, 0}));
    s.out = own;
  });
  drops("version", &BridgeCounts::version, [&] {
    BridgeBytes b = hello_packet(s.caller);
    b[4] = 3;
    s.send(b);
  });
  EXPECT_TRUE(wait_for([&] { return s.take(), s.refused == kOtherVersion; })) << "and whoever asked is told";
  EXPECT_EQ(s.refused_version, kBridgeVersion);
  drops("an arm beyond two", &BridgeCounts::invalid, [&] { s.send(s.sealed(BridgeKind::bye, 2, {})); });
  drops("a kind that is none", &BridgeCounts::invalid, [&] { s.send(s.sealed(static_cast<BridgeKind>(99), 0, {})); });
  drops("a kind that the arm's end sends", &BridgeCounts::invalid, [&] { s.send(s.sealed(BridgeKind::info, 0, {})); });
  drops("a force that no arm has", &BridgeCounts::invalid, [&] { s.send(s.order(0, {1e20f, 0, 0})); });
  const BridgeBytes first = s.order(0, {3, 0, 0}), second = s.order(0, {0.8f, 0, 0});
  s.send(second);
  drops("overtaken", &BridgeCounts::old, [&] { s.send(first); });
  drops("repeated", &BridgeCounts::old, [&] { s.send(second); });
  drops("a repeated open", &BridgeCounts::forged, [&] {  // from another address: its cookie is not valid there
    Simulator other(t.server->port());
    other.send(s.open);
  });
  drops("another simulator", &BridgeCounts::unknown_peer, [&] {
    Simulator other(t.server->port());
    EXPECT_FALSE(other.connect());
    EXPECT_EQ(other.refused, kArmsTaken);
  });
  // Authentic and from the right address, but not written to the motors unchanged: the limits apply here, too.
  t.force[0] = {20, 0, 0};
  float most = 0;
  t.run(300, [&](int) { most = std::max(most, length(t.fake.force(0))); });
  EXPECT_GT(most, 3);
  EXPECT_LE(most, 3.3f + 1e-4f);
  EXPECT_LE(t.fake.at(0).step_most, 0.5 + 1e-4);
}

// S6: an unauthenticated sender gets at most as many bytes as it sent, and nothing for replayed or forged packets.
TEST(Bridge, S6_no_amplification) {
  Lent t;
  t.connect();
  const BridgeBytes hello = t.simulator->hello, open = t.simulator->open, patch = t.simulator->order(0, {1, 0, 0});
  BridgeBytes bye = t.simulator->sealed(BridgeKind::bye, 0, {});
  t.simulator->send(bye);
  ASSERT_TRUE(wait_for([&] {
    for (const std::string& line : t.server->news())
      if (line.find("released by") != std::string::npos) return true;
    return false;
  }));
  t.simulator.reset();
  BridgeKey wrong = random_key();
  BridgeCaller unknown_peer;
  unknown_peer.shared = wrong;
  begin_call(unknown_peer);
  BridgeBytes other_version = hello;
  other_version[4] = 9;
  struct Try {
    const char* what;
    BridgeBytes packet;
    bool answered;
  };
  for (const Try& a : {Try{"hello", hello, true}, Try{"open of another address", open, false}, Try{"patch", patch, false},
                       Try{"bye", bye, false}, Try{"hello with another key", hello_packet(unknown_peer), false},
                       Try{"another version", other_version, true}}) {
    Simulator s(t.server->port());
    const BridgeCounts before = t.server->counts();
    const uint64_t sent_before = t.server->sent_bytes();
    for (int k = 0; k < 20; ++k) s.send(a.packet), t.ms();
    ASSERT_TRUE(wait_for(
        [&] { return t.server->counts().accepted + t.server->counts().dropped() >= before.accepted + before.dropped() + 20; }));
    for (int k = 0; k < 500; ++k) t.ms();  // remaining packets
    const uint64_t answered = t.server->sent_bytes() - sent_before;
    std::printf("S6: %-24s %5llu bytes in, %5llu out\n", a.what, static_cast<unsigned long long>(s.bytes_out),
                static_cast<unsigned long long>(answered));
    EXPECT_LE(answered, s.bytes_out) << a.what;
    EXPECT_EQ(answered > 0, a.answered) << a.what;
  }
}

// A network between simulator and server: each packet takes `delay` and up to `spread` more, so that they overtake each other.
// Some are lost, some repeated later, some are forged on the way or by a stranger.
struct Network {
  double delay = 0, spread = 0;  // [ms]
  double lost = 0, replayed = 0, forged = 0;
  using Packet = std::vector<uint8_t>;
  std::multimap<uint64_t, Packet> to_server, to_simulator;  // by the time of their arrival [ns]
  std::vector<Packet> overheard;
  std::mt19937 draw{5};
  uint64_t lost_count = 0, replayed_count = 0, forged_count = 0, overtaken = 0, last = 0;

  double uniform() { return std::uniform_real_distribution<double>(0, 1)(draw); }
  void send(std::multimap<uint64_t, Packet>& way, const uint8_t* data, size_t size) {
    if (uniform() < lost) {
      ++lost_count;
      return;
    }
    const uint64_t at = test_ns + static_cast<uint64_t>(1e6 * (delay + spread * uniform()));
    way.emplace(at, Packet(data, data + size));
    if (&way != &to_server) return;
    if (at < last) ++overtaken;
    last = at;
    overheard.emplace_back(data, data + size);
    if (overheard.size() > 500) overheard.erase(overheard.begin());
    if (uniform() < replayed) ++replayed_count, way.emplace(at, overheard[draw() % overheard.size()]);
    if (uniform() < forged) {
      ++forged_count;
      Packet bad(data, data + size);
      bad[draw() % bad.size()] ^= static_cast<uint8_t>(1 + draw() % 255);
      way.emplace(at, bad);
    }
  }
  template <typename F>
  static void arrive(std::multimap<uint64_t, Packet>& way, const F& each) {
    while (!way.empty() && way.begin()->first <= test_ns) each(way.begin()->second), way.erase(way.begin());
  }
};

// H3 over both real ends' packets: a hand on an imperfect device presses a wall that the simulator computes at the far end of a
// network. In every case the hand gets no energy, the motors get no step, and strangers get at most the bytes that they sent.
TEST(Bridge, S6_a_bad_network_gives_no_energy) {
  struct Case {
    double delay;
    bool rough;
  };
  for (const Case c :
       {Case{0, false}, Case{0, true}, Case{5, true}, Case{15, true}, Case{30, true}, Case{50, false}, Case{50, true}})
    for (const double grip : {0.05, 0.8}) {
      SCOPED_TRACE(testing::Message() << c.delay << " ms each way" << (c.rough ? ", rough" : "") << ", grip " << grip
                                      << " N/mm");
      Lent t;
      const FakeHdUnkind unkind{0.055, 2, 0.05, 0.002, 0.002, 0, 9};
      t.connect();
      Simulator& s = *t.simulator;
      t.fake.unkind(&unkind);
      for (int k = 0; k < 2; ++k) t.fake.grip(k, grip, grip < 0.1 ? 0.001 : 0.004, 0.1, 0.01);
      Network net;
      net.delay = c.delay;
      if (c.rough) net.spread = 2 + 0.4 * c.delay, net.lost = 0.1, net.replayed = 0.1, net.forged = 0.1;
      Simulator stranger(t.server->port());
      uint64_t stranger_bytes = 0;
      const BridgeCounts before = t.server->counts();
      uint64_t sent = 0;
      float felt = 0, low = 1e9f, high = -1e9f;
      const double deep = 0.004 + 0.004 + 0.0008 / grip;  // 0.8 N, however soft the hand
      const auto rise = [](double x) { return x = std::clamp(x, 0.0, 1.0), x * x * x * (10 + x * (6 * x - 15)); };
      for (int ms = 0; ms < 5500 && !HasFatalFailure(); ++ms) {
        const double at = 1e-3 * ms - 2.4;
        t.fake.wish(0, {0, static_cast<float>(0.004 - deep * (rise(at / 0.4) - rise((at - 2.4) / 0.4))), 0});
        if (ms == 2390) t.fake.zero(0);
        test_ns += 1000000;
        t.fake.step(1);
        uint8_t data[300];
        for (ssize_t n; (n = recv(s.fd, data, sizeof data, MSG_DONTWAIT)) > 0;)
          net.send(net.to_simulator, data, static_cast<size_t>(n));
        Network::arrive(net.to_simulator, [&](const Network::Packet& p) { s.process(p.data(), p.size()); });
        // A wall at y = 0 that hardens (600 z + 1.5e5 z^2 behind 300 N/m) and rubs, as at 1 kHz.
        const Vec3 seen = s.sample[0].pose.p;
        const float depth = std::max(0.0f, -seen.y), z = (-900 + std::sqrt(810000 + 1.8e8f * depth)) / 3e5f,
                    tangent = 600 + 3e5f * z, force = 600 * z + 1.5e5f * z * z, slope = 300 * tangent / (300 + tangent);
        ForcePatch wall;
        wall.period = 0.001f, wall.time_ns = s.sampled[0];
        wall.normal = {0, 1, 0}, wall.stiffness = outer({0, 1, 0}, slope), wall.coefficient = 0.3f;
        wall.point = {seen.x, std::min(0.0f, seen.y), seen.z};
        wall.force = {0, force, 0}, wall.gap = force / slope;
        BridgePayload payload;
        write_patch(wall, payload);
        const BridgeBytes order = s.sealed(BridgeKind::patch, 0, payload);
        net.send(net.to_server, order.data(), order.size());
        Network::arrive(net.to_server, [&](const Network::Packet& p) { s.send(p.data(), p.size()), ++sent; });
        if (c.rough && ms % 10 == 0 && !net.overheard.empty()) {  // repeated by a stranger from another address
          const Network::Packet& p = net.overheard[static_cast<size_t>(ms) % net.overheard.size()];
          stranger.send(p.data(), p.size()), ++sent;
        }
        ASSERT_TRUE(wait_for([&] {
          const BridgeCounts now = t.server->counts();
          return now.accepted + now.dropped() >= before.accepted + before.dropped() + sent;
        }));
        if (at < 0) continue;
        felt = std::max(felt, length(t.fake.force(0)));
        if (at > 1.4 && at < 2.3) low = std::min(low, t.fake.position(0).y), high = std::max(high, t.fake.position(0).y);
      }
      uint8_t data[300];
      for (ssize_t n; (n = recv(stranger.fd, data, sizeof data, MSG_DONTWAIT)) > 0;) stranger_bytes += static_cast<uint64_t>(n);
      const FakeHdArm a = t.fake.at(0);
      const BridgeCounts now = t.server->counts();
      std::printf(
          "bridge, %2.0f ms each way%s, hand %3.0f N/m: energy of the motors %6.3f mJ, to the hand %.3f mJ; %.2f N, "
          "step %.3f N, swing %.3f mm\n",
          c.delay, c.rough ? ", rough" : "", 1e3 * grip, 1e3 * a.energy_most, 1e3 * a.to_hand_most, double{felt}, a.step_most,
          1e3 * double{high - low});
      if (c.rough)
        std::printf(
            "  of %llu packets lost %llu, overtaken %llu, replayed %llu, forged %llu; dropped as old %llu, forged %llu; "
            "a stranger got %llu bytes for %llu\n",
            static_cast<unsigned long long>(sent), static_cast<unsigned long long>(net.lost_count),
            static_cast<unsigned long long>(net.overtaken), static_cast<unsigned long long>(net.replayed_count),
            static_cast<unsigned long long>(net.forged_count), static_cast<unsigned long long>(now.old),
            static_cast<unsigned long long>(now.forged), static_cast<unsigned long long>(stranger_bytes),
            static_cast<unsigned long long>(stranger.bytes_out));
      EXPECT_LE(a.to_hand_most, 0.5e-3);
      EXPECT_LE(high - low, 0.2e-3f);
      EXPECT_LE(a.step_most, 0.5 + 1e-4);
      EXPECT_LE(a.force_most, 3.3 + 1e-4);
      EXPECT_GT(felt, 0.3f) << "nothing was felt";
      EXPECT_LE(stranger_bytes, stranger.bytes_out);
      if (c.rough) {
        EXPECT_GT(net.overtaken, 100u);
        EXPECT_GT(now.old, net.replayed_count * 8 / 10);
        EXPECT_GT(now.forged, net.forged_count * 8 / 10);
      }
    }
}

// S6: samples to a silent simulator stop after 200 ms.
TEST(Bridge, S6_the_stream_stops) {
  Lent t;
  t.connect();
  t.run(50);
  const uint64_t at = test_ns;
  for (int k = 0; k < 1000; ++k) test_ns += 1000000, t.fake.step(1), t.simulator->take();
  uint64_t newest = 0;
  ASSERT_TRUE(wait_for([&] { return t.simulator->take(), newest = t.simulator->sampled[0], newest >= at + 198000000; }));
  const uint64_t sent = t.server->sent_bytes();
  for (int k = 0; k < 1000; ++k) test_ns += 1000000, t.fake.step(1);
  EXPECT_EQ(t.server->sent_bytes(), sent);
  t.simulator->take();
  EXPECT_LE(t.simulator->sampled[0], at + 200000000);
  // They resume with a valid packet of the same session.
  t.simulator->send(t.simulator->sealed(BridgeKind::ask, 0, {}));
  t.heard_ns = test_ns;
  ASSERT_TRUE(wait_for([&] { return t.simulator->take(), t.simulator->infos >= 4; }));
  t.run(5);
}

// S6: any address but loopback requires a key, in a file readable by its owner only; another key, or none, gets
// nothing.
TEST(Bridge, S6_keys) {
  const std::string file = testing::TempDir() + "bridge.key", open_file = testing::TempDir() + "open.key";
  for (const std::string& f : {file, open_file}) unlink(f.c_str()), write_bridge_key(f);
  EXPECT_THROW(write_bridge_key(file), InputError) << "never over an old one";
  chmod(open_file.c_str(), 0644);
  EXPECT_THROW(read_bridge_key(open_file), InputError);
  EXPECT_NO_THROW(read_bridge_key(file));
  FakeHd fake(true);
  std::vector<std::string> messages;
  ArmServerOptions o;
  o.clock = [] { return test_ns.load(); };
  o.listen = "0.0.0.0:0";
  try {
    ArmServer server(open_touch({}, messages), o);
    ADD_FAILURE() << "it listens to everybody";
  } catch (const InputError& error) { EXPECT_NE(std::string(error.what()).find("--key"), std::string::npos) << error.what(); }
  fake.reset();
  o.key = file;
  ArmServer server(open_touch({}, messages), o);
  Simulator right(server.port(), read_bridge_key(file)), none(server.port()), wrong(server.port(), random_key());
  none.send(hello_packet(none.caller)), wrong.send(hello_packet(wrong.caller));
  EXPECT_TRUE(right.connect());
  EXPECT_TRUE(wait_for([&] { return server.counts().forged >= 2; }));
  none.take(), wrong.take();
  EXPECT_EQ(none.bytes_in + wrong.bytes_in, 0u);
  // The simulator's side, likewise: another machine without a key is not contacted.
  BridgeOptions to;
  to.where = "192.0.2.1";
  EXPECT_FALSE(open_bridge(to, messages).any());
  ASSERT_FALSE(messages.empty());
  EXPECT_NE(messages.back().find("needs a key"), std::string::npos) << messages.back();
  right.send(right.sealed(BridgeKind::bye, 0, {}));
  messages.clear();
  to.where = "127.0.0.1:" + std::to_string(server.port()), to.key = file, to.patience = 5;
  EXPECT_TRUE(open_bridge(to, messages).any());
  to.key.clear(), to.patience = 0.1f;
  EXPECT_FALSE(open_bridge(to, messages).any());
}

// "Killing the bridge peer at any moment brings the force to zero within 100 ms without a step beyond the slew limit."
TEST(Bridge, the_simulator_dies) {
  Lent t;
  t.engage({3.5f, 0, 0}, {0, 0.9f, 0}, 400);  // not longer: 2.5 N make motors warm
  ASSERT_GT(length(t.fake.force(0)), 2.2f);
  t.answers = {false, false};
  int zero[2] = {0, 0};
  std::array<float, 2> last{length(t.fake.force(0)), length(t.fake.force(1))};
  t.run(300, [&](int k) {
    for (size_t a = 0; a < 2; ++a) {
      const float f = length(t.fake.force(static_cast<int>(a)));
      if (f == 0 && zero[a] == 0) zero[a] = k + 1;
      if (k > 30) { EXPECT_LE(f, last[a] + 1e-5f) << "only ever less"; }
      last[a] = f;
    }
  });
  std::printf("peer dead at 2.5 and 0.9 N: zero after %d and %d ms; largest step %.3f N/ms\n", zero[0], zero[1],
              t.fake.at(0).step_most);
  for (int a = 0; a < 2; ++a) {
    EXPECT_GT(zero[a], 30);
    EXPECT_LE(zero[a], 100);
    EXPECT_EQ(length(t.fake.force(a)), 0);
    EXPECT_LE(t.fake.at(a).step_most, 0.5 + 1e-4);
  }
  bool messages = false;
  for (const std::string& line : t.server->news()) messages |= line.find("silent") != std::string::npos;
  EXPECT_TRUE(messages);
  // Force returns as wanted: it engages only at a small wanted force, and then over two seconds.
  t.answers = {true, true};
  t.simulator->send(t.simulator->sealed(BridgeKind::ask, 0, {}));
  ASSERT_TRUE(wait_for([&] { return t.simulator->take(), t.simulator->infos >= 4; }));
  t.heard_ns = test_ns;
  t.run(100);
  EXPECT_EQ(length(t.fake.force(0)), 0);
  t.force = {};
  t.run(20);
  t.force = {Vec3{1, 0, 0}, Vec3{}};
  t.run(200);
  EXPECT_GT(length(t.fake.force(0)), 0);
  EXPECT_LT(length(t.fake.force(0)), 0.2f);
}

// The same when patches of only one device stop, or one device is lost here: the other's force is unchanged to the bit.
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
    EXPECT_LE(zero, lost ? 2 : 100);  // 0.9 N in steps of 0.5 N
    EXPECT_EQ(bad, 0);
    EXPECT_EQ(t.fake.at(1).step_most, 0);
    EXPECT_TRUE((t.simulator->sample[0].state == ArmState::ready) == !lost) << "and the simulator is told which it was";
    EXPECT_TRUE(t.simulator->sample[1].state == ArmState::ready);
  }
}

// The age of a patch is that of its sample, by the server's clock. A queue that stalls and then arrives at once does not
// look fresh.
TEST(Bridge, late_is_late) {
  Lent t;
  t.engage({0.9f, 0, 0}, {});
  t.answers[0] = false;
  const uint64_t old = t.simulator->sampled[0];
  int zero = 0;
  t.run(300, [&](int k) {
    const uint64_t now = t.simulator->sampled[0];
    t.simulator->sampled[0] = old;
    t.simulator->send(t.simulator->order(0, {0.9f, 0, 0}));
    t.simulator->sampled[0] = now;
    if (length(t.fake.force(0)) == 0 && zero == 0) zero = k + 1;
  });
  EXPECT_GT(zero, 150);
  EXPECT_LE(zero, 250);
}

TEST(Bridge, arms_are_given_back_and_lent_again) {
  Lent t;
  t.engage({0.9f, 0, 0}, {});
  t.simulator->send(t.simulator->sealed(BridgeKind::bye, 0, {}));
  ASSERT_TRUE(wait_for([&] {
    for (const std::string& line : t.server->news())
      if (line.find("released by") != std::string::npos) return true;
    return false;
  }));
  t.simulator.reset();
  t.run(10);
  EXPECT_EQ(length(t.fake.force(0)), 0);
  EXPECT_LE(t.fake.at(0).step_most, 0.5 + 1e-4);
  t.connect();  // another one, at once
  t.run(5);
  // A crashed one is forgotten after a second.
  t.simulator.reset();
  test_ns += 1500000000;
  t.connect();
  t.run(5);
  t.server->stop();
  EXPECT_TRUE(wait_for([&] { return t.simulator->take(), t.simulator->byes == 1; }));
}

// Both sides: the simulated devices, served in lock step to device/bridge.
struct Both : Lent {
  ArmPort port;
  std::array<std::atomic<float>, 2> pull{};  // [N] along x
  std::array<std::atomic<bool>, 2> there{};
  std::array<std::atomic<float>, 2> at{};    // [m] along x
  std::atomic<bool> physics_is_dead{false};  // no more patches; the rest runs
  std::atomic<bool> hangs{false};            // the whole simulator, like a killed process
  static ArmForce step(void* user, size_t k, const ArmSample& s) {
    Both& t = *static_cast<Both*>(user);
    while (t.hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ForcePatch p;
    p.point = s.pose.p;
    p.period = 0.001f, p.time_ns = s.time_ns;
    p.force = {t.pull[k], 0, 0};
    if (!t.physics_is_dead) t.port.send_patch(t.port.self, k, p);
    t.there[k] = s.state == ArmState::ready, t.at[k] = s.pose.p.x;
    return {{9, 9, 9}, {}, 0};  // the return value is unused
  }
  explicit Both(BridgeOptions o = {}) {
    o.where = "127.0.0.1:" + std::to_string(server->port());
    o.patience = 5;
    port = open_bridge(o, messages);
    for (const std::string& line : messages) ADD_FAILURE() << line;
    std::string why;
    EXPECT_TRUE(port.any() && port.start(port.self, {step, this}, why));
  }
  ~Both() { port.reset(); }
  // Milliseconds of the devices, and the simulator's answers.
  void both(int count, const std::function<void(int)>& each = {}) {
    for (int k = 0; k < count; ++k) {
      const uint64_t before = server->counts().accepted;
      test_ns += 1000000;
      fake.step(1);
      if (!physics_is_dead) {
        ASSERT_TRUE(wait_for([&] { return server->counts().accepted >= before + 2; }));
      }
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
  EXPECT_NEAR(t.port.status(t.port.self, 0).force, 0.8f, 0.02f) << "what is felt is told";
  t.fake.zero(0), t.fake.zero(1);

  // The device: its left connection breaks.
  const Vec3 right = t.fake.force(0);
  t.fake.fault(1, kFakeCommError, 1);
  t.both(50, [&](int) { EXPECT_TRUE(t.fake.force(0) == right); });
  EXPECT_FALSE(t.there[1]);
  EXPECT_TRUE(t.there[0]);
  EXPECT_NE(t.port.error_text(t.port.self, t.port.status(t.port.self, 1).error).find("lost the device"), std::string::npos);

  // The bridge peer: the whole simulator stops silently.
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

// The physics stops, the rest runs: same result as without a bridge.
TEST(Bridge, the_physics_dies) {
  Both t;
  t.both(2200);
  t.pull[0] = 0.8f;
  t.both(2200);
  ASSERT_NEAR(t.fake.force(0).x, 0.8f, 0.02f);
  t.fake.zero(0);
  t.physics_is_dead = true;
  int zero = 0;
  t.both(150, [&](int k) {
    if (length(t.fake.force(0)) == 0 && zero == 0) zero = k + 1;
  });
  std::printf("physics killed at 0.8 N: zero after %d ms\n", zero);
  EXPECT_GT(zero, 30);
  EXPECT_LE(zero, 100);
  EXPECT_LE(t.fake.at(0).step_most, 0.5 + 1e-4);
}

// The device server exits and restarts at the same address: both hands are lost, and reconnect automatically.
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
  t.server = std::make_unique<ArmServer>(open_touch({}, t.messages), o);
  ASSERT_TRUE(wait_for([&] {
    test_ns += 1000000;
    t.fake.step(1);
    return t.there[0] && t.there[1];
  }));
  EXPECT_TRUE(wait_for([&] { return t.port.status(t.port.self, 1).ready; }));
}

// A minimal device server, for packets that a correct one never sends.
struct ArmEnd {
  int fd = -1;
  BridgeDoor door;
  BridgeKey in{}, out{};
  uint64_t counter = 0;
  ArmInfo info;
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;

  ArmEnd() {
    std::string why;
    fd = bridge_socket("127.0.0.1:0", true, why);
    if (fd < 0) ADD_FAILURE() << why;
    info.present = true;
  }
  ~ArmEnd() { ::close(fd); }
  std::string where() const {
    sockaddr_storage own{};
    socklen_t bytes = sizeof own;
    getsockname(fd, reinterpret_cast<sockaddr*>(&own), &bytes);
    return "127.0.0.1:" + std::to_string(ntohs(reinterpret_cast<sockaddr_in*>(&own)->sin_port));
  }
  void send(const void* data, size_t bytes) { sendto(fd, data, bytes, 0, reinterpret_cast<sockaddr*>(&peer), size); }
  void send(const BridgeBytes& b) { send(b.data(), b.size()); }
  BridgeBytes sealed(BridgeKind kind, uint8_t arm, const BridgePayload& p) {
    BridgeBytes b;
    seal(out, {kind, arm, kBridgeVersion, ++counter}, p, b);
    return b;
  }
  // Answers one packet like a device server, or a hello with `instead`; returns the kind of the packet.
  BridgeKind answer(const BridgeBytes* instead = nullptr) {
    uint8_t data[300];
    pollfd wait{fd, POLLIN, 0};
    size = sizeof peer;
    BridgeHead h;
    if (poll(&wait, 1, 1) <= 0) return {};
    const ssize_t n = recvfrom(fd, data, sizeof data, MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&peer), &size);
    if (n <= 0 || read_head(data, static_cast<size_t>(n), h) != BridgeFault::none) return {};
    if (h.kind == BridgeKind::hello && instead) send(*instead);
    else if (h.kind == BridgeKind::hello) send(cookie_packet(door, data, &peer, size, 0));
    if (h.kind == BridgeKind::open) send(opened_packet(door, data, in, out));
    if (h.kind == BridgeKind::ask)
      for (uint8_t k = 0; k < 2; ++k) {
        BridgePayload p;
        write_info(info, p);
        send(sealed(BridgeKind::info, k, p));
      }
    return h.kind;
  }
};

// Garbage from the address that the simulator is connected to.
TEST(Bridge, garbage_from_the_arms_end) {
  ArmEnd end;
  std::atomic<bool> quit{false};
  std::thread arm([&] {
    std::mt19937 draw(3);
    while (!quit) {
      const BridgeKind kind = end.answer();
      if (kind != BridgeKind::patch && kind != BridgeKind::ask) continue;
      BridgeBytes b;
      for (int k = 0; k < 20; ++k) {
        for (uint8_t& byte : b) byte = static_cast<uint8_t>(draw());
        end.send(b.data(), draw() % 257);
        BridgeBytes forged = end.sealed(BridgeKind::bye, 0, {});
        forged[200] ^= 1;
        end.send(forged);
      }
      for (uint8_t k = 0; k < 2; ++k) {
        ArmSample s;
        s.state = ArmState::ready;
        BridgePayload p;
        write_sample(s, {}, 0, p);
        b = end.sealed(BridgeKind::sample, k, p);
        end.send(b);
        end.send(b);  // twice: the network may do that
      }
    }
  });
  BridgeOptions o;
  o.where = end.where();
  o.patience = 5;
  std::vector<std::string> messages;
  ArmPort port = open_bridge(o, messages);
  EXPECT_TRUE(port.any());
  if (port.any()) {
    static std::atomic<int> ready{0};
    static ArmPort* to = nullptr;
    ready = 0, to = &port;
    const auto step = [](void*, size_t k, const ArmSample& s) {
      ready += s.state == ArmState::ready;
      to->send_patch(to->self, k, {});
      return ArmForce{{std::nanf(""), 0, 0}, {}, 0};
    };
    std::string why;
    EXPECT_TRUE(port.start(port.self, {step, nullptr}, why));
    EXPECT_TRUE(wait_for([&] {
      const BridgeCounts c = bridge_counts(port);
      return ready > 50 && c.garbage > 300 && c.forged > 300 && c.old > 20;
    })) << ready;
  }
  port.reset();
  quit = true;
  arm.join();
}

TEST(Bridge, nothing_to_work_with_is_one_line) {
  const auto line = [](const std::string& where, const char* needle, float patience = 0.2f) {
    std::vector<std::string> messages;
    BridgeOptions o;
    o.where = where;
    o.patience = patience;
    EXPECT_FALSE(open_bridge(o, messages).any()) << where;
    ASSERT_EQ(messages.size(), 1u) << where;
    EXPECT_NE(messages[0].find(needle), std::string::npos) << messages[0];
    EXPECT_EQ(messages[0].find('\n'), std::string::npos);
  };
  ArmEnd end;  // at first silent
  line(end.where(), "start `catgut bridge` on the device's computer");
  line("127.0.0.1:99999", "is not HOST:PORT");
  line("127.0.0.1:x", "is not HOST:PORT");
  line(":5", "is not HOST:PORT");
  // Another version, one whose devices are in use, one without devices, one with another key.
  for (const int kind : {0, 1, 2, 3}) {
    std::atomic<bool> quit{false};
    end.info.present = false;
    std::thread arm([&] {
      while (!quit) {
        const BridgeKey own = end.door.shared;
        if (kind == 3) end.door.shared = random_key();
        BridgeBytes refused = refused_packet({}, kArmsTaken);
        if (kind == 0) refused[4] = 3;
        end.answer(kind < 2 ? &refused : nullptr);
        end.door.shared = own;
      }
    });
    line(end.where(),
         kind == 0   ? "uses protocol version 3"
         : kind == 1 ? "another simulator uses the devices"
         : kind == 2 ? "has no device"
                     : "another key",
         kind == 3 ? 2.0f : 10.0f);
    quit = true;
    arm.join();
  }
}

// The sample in another language is a device: it answers, moves, and receives the force.
TEST(Bridge, an_arm_in_python) {
  if (std::system("python3 -c 'import ctypes' >/dev/null 2>&1") != 0) GTEST_SKIP() << "python3 is not installed";
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
  std::vector<std::string> messages;
  ArmPort port = open_bridge(o, messages);
  for (const std::string& line : messages) ADD_FAILURE() << line;
  EXPECT_TRUE(port.arm[0].present && !port.arm[1].present);
  EXPECT_EQ(port.arm[0].serial, "py-1");
  if (port.any()) {
    static std::atomic<float> at{0};
    std::string why;
    static ArmPort* to = nullptr;
    to = &port;
    static int steps = 0;
    const auto step = [](void*, size_t k, const ArmSample& s) {
      if (s.state == ArmState::ready) at = s.pose.p.x;
      ForcePatch p;
      // It engages where the force is zero; repeatedly, since on a busy machine it may expire in between.
      p.point = s.pose.p, p.force = {++steps % 2000 > 300 ? 0.4f : 0, 0, 0}, p.period = 0.001f, p.time_ns = s.time_ns;
      to->send_patch(to->self, k, p);
      return ArmForce{};
    };
    EXPECT_TRUE(port.start(port.self, {step, nullptr}, why));
    EXPECT_TRUE(wait_for([] { return at > 0.025f; })) << "0.1 N on 20 N/m are 5 mm from where it was: " << at;
    // Killed: the device is lost, nothing hangs.
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
