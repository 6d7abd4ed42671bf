// SPDX-License-Identifier: Apache-2.0
// tests/xr: a simulated wearer: streams head and controllers to the test runtime's remote driver (Monado, "remote"), which
// reports them like any headset's. Poses in the driver's frame, which is the runtime's floor frame.
#pragma once
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>

#include "core/math.h"

namespace catgut {

struct RemoteHand {
  Pose pose{{0, 1.2f, -0.3f}, {}};
  float trigger = 0, squeeze = 0, trackpad_force = 0, stick_x = 0, stick_y = 0;
  std::array<float, 5> curl{};  // of the fingers, 0 straight .. 1 bent
  bool active = true, fingers = false, a = false, b = false, stick = false;
};

struct RemoteWearer {
  Pose head{{0, 1.6f, 0}, {}};
  std::array<RemoteHand, 2> hand;  // left, right
};

// [ports] a free one, so that tests can run side by side.
inline int free_port() {
  const int s = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  int port = 0;
  if (bind(s, reinterpret_cast<sockaddr*>(&at), size) == 0 && getsockname(s, reinterpret_cast<sockaddr*>(&at), &size) == 0)
    port = ntohs(at.sin_port);
  close(s);
  return port;
}

class Remote {
 public:
  explicit Remote(int port) : port_(port), thread_([this] { run(); }) {}
  ~Remote() {
    quit_ = true;
    thread_.join();
  }
  Remote(const Remote&) = delete;
  Remote& operator=(const Remote&) = delete;

  void set(const RemoteWearer& now) {
    const std::lock_guard lock(mutex_);
    wearer_ = now;
  }
  bool connected() const { return connected_; }

 private:
  static void put(char*& at, const void* data, size_t bytes) {
    std::memcpy(at, data, bytes);
    at += bytes;
  }
  static void put(char*& at, const Pose& p) {
    const float v[] = {p.q.x, p.q.y, p.q.z, p.q.w, p.p.x, p.p.y, p.p.z};
    put(at, v, sizeof v);
  }
  static std::array<char, 376> packet(const RemoteWearer& w) {
    std::array<char, 376> out{};
    char* at = out.data();
    put(at, "mndrmt3\0", 8);
    at += 2 * 48;  // the driver's own views
    put(at, w.head);
    at += 4;
    for (const RemoteHand& h : w.hand) {
      put(at, h.pose);
      const float still[6] = {};
      put(at, still, sizeof still);
      put(at, h.curl.data(), sizeof h.curl);
      const float values[] = {h.trigger, h.squeeze, 0, h.stick_x, h.stick_y, h.trackpad_force, 0, 0};
      put(at, values, sizeof values);
      const uint8_t bits[16] = {h.fingers, h.active, 0, 0, h.a, 0, h.b, 0, h.trigger > 0.9f, 0, h.stick, 0, 0, 0, 0, 0};
      put(at, bits, sizeof bits);
    }
    return out;
  }
  void run() {
    int s = -1;
    while (!quit_) {
      if (s < 0) {
        s = socket(AF_INET, SOCK_STREAM, 0);
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        to.sin_port = htons(static_cast<uint16_t>(port_));
        if (connect(s, reinterpret_cast<sockaddr*>(&to), sizeof to) != 0) {
          close(s);
          s = -1;
          std::this_thread::sleep_for(std::chrono::milliseconds(20));
          continue;
        }
        const int one = 1;
        setsockopt(s, IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
      }
      RemoteWearer now;
      {
        const std::lock_guard lock(mutex_);
        now = wearer_;
      }
      const auto bytes = packet(now);
      if (send(s, bytes.data(), bytes.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(bytes.size())) {
        close(s);
        s = -1;
        connected_ = false;
        continue;
      }
      connected_ = true;
      std::this_thread::sleep_for(std::chrono::milliseconds(4));
    }
    if (s >= 0) close(s);
  }

  int port_;
  std::mutex mutex_;
  RemoteWearer wearer_;
  std::atomic<bool> quit_{false}, connected_{false};
  std::thread thread_;
};

}  // namespace catgut
