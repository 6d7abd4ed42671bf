// SPDX-License-Identifier: Apache-2.0
// device/haply: see the header. All members of the connection are owned by the thread; before it runs, by the opener.
#include "device/haply.h"

#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "device/periodic_timer.h"
#include "device/profiles.h"

namespace catgut {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using boost::system::error_code;
using nlohmann::json;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr float kStopStep = 0.5f;  // [N] per millisecond while stopping (the limiter's slew rate)
constexpr int kMostStops = 100;    // messages after which a stop no longer waits
constexpr auto kReconnectEvery = 500ms;
constexpr size_t kMostBytes = 1 << 18;  // of a message; the state of two devices has a few kilobytes

enum HaplyError : uint32_t { kSilent = 1, kGone = 2, kNonsense = 3, kNoLine = 4 };

// Their axes (x right, y forward, z up) to ours (x right, y up, z toward the user), and back.
Vec3 ours(Vec3 v) { return {v.x, v.z, -v.y}; }
Vec3 theirs(Vec3 v) { return {v.x, -v.z, v.y}; }

// Reads of untrusted JSON.
const json& member(const json& j, const char* name) {
  static const json kNothing;
  if (!j.is_object()) return kNothing;
  const auto found = j.find(name);
  return found == j.end() ? kNothing : *found;
}
bool number(const json& j, const char* name, float& out) {
  const json& n = member(j, name);
  if (!n.is_number()) return false;
  out = n.get<float>();
  return std::abs(out) < 1e3f;  // false: not a number, or outside any device's range
}
bool vector(const json& j, Vec3& out) { return number(j, "x", out.x) && number(j, "y", out.y) && number(j, "z", out.z); }
std::string word(const json& j, const char* name) {
  const json& s = member(j, name);
  std::string text;
  if (s.is_string())
    for (const char c : s.get_ref<const std::string&>()) text += c >= 0x20 && c < 0x7f ? c : '?';
  return text.substr(0, 40);
}
bool yes(const json& j, const char* name) {
  const json& b = member(j, name);
  return b.is_boolean() && b.get<bool>();
}

struct Arm {
  std::string id;  // as named by the service
  // The grip bound to this device, by its own id, and its last state. A grip that is missing from a message keeps its rotation
  // and buttons.
  std::string grip;
  Quat held;
  uint32_t pressed = 0;
  uint32_t sequence = 0;
  ArmSample sample;
  Vec3 force;  // [N] to be sent, our frame
  // Readable from any thread.
  std::atomic<bool> ready{false};
  std::atomic<uint32_t> error{0}, errors{0};
  std::atomic<uint64_t> steps{0};
};

struct Haply {
  HaplyOptions options;
  std::string host, port;
  std::array<Arm, 2> arm;  // 0 right, 1 left; no id: none
  ArmCallback callback;
  std::thread thread;
  std::atomic<bool> stopping{false};
  // The connection. Handlers of an older connection detect a newer one by `turn`.
  asio::io_context io;
  std::optional<beast::websocket::stream<asio::ip::tcp::socket>> line;
  std::optional<asio::ip::tcp::endpoint> to;
  beast::flat_buffer in;
  std::string out;
  uint64_t turn = 0;
  bool got = false, reading = false, writing = false, up = false, done = false;
  bool vectors = true;  // the form of commands
  // Of this connection: the service has sent its inventory (unsolicited); our first message was sent.
  bool greeted = false, introduced = false;
  error_code failure;
  Quat no_grip = axis_angle({1, 0, 0}, -0.25f * kPi);
};

void drop(Haply& h) {
  ++h.turn;
  if (h.line) {
    error_code ignored;
    beast::get_lowest_layer(*h.line).close(ignored);
  }
  h.line.reset();
  h.in.clear();
  h.got = h.reading = h.writing = h.up = h.greeted = h.introduced = false;
}

// Runs the connection until `done`, or the time limit. The caller never waits longer than that for the service.
template <typename F>
bool until(Haply& h, Clock::time_point when, const F& done) {
  h.io.restart();
  while (!done()) {
    if (h.io.stopped()) h.io.restart();
    if (h.io.run_one_until(when) == 0 && Clock::now() >= when) return done();
    if (h.io.stopped() && !done()) std::this_thread::sleep_until(std::min(when, Clock::now() + 100us));
  }
  return true;
}

void read_next(Haply& h) {
  h.got = false, h.reading = true;
  h.line->async_read(h.in, [&h, turn = h.turn](error_code e, size_t) {
    if (turn != h.turn) return;
    h.reading = false;
    if (e) h.failure = e, h.up = false;
    else h.got = true;
  });
}

// Starts a connection; h.up: it is established, h.done: it has ended, with or without an error.
void connect(Haply& h) {
  drop(h);
  h.done = false, h.failure = {};
  h.line.emplace(h.io);
  h.line->read_message_max(kMostBytes);
  const auto fail = [&h](error_code e) { h.failure = e, h.done = true; };
  if (!h.to) {  // resolved once, by the opener: the thread must not wait for a name server
    error_code e;
    asio::ip::tcp::resolver resolver(h.io);
    const auto found = resolver.resolve(h.host, h.port, e);
    if (e || found.empty()) return fail(e);
    h.to = *found.begin();  // IPv4 if available: the service listens there
    for (const auto& f : found)
      if (f.endpoint().address().is_v4()) h.to = f.endpoint();
  }
  h.line->next_layer().async_connect(*h.to, [&h, fail, turn = h.turn](error_code error) {
    if (turn != h.turn) return;
    if (error) return fail(error);
    error_code ignored;
    h.line->next_layer().set_option(asio::ip::tcp::no_delay(true), ignored);  // delayed sending would make the force late
    h.line->async_handshake(h.host + ":" + h.port, "/", [&h, fail, turn](error_code shaken) {
      if (turn != h.turn) return;
      if (shaken) return fail(shaken);
      h.line->text(true);
      h.up = h.done = true;
      read_next(h);
    });
  });
}

void put_number(std::string& out, float f) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, f).ptr;
  out.append(text, end);
}

