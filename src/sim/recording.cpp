// SPDX-License-Identifier: Apache-2.0
// sim: reads and writes recordings. Knows the fields of TickInput; treats a state as opaque bytes.
#include "sim/recording.h"

#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/check.h"
#include "core/hash.h"

namespace catgut {
namespace {

constexpr char kMagic[8] = {'C', 'A', 'T', 'G', 'U', 'T', '\x1a', '\n'};  // detects transfers in text mode
constexpr size_t kTicksPerChunk = 60;  // lost by a crash at most: one second at 60 ticks per second
enum Kind : uint32_t { kHeader = 1, kStart = 2, kTicks = 3, kEnd = 4, kHeads = 5 };
constexpr size_t kChunkHead = 4 + 8 + 8;

template <typename Int>
void put(std::string& out, Int value) {
  for (size_t i = 0; i < sizeof(Int); ++i) out += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i) & 0xff);
}
void put(std::string& out, float value) { put(out, std::bit_cast<uint32_t>(value)); }
void put(std::string& out, Vec3 v) { put(out, v.x), put(out, v.y), put(out, v.z); }
void put(std::string& out, const std::string& text) { put(out, static_cast<uint64_t>(text.size())), out += text; }

// Sequential reader; past the end it returns zero and good() is false.
class Reader {
 public:
  Reader(const char* at, size_t size) : at_(at), left_(size) {}
  bool good() const { return good_; }
  size_t left() const { return left_; }
  const char* take(size_t bytes) {
    if (bytes > left_) {
      good_ = false;
      left_ = 0;
      return nullptr;
    }
    const char* p = at_;
    at_ += bytes;
    left_ -= bytes;
    return p;
  }
  template <typename Int>
  Int integer() {
    const char* p = take(sizeof(Int));
    uint64_t v = 0;
    for (size_t i = 0; p && i < sizeof(Int); ++i) v |= static_cast<uint64_t>(static_cast<unsigned char>(p[i])) << (8 * i);
    return static_cast<Int>(v);
  }
  float real() { return std::bit_cast<float>(integer<uint32_t>()); }
  Vec3 vector() {
    Vec3 v;
    v.x = real(), v.y = real(), v.z = real();
    return v;
  }
  std::string text() {
    const uint64_t size = integer<uint64_t>();
    const char* p = take(size);
    return p ? std::string(p, size) : std::string();
  }

 private:
  const char* at_;
  size_t left_;
  bool good_ = true;
};

void put(std::string& out, const ToolInput& t) {
  put(out, t.pose.p);
  put(out, t.pose.q.x), put(out, t.pose.q.y), put(out, t.pose.q.z), put(out, t.pose.q.w);
  put(out, t.velocity), put(out, t.angular_velocity), put(out, t.jaw);
  put(out, t.buttons), put(out, t.time_ns), put(out, t.sequence), put(out, t.connected);
}

ToolInput tool(Reader& in) {
  ToolInput t;
  t.pose.p = in.vector();
  t.pose.q.x = in.real(), t.pose.q.y = in.real(), t.pose.q.z = in.real(), t.pose.q.w = in.real();
  t.velocity = in.vector(), t.angular_velocity = in.vector(), t.jaw = in.real();
  t.buttons = in.integer<uint32_t>(), t.time_ns = in.integer<uint64_t>();
  t.sequence = in.integer<uint32_t>(), t.connected = in.integer<uint32_t>();
  return t;
}

uint64_t chunk_hash(uint32_t kind, const char* payload, uint64_t size) { return hash_bytes(payload, size, size * 8 + kind); }

struct Chunk {
  uint32_t kind = 0;
  Reader payload{nullptr, 0};
  bool whole = false;
};

Chunk next_chunk(Reader& in) {
  Chunk c;
  c.kind = in.integer<uint32_t>();
  const uint64_t size = in.integer<uint64_t>(), hash = in.integer<uint64_t>();
  const char* payload = in.good() ? in.take(size) : nullptr;
  if (!payload) return c;
  c.whole = chunk_hash(c.kind, payload, size) == hash;
  c.payload = Reader(payload, size);
  return c;
}

}  // namespace

Recorder::Recorder(const std::string& path, const RecordingHeader& header, const std::vector<std::byte>& start)
    : path_(path), file_(std::fopen(path.c_str(), "wb"), &std::fclose) {
  if (!file_) throw InputError(path, std::string("cannot be written (") + std::strerror(errno) + ")", "choose another place");
  std::string opening(kMagic, sizeof kMagic);
  put(opening, kRecordingFormat);
  std::string head;
  put(head, header.catgut_version), put(head, header.state_version), put(head, header.scene);
  if (std::fwrite(opening.data(), 1, opening.size(), file_.get()) != opening.size())
    throw InputError(path_, "cannot be written", "is the disk full?");
  chunk(kHeader, head);
  chunk(kStart, std::string(reinterpret_cast<const char*>(start.data()), start.size()));
}

Recorder::~Recorder() {
  try {
    if (file_) flush_ticks();
  } catch (const InputError&) {  // the run is ending because of another error; that one is reported
  }
}

void Recorder::tick(const TickInput& input, uint64_t hash) {
  put(ticks_, input.tick);
  // Disconnected hands take no space; the surgeon's own two are always written.
  uint32_t hands = kMaxHands;
  while (hands > 2 && !input.hand[hands - 1].connected) --hands;
  put(ticks_, hands);
  for (size_t k = 0; k < hands; ++k) put(ticks_, input.hand[k]);
  put(ticks_, input.commands.count);
  for (const Command& c : input.commands)
    put(ticks_, static_cast<uint8_t>(c.kind)), put(ticks_, c.hand), put(ticks_, c.argument);
  put(ticks_, hash);
  if (++count_ % kTicksPerChunk == 0) flush_ticks();
}

