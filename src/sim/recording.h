// SPDX-License-Identifier: Apache-2.0
// sim: recordings (.cgrec). Start state, inputs and one hash per tick. They suffice to replay a run bit for bit, to verify that
// change did not alter the physics, and to reproduce a bug elsewhere.
//
// The file: 8 bytes of magic, format version (u32), then chunks {kind u32, size u64, hash u64, payload}. Little endian, packed
// field by field, independent of padding and compiler. The hash covers kind, size and payload. Chunks are written and flushed
// as a unit. Heads are chunks of a kind of their own, which readers without headsets skip: the format did not change. If the
// program is killed at any byte, the file is readable up to its last complete chunk.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "exchange/tool_input.h"

namespace catgut {

constexpr uint32_t kRecordingFormat = 3;

struct RecordingHeader {
  std::string catgut_version;  // of the recording program
  uint32_t state_version = 0;  // kStateVersion of its state
  std::string scene;           // the complete scene, as write_scene gives it
};

struct RecordedTick {
  TickInput input;
  uint64_t hash = 0;  // hash_state after the tick
};

// The head of a headset's wearer, when it was known. The physics does not read it.
struct RecordedHead {
  uint64_t tick = 0;  // number of the recording's tick, from 0, after which it was noted
  Pose pose;          // [m] world; looks along -z
};

struct Recording {
  RecordingHeader header;
  std::vector<std::byte> start;  // save_state before the first tick
  std::vector<RecordedTick> tick;
  std::vector<RecordedHead> head;  // in order of time; empty without a headset
  bool truncated = false;          // no end chunk: the ticks before that are complete
  bool interrupted = false;        // the user stopped the run
  std::string fault;               // truncated: position and cause, as text
};

// Writes incrementally. Throws InputError when the file cannot be created or written (disk full, ...).
class Recorder {
 public:
  Recorder(const std::string& path, const RecordingHeader& header, const std::vector<std::byte>& start);
  ~Recorder();  // writes the pending ticks but no end chunk: only finish() marks the run as complete
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void tick(const TickInput& input, uint64_t hash);
  void head(const Pose& pose);  // after the tick written last; at most one per tick is kept
  void finish(bool interrupted);

 private:
  void chunk(uint32_t kind, const std::string& payload);
  void flush_ticks();

  std::string path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::string ticks_, heads_;
  uint64_t count_ = 0, head_at_ = 0;
};

// Throws InputError for a file that is missing, is not a recording, has another format version, or whose header or start state
// is damaged. Damage further on yields the ticks before it, `truncated` and `fault`.
Recording read_recording(const std::string& path);

// The same from bytes in memory; name: for messages.
Recording parse_recording(const std::string& bytes, const std::string& name);

}  // namespace catgut