// One message: the forces of both arms.
void send(Haply& h) {
  if (!h.up || h.writing) return;
  h.out = "{";
  if (!h.introduced && h.vectors) h.out += R"("session":{"configure":{"profile":{"name":"catgut"}}},)";
  h.introduced = true;
  h.out += R"("inverse3":[)";
  bool first = true;
  for (const Arm& a : h.arm) {
    if (a.id.empty()) continue;
    const Vec3 f = theirs(a.force);
    h.out += first ? R"({"device_id":")" : R"(,{"device_id":")";
    h.out += a.id;
    h.out += R"(","commands":{"set_cursor_force":{)";
    h.out += h.vectors ? R"("vector":{"x":)" : R"("values":{"x":)";
    put_number(h.out, f.x), h.out += R"(,"y":)", put_number(h.out, f.y), h.out += R"(,"z":)", put_number(h.out, f.z);
    h.out += "}}}}";
    first = false;
  }
  h.out += "]}";
  h.writing = true;
  h.line->async_write(asio::buffer(h.out), [&h, turn = h.turn](error_code e, size_t) {
    if (turn != h.turn) return;
    h.writing = false;
    if (e) h.failure = e, h.up = false;
  });
}

json take_message(Haply& h) {
  const auto data = h.in.cdata();
  const char* text = static_cast<const char*>(data.data());
  json j = json::parse(text, text + data.size(), nullptr, false);
  h.in.clear();
  return j;
}

constexpr const char* kGrips[] = {"wireless_verse_grip", "verse_grip", "custom_verse_grip"};

// Unbound grips, in the service's order (wireless ones first), are assigned to devices without one, in the order of the
// inventory. Once bound, a grip is known by its id, whatever is missing from a later message.
void bind_grips(const json& message, Haply& h, const std::vector<size_t>& order) {
  for (const char* kind : kGrips) {
    const json& all = member(message, kind);
    if (!all.is_array()) continue;
    for (const json& grip : all) {
      const std::string id = word(grip, "device_id");
      if (id.empty() || h.arm[0].grip == id || h.arm[1].grip == id) continue;
      for (const size_t k : order)
        if (!h.arm[k].id.empty() && h.arm[k].grip.empty()) {
          h.arm[k].grip = id;
          break;
        }
    }
  }
}

void read_grip(const json& message, Arm& a) {
  ArmSample& s = a.sample;
  for (const char* kind : kGrips) {
    const json& all = member(message, kind);
    if (a.grip.empty() || !all.is_array()) continue;
    for (const json& grip : all) {
      if (word(grip, "device_id") != a.grip) continue;
      const json& state = member(grip, "state");
      const json& q = member(state, "orientation");
      Vec3 v;
      float w = 0;
      // A rotation's axis is a vector, so it changes axes like one; the tool's own axes are renamed the same way.
      if (vector(q, v) && number(q, "w", w)) {
        v = ours(v);
        a.held = normalized(Quat{v.x, v.y, v.z, w});
      }
      const json& buttons = member(state, "buttons");
      a.pressed = (yes(state, "button") || yes(buttons, "a") ? 1u : 0u) | (yes(buttons, "b") ? 2u : 0u);
    }
  }
  s.pose.q = a.held;
  s.buttons = a.pressed;
}

// The devices' states in one message; a device that is not in it is absent.
bool read_states(const json& message, Haply& h) {
  const json& all = member(message, "inverse3");
  if (!all.is_array()) return false;
  for (Arm& a : h.arm) a.sample = {};
  bind_grips(message, h, {0, 1});
  for (size_t place = 0; place < all.size(); ++place) {
    const std::string id = word(all[place], "device_id");
    for (Arm& a : h.arm) {
      if (a.id.empty() || a.id != id) continue;
      const json& state = member(all[place], "state");
      const json& ready = member(member(all[place], "status"), "ready");
      Vec3 p, v;
      if (!vector(member(state, "cursor_position"), p) || (ready.is_boolean() && !ready.get<bool>())) continue;
      if (!vector(member(state, "cursor_velocity"), v)) v = {};
      a.sample.state = ArmState::ready;
      a.sample.pose.p = ours(p);
      a.sample.velocity = ours(v);
      read_grip(message, a);
    }
  }
  return true;
}

void serve(Haply& h, uint32_t error) {
  for (size_t k = 0; k < 2; ++k) {
    Arm& a = h.arm[k];
    if (a.id.empty()) continue;
    if (error) a.sample = {};
    a.sample.sequence = ++a.sequence;
    Vec3 force = h.callback.step(h.callback.user, k, a.sample).force;  // its arms have no other motors
    const bool ready = a.sample.state == ArmState::ready;
    if (h.stopping) {
      const float l = length(a.force);
      force = l > kStopStep ? a.force * ((l - kStopStep) / l) : Vec3{};
    }
    a.force = ready && is_finite(force) ? force : Vec3{};
    if (!ready && (a.ready.exchange(false) || a.error != (error ? error : kGone))) {
      a.error = error ? error : kGone;
      ++a.errors;
    }
    if (ready) a.ready = true;
    ++a.steps;
  }
}

void run(Haply& h) {
  go_first();
  Beat beat;
  const auto patience = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<float>(h.options.forget));
  Clock::time_point heard = Clock::now(), again = heard + kReconnectEvery;
  int stops = 0;
  bool waits = false;  // for an answer: the next message is sent when it has arrived or timed out
  while (!h.stopping || ((length2(h.arm[0].force) > 0 || length2(h.arm[1].force) > 0) && ++stops < kMostStops)) {
    if (h.up && h.greeted && !waits) send(h), waits = true;
    const bool was_up = h.up;
    until(h, Clock::now() + (h.options.paced || !was_up ? 1ms : 20ms), [&h, was_up] { return h.got || h.up != was_up; });
    const auto now = Clock::now();
    uint32_t error = 0;
    if (h.got) {
      const json message = take_message(h);
      read_next(h);
      waits = false, h.greeted = true;
      if (read_states(message, h)) heard = now;
      else error = kNonsense;
    } else if (now < heard + patience) {
      continue;  // late, but not lost yet: no new sample, no new force
    } else {
      error = h.up ? kSilent : kNoLine;
    }
    serve(h, error);
    // A dead or silent connection is restarted.
    if (error && now > again && now > heard + kReconnectEvery) {
      connect(h);
      again = now + kReconnectEvery;
      waits = false;
    }
    if (h.options.paced || error) beat.wait();
  }
  for (Arm& a : h.arm) a.force = {};
  send(h);
  until(h, Clock::now() + 20ms, [&h] { return !h.writing || !h.up; });
}

bool start(void* self, const ArmCallback& callback, std::string&) {
  Haply& h = *static_cast<Haply*>(self);
  h.callback = callback;
  h.stopping = false;
  h.thread = std::thread([&h] { run(h); });
  return true;
}
void stop(void* self) {
  Haply& h = *static_cast<Haply*>(self);
  h.stopping = true;
  if (h.thread.joinable()) h.thread.join();
}
ArmStatus status(void* self, size_t k) {
  const Arm& a = static_cast<Haply*>(self)->arm[k];
  return {a.ready, a.error, a.errors, a.steps};
}
std::string error_text(void* self, uint32_t error) {
  const Haply& h = *static_cast<Haply*>(self);
  const std::string there = " at " + h.host + ":" + h.port;
  switch (error) {
    case kSilent:
      return "no answer from the Haply service" + there;
    case kGone:
      return "the Haply service" + there + " lost the device";
    case kNonsense:
      return "invalid answer from the Haply service" + there;
    case kNoLine:
      return "lost connection to the Haply service" + there;
    default:
      return "";
  }
}
void close(void* self) {
  Haply* h = static_cast<Haply*>(self);
  stop(self);
  drop(*h);
  delete h;
}

}  // namespace