void Recorder::head(const Pose& pose) {
  if (count_ == 0 || head_at_ == count_) return;
  head_at_ = count_;
  put(heads_, count_ - 1), put(heads_, pose.p);
  put(heads_, pose.q.x), put(heads_, pose.q.y), put(heads_, pose.q.z), put(heads_, pose.q.w);
}

void Recorder::finish(bool interrupted) {
  flush_ticks();
  std::string end;
  put(end, count_), put(end, static_cast<uint32_t>(interrupted));
  chunk(kEnd, end);
  if (std::fclose(file_.release()) != 0) throw InputError(path_, "cannot be written", "is the disk full?");
}

void Recorder::flush_ticks() {
  if (!ticks_.empty()) chunk(kTicks, ticks_);
  ticks_.clear();
  if (!heads_.empty()) chunk(kHeads, heads_);
  heads_.clear();
}

void Recorder::chunk(uint32_t kind, const std::string& payload) {
  std::string out;
  out.reserve(kChunkHead + payload.size());
  put(out, kind), put(out, static_cast<uint64_t>(payload.size()));
  put(out, chunk_hash(kind, payload.data(), payload.size()));
  out += payload;
  if (std::fwrite(out.data(), 1, out.size(), file_.get()) != out.size() || std::fflush(file_.get()) != 0)
    throw InputError(path_, "cannot be written", "is the disk full?");
}

Recording read_recording(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path, "there is no such recording", "`catgut run SCENE --record FILE.cgrec` makes one");
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return parse_recording(bytes.str(), path);
}

Recording parse_recording(const std::string& bytes, const std::string& name) {
  Reader in(bytes.data(), bytes.size());
  const char* magic = in.take(sizeof kMagic);
  if (!magic || std::memcmp(magic, kMagic, sizeof kMagic) != 0)
    throw InputError(name, "this is not a Catgut recording", "give a .cgrec file");
  const uint32_t format = in.integer<uint32_t>();
  if (!in.good()) throw InputError(name, "the recording ends before its header", "nothing of it can be used: record again");
  if (format != kRecordingFormat)
    throw InputError(name,
                     "the recording has format " + std::to_string(format) + ", this version reads format " +
                         std::to_string(kRecordingFormat),
                     "replay it with the version that recorded it");
  Recording r;
  Chunk header = next_chunk(in);
  if (!header.whole || header.kind != kHeader)
    throw InputError(name, "the recording's header is cut or damaged", "nothing of it can be used: record again");
  r.header.catgut_version = header.payload.text();
  r.header.state_version = header.payload.integer<uint32_t>();
  r.header.scene = header.payload.text();
  Chunk start = next_chunk(in);
  if (!header.payload.good() || !start.whole || start.kind != kStart)
    throw InputError(name, "the recording's start state is cut or damaged", "nothing of it can be used: record again");
  const size_t state_size = start.payload.left();
  const auto* state = reinterpret_cast<const std::byte*>(start.payload.take(state_size));
  r.start.assign(state, state + state_size);

  r.truncated = true;  // until the end chunk is found
  while (in.left() > 0) {
    Chunk c = next_chunk(in);
    if (!c.whole) {
      r.fault = "it is cut or damaged after tick " + std::to_string(r.tick.size());
      return r;
    }
    if (c.kind == kTicks) {
      while (c.payload.left() > 0) {
        RecordedTick t;
        t.input.tick = c.payload.integer<uint64_t>();
        const uint32_t hands = c.payload.integer<uint32_t>();
        for (size_t k = 0; k < kMaxHands; ++k) t.input.hand[k] = k < hands ? tool(c.payload) : no_hand();
        const uint32_t commands = c.payload.integer<uint32_t>();
        if (hands > kMaxHands || commands > CommandList::kCapacity) {
          r.fault = "it is damaged after tick " + std::to_string(r.tick.size());
          return r;
        }
        for (uint32_t k = 0; k < commands; ++k) {
          Command command;
          command.kind = static_cast<CommandKind>(c.payload.integer<uint8_t>());
          command.hand = c.payload.integer<uint8_t>();
          command.argument = c.payload.integer<uint16_t>();
          t.input.commands.push(command);
        }
        t.hash = c.payload.integer<uint64_t>();
        if (c.payload.good()) r.tick.push_back(t);
      }
    } else if (c.kind == kHeads) {
      while (c.payload.left() > 0) {
        RecordedHead h;
        h.tick = c.payload.integer<uint64_t>();
        h.pose.p = c.payload.vector();
        h.pose.q.x = c.payload.real(), h.pose.q.y = c.payload.real();
        h.pose.q.z = c.payload.real(), h.pose.q.w = c.payload.real();
        if (c.payload.good()) r.head.push_back(h);
      }
    } else if (c.kind == kEnd) {
      const uint64_t count = c.payload.integer<uint64_t>();
      r.interrupted = c.payload.integer<uint32_t>() != 0;
      r.truncated = count != r.tick.size();
      if (r.truncated) r.fault = "it holds " + std::to_string(r.tick.size()) + " of " + std::to_string(count) + " ticks";
      return r;
    }  // a later version may add chunk kinds: skip unknown ones
  }
  r.fault = "it ends without an end mark after tick " + std::to_string(r.tick.size());
  return r;
}

}  // namespace catgut
