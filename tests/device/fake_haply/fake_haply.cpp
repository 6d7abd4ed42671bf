// SPDX-License-Identifier: Apache-2.0
// tests/device/fake_haply: see the header. Written from the maker's published description of the service.
#include "fake_haply.h"

#include <gtest/gtest.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

namespace catgut {
namespace {
namespace asio = boost::asio;
namespace beast = boost::beast;
using nlohmann::json;
}  // namespace

struct FakeHaply::Work {
  HaplyForm form;
  size_t arms;
  asio::io_context io;
  asio::ip::tcp::acceptor acceptor{io, {asio::ip::make_address("127.0.0.1"), 0}};
  int fd = -1;  // of the line that is served
  mutable std::mutex lock;
  std::condition_variable change;
  std::array<Arm, 2> arm;
  std::array<PlainHand, 2> hand;
  UnkindDevice how;
  UnkindPeriods periods;
  unsigned long now_ns = 1000000000, strange = 0;
  std::array<bool, 2> grips{true, true};
  bool held = false, quit = false, stepped = false;
  std::string next, first, last;
  unsigned long answered = 0, allowed = 0;
  std::thread thread;

  json xyz(const std::array<double, 3>& v) const { return {{"x", v[0]}, {"y", v[1]}, {"z", v[2]}}; }
  json state(bool whole) const {
    json m;
    if (form == HaplyForm::v35 && whole) m["session_id"] = 7;
    m["inverse3"] = json::array();
    m["wireless_verse_grip"] = json::array();
    m["verse_grip"] = json::array();
    for (size_t k = 0; k < arms; ++k) {
      if (!arm[k].there) continue;
      json d{{"device_id", k == 0 ? "04BA" : "049D"}};
      if (whole) d["config"] = {{"type", "inverse3"}, {"handedness", k == 0 ? "left" : "right"}};
      d["state"] = {{"cursor_position", xyz(hand[k].seen(how.encoder))}, {"cursor_velocity", xyz({0, 0, 0})}};
      d["state"][form == HaplyForm::v35 ? "control_mode" : "mode"] = "idle";
      d["status"] = {{"calibrated", true}, {"ready", true}, {"power_supply", true}};
      m["inverse3"].push_back(d);
    }
    // The first arm's grip has no wire: turned by 90 degrees about the vertical, a pressed. The second's has one.
    if (grips[0])
      m["wireless_verse_grip"].push_back({{"device_id", "61576"},
                                          {"state",
                                           {{"orientation", {{"x", 0}, {"y", 0}, {"z", std::sqrt(0.5)}, {"w", std::sqrt(0.5)}}},
                                            {"buttons", {{"a", true}, {"b", false}, {"c", false}}}}}});
    if (grips[1])
      m["verse_grip"].push_back(
          {{"device_id", "61548"}, {"state", {{"orientation", {{"x", 0}, {"y", 0}, {"z", 0}, {"w", 1}}}, {"button", false}}}});
    return m;
  }
  void apply(const json& message) {
    for (const json& d : message.value("inverse3", json::array())) {
      const size_t k = d.value("device_id", "") == "04BA" ? 0 : 1;
      const json command = d.value("commands", json::object()).value("set_cursor_force", json::object());
      // As in the real service the other form is not an error: it simply contains no force.
      const json f = command.value(form == HaplyForm::v35 ? "vector" : "values", json::object());
      const std::array<double, 3> to{f.value("x", 0.0), f.value("y", 0.0), f.value("z", 0.0)};
      double step = 0;
      for (size_t i = 0; i < 3; ++i) step += (to[i] - arm[k].force[i]) * (to[i] - arm[k].force[i]);
      arm[k].step_most = std::max(arm[k].step_most, std::sqrt(step));
      arm[k].force = to;
      hand[k].command(to, how.transport);
      ++arm[k].messages;
    }
  }
  void idle() {
    for (Arm& a : arm) a.force = {0, 0, 0};
    for (PlainHand& h : hand) h.cut();
  }
  // A message's time.
  void pass() {
    const int ms = periods.next(how);
    for (int i = 0; i < ms; ++i)
      for (PlainHand& h : hand) h.pass(true);
    now_ns += static_cast<unsigned long>(1000000L * ms + periods.deviation_ns(how));
  }
  std::string answer() {
    if (!next.empty()) return std::exchange(next, "");
    if (how.storm <= 0 || periods.uniform() >= how.storm) return state(false).dump();
    ++strange;
    static constexpr const char* kNone[] = {"{",
                                            "[]",
                                            "null",
                                            "{\"inverse3\":7}",
                                            "{\"inverse3\":[7,null,[]]}",
                                            "{\"inverse3\":[{\"device_id\":\"049D\",\"state\":null}]}",
                                            "{\"inverse3\":[]}"};
    const size_t which = periods.chance() % (std::size(kNone) + 2);
    if (which < std::size(kNone)) return kNone[which];
    const size_t k = periods.chance() % 2;  // one device, or one grip, is missing this time
    bool& gone = which == std::size(kNone) ? arm[k].there : grips[k];
    const bool was = std::exchange(gone, false);
    const std::string text = state(false).dump();
    gone = was;
    return text;
  }
  void serve(asio::ip::tcp::socket socket) {
    {
      const std::lock_guard<std::mutex> hold(lock);
      fd = socket.native_handle();
    }
    beast::websocket::stream<asio::ip::tcp::socket> ws(std::move(socket));
    beast::error_code e;
    ws.next_layer().set_option(asio::ip::tcp::no_delay(true), e);
    ws.accept(e);
    ws.text(true);
    std::string text;
    if (!e) {
      {
        const std::lock_guard<std::mutex> hold(lock);
        text = first.empty() ? state(true).dump() : first;
        first.clear();
      }
      ws.write(asio::buffer(text), e);
    }
    while (!e) {
      beast::flat_buffer in;
      ws.read(in, e);
      if (e) break;
      const json message = json::parse(beast::buffers_to_string(in.data()), nullptr, false);
      if (message.is_discarded()) break;
      {
        std::unique_lock<std::mutex> hold(lock);
        if (held) change.wait_for(hold, std::chrono::milliseconds(30), [&] { return quit || !held || allowed > 0; });
        if (held && allowed == 0 && !stepped) idle();  // the service's own watchdog, where time passes on its own
        change.wait(hold, [&] { return quit || !held || allowed > 0; });
        if (quit) break;
        if (allowed > 0) --allowed;
        last = message.dump();
        apply(message);
        pass();
        text = answer();
        ++answered;
        change.notify_all();
      }
      ws.write(asio::buffer(text), e);
    }
    const std::lock_guard<std::mutex> hold(lock);
    idle();
    fd = -1;
  }
  void run() {
    for (;;) {
      beast::error_code e;
      asio::ip::tcp::socket socket(io);
      acceptor.accept(socket, e);
      {
        const std::lock_guard<std::mutex> hold(lock);
        if (quit) return;
      }
      if (!e) serve(std::move(socket));
    }
  }
};

FakeHaply::FakeHaply(HaplyForm form, int arms) : work(std::make_unique<Work>()) {
  work->form = form;
  for (PlainHand& h : work->hand) h.x = h.wish = {0, -0.12, 0.15};
  work->arms = static_cast<size_t>(arms);
  work->thread = std::thread([w = work.get()] { w->run(); });
}
FakeHaply::~FakeHaply() {
  const auto port = work->acceptor.local_endpoint();
  {
    const std::lock_guard<std::mutex> hold(work->lock);
    work->quit = true;
    if (work->fd >= 0) ::shutdown(work->fd, SHUT_RDWR);
    work->change.notify_all();
  }
  asio::io_context io;
  asio::ip::tcp::socket last(io);
  beast::error_code e;
  last.connect(port, e);  // wakes the thread that waits for a connection
  work->thread.join();
}
std::string FakeHaply::where() const { return "127.0.0.1:" + std::to_string(work->acceptor.local_endpoint().port()); }

#define HOLD const std::lock_guard<std::mutex> hold_lock(work->lock)
FakeHaply::Arm FakeHaply::at(size_t k) const {
  HOLD;
  Arm a = work->arm[k];
  a.position = work->hand[k].x, a.motors = work->hand[k].acting, a.to_hand_most = work->hand[k].to_hand_most;
  return a;
}
void FakeHaply::zero(size_t k) {
  HOLD;
  work->arm[k].step_most = 0;
  work->hand[k].zero();
}
void FakeHaply::unkind(const UnkindDevice& how) {
  HOLD;
  work->how = how;
}
void FakeHaply::wish(size_t k, const std::array<double, 3>& position) {
  HOLD;
  work->hand[k].wish = position;
}
void FakeHaply::hold_with(size_t k, double stiffness, double damping, double mass) {
  HOLD;
  work->hand[k].grip = stiffness, work->hand[k].damping = damping, work->hand[k].mass = mass;
}
unsigned long FakeHaply::now() const {
  HOLD;
  return work->now_ns;
}
unsigned long FakeHaply::nonsense() const {
  HOLD;
  return work->strange;
}
void FakeHaply::there(size_t k, bool is) {
  HOLD;
  work->arm[k].there = is;
}
void FakeHaply::grip(size_t k, bool is) {
  HOLD;
  work->grips[k] = is;
}
void FakeHaply::hold(bool on) {
  HOLD;
  work->held = on;
  work->change.notify_all();
}
void FakeHaply::say(const std::string& text) {
  HOLD;
  work->next = text;
}
void FakeHaply::inventory(const std::string& text) {
  HOLD;
  work->first = text;
}
void FakeHaply::hang_up() {
  HOLD;
  if (work->fd >= 0) ::shutdown(work->fd, SHUT_RDWR);
}
unsigned long FakeHaply::answered() const {
  HOLD;
  return work->answered;
}
std::string FakeHaply::last() const {
  HOLD;
  return work->last;
}
void FakeHaply::step(unsigned long messages) {
  std::unique_lock<std::mutex> hold(work->lock);
  const unsigned long want = work->answered + messages;
  work->allowed += messages;
  work->stepped = true;
  work->change.notify_all();
  if (!work->change.wait_for(hold, std::chrono::seconds(5), [&] { return work->answered >= want; }))
    ADD_FAILURE() << "the driver sends nothing";
}

}  // namespace catgut