ArmPort open_haply(const HaplyOptions& options, std::vector<std::string>& messages) {
  ArmPort port;
  port.kind = "haply";
  auto h = std::make_unique<Haply>();
  h->options = options;
  std::string where = options.where;
  if (const char* set = std::getenv("CATGUT_HAPLY"); where.empty() && set) where = set;
  const size_t colon = where.rfind(':');
  h->host = where.substr(0, colon);
  h->port = colon == std::string::npos ? "10001" : where.substr(colon + 1);
  if (h->host.empty()) h->host = "127.0.0.1";
  const std::string there = h->host + ":" + h->port;
  const auto when = [&] {
    return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<float>(options.patience));
  };
  connect(*h);
  until(*h, when(), [&h] { return h->done; });
  if (!h->up) {
    const bool nobody = !h->done || h->failure == boost::system::errc::connection_refused;
    messages.push_back(nobody ? "haply: no Inverse service answers at " + there +
                                    "; start it (the Haply Hub does), or write --haptics haply:HOST:PORT"
                              : "haply: no Inverse service at " + there + " (" + h->failure.message() + ")");
    return port;
  }
  until(*h, when(), [&h] { return h->got || !h->up; });
  json inventory;
  if (h->got) {
    inventory = take_message(*h);
    h->greeted = true;
    read_next(*h);
  }
  const json& all = member(inventory, "inverse3");
  if (!all.is_array()) {
    messages.push_back("haply: the service at " + there +
                       " has an unknown version (supported: 3.1 to 3.5); update it, or give its port");
    return port;
  }
  std::vector<size_t> order;
  for (size_t place = 0; place < all.size(); ++place) {
    const json& device = all[place];
    const json& config = member(device, "config");
    const std::string id = word(device, "device_id");
    // It is sent back to the service inside quotes.
    if (id.empty() || id.find_first_of("\"\\?") != std::string::npos) continue;
    const json& calibrated = member(member(device, "status"), "calibrated");
    if (calibrated.is_boolean() && !calibrated.get<bool>()) {
      messages.push_back("haply: arm " + id +
                         " is not calibrated: put its grip into the inkwell until its light is steady, and try again");
      continue;
    }
    // Introduced in 3.5, in the first state message.
    if (place == 0)
      h->vectors = member(inventory, "session_id").is_number() || member(member(device, "state"), "control_mode").is_string();
    size_t k = word(config, "handedness") == "left" ? 1 : 0;
    if (port.arm[k].present) k = 1 - k;
    if (port.arm[k].present) continue;
    h->arm[k].id = id;
    h->arm[k].held = h->no_grip;
    order.push_back(k);
    ArmInfo& info = port.arm[k];
    info.present = true;
    info.model = word(config, "type");
    info.name = id, info.serial = "haply-" + id;
    info.driver = h->vectors ? "service 3.5" : "service 3.1 to 3.4";
    info.limits = limits_of(info.model, {0, 0, 0, 0});  // the service does not report them
    const float reach = info.model == "minverse" ? 0.04f : 0.1f;
    // Approximately the cursor's position at the center of its range (the maker's examples), until `--calibrate` measures it.
    const Vec3 middle = ours({0, -0.12f, 0.15f}), box{reach, reach, reach};
    info.least = middle - box, info.most = middle + box;
  }
  bind_grips(inventory, *h, order);
  if (!port.arm[0].present && !port.arm[1].present) {
    if (messages.empty())
      messages.push_back("haply: the service at " + there + " has no device; is one connected and switched on?");
    drop(*h);
    return port;
  }
  port.self = h.release();
  port.start = start, port.stop = stop, port.status = status, port.error_text = error_text, port.close = close;
  return port;
}

}  // namespace catgut
