// SPDX-License-Identifier: Apache-2.0
// tests/fuzz: see entry_points.h.
#include "entry_points.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "core/check.h"
#include "core/hash.h"
#include "geometry/mesh_io.h"
#include "procedure/scene_file.h"
#include "sim/recording.h"
#include "sim/simulation.h"
#include "sim/topology.h"

// assimp leaks memory on some broken meshes; what it leaks is not ours to mend.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp"; }

namespace catgut::fuzz {
namespace {

[[noreturn]] void fault(const std::string& what) {
  std::fprintf(stderr, "fuzz: %s\n", what.c_str());
  std::abort();
}

template <typename Work>
bool guarded(Work&& work) {
  try {
    work();
    return true;
  } catch (const InputError& error) {
    for (const char* c = error.what(); *c; ++c)
      if (static_cast<unsigned char>(*c) < 0x20) fault(std::string("a message of more than one line: ") + error.what());
    return false;
  } catch (const std::exception& error) { fault(std::string("an exception that is no InputError: ") + error.what()); }
}

std::string text_of(const uint8_t* data, size_t size) { return {reinterpret_cast<const char*>(data), size}; }

template <typename Int>
void put(std::string& out, Int value) {
  for (size_t i = 0; i < sizeof(Int); ++i) out += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i) & 0xff);
}

// A small scene with every kind of state.
const Model& small_model() {
  static const std::shared_ptr<const Model> model = [] {
    SceneSpec scene;
    scene.name = "small";
    scene.body.emplace_back();
    scene.body[0].particles = 240;
    scene.thread.particles = 12;
    scene.solver.substeps = 2;
    return build_model(scene);
  }();
  return *model;
}

}  // namespace

bool scene(const uint8_t* data, size_t size) {
  SceneSpec read;
  if (!guarded([&] { read = parse_scene(text_of(data, size), "fuzz.toml"); })) return false;
  const std::string written = write_scene(read);
  if (!guarded([&] {
        if (!same_scene(parse_scene(written, "fuzz.toml"), read)) fault("a scene changed in writing and reading:\n" + written);
      }))
    fault("a written scene was refused:\n" + written);
  return true;
}

bool setting(const uint8_t* data, size_t size) {
  SceneSpec scene;
  scene.body.resize(2);
  if (!guarded([&] { set_value(scene, text_of(data, size)); })) return false;
  if (!guarded([&] {
        if (!same_scene(parse_scene(write_scene(scene), "fuzz.toml"), scene)) fault("a setting changed in writing and reading");
      }))
    fault("a scene was refused after --set:\n" + write_scene(scene));
  return true;
}

bool recording(const uint8_t* data, size_t size) {
  if (size == 0) return false;
  std::string file;
  if (data[0] == 'r') {
    file = text_of(data + 1, size - 1);
  } else {
    // Magic and format, then chunks of {kind u8, size u16, payload}: within the power of a hostile writer, hashes included.
    file = std::string("CATGUT\x1a\n", 8);
    put(file, kRecordingFormat);
    for (size_t at = 1; at + 3 <= size;) {
      const uint32_t kind = data[at];
      const size_t wanted = data[at + 1] | static_cast<size_t>(data[at + 2]) << 8, length = std::min(wanted, size - at - 3);
      const std::string payload = text_of(data + at + 3, length);
      put(file, kind), put(file, static_cast<uint64_t>(length));
      put(file, hash_bytes(payload.data(), length, length * 8 + kind));
      file += payload;
      at += 3 + length;
    }
  }
  return guarded([&] {
    const Recording read = parse_recording(file, "fuzz.cgrec");
    if (read.tick.size() * 160 > file.size()) fault("more ticks than the file can hold");
  });
}

bool state(const uint8_t* data, size_t size) {
  const Model& model = small_model();
  static const std::vector<std::byte> good = save_state(model, *initial_state(model));
  if (size == 0) return false;
  static const std::vector<std::byte> divided = [&] {
    const StatePtr state = initial_state(model);
    if (divide_by_plane(model, *state, 0, {0, 0, 0}, {1, 0, 0.1f}) == 0) fault("nothing was divided");
    return save_state(model, *state);
  }();
  std::vector<std::byte> bytes = data[0] == 'd' ? divided : good;
  if (data[0] == 'r') {
    bytes.assign(reinterpret_cast<const std::byte*>(data) + 1, reinterpret_cast<const std::byte*>(data) + size);
  } else {
    // Each five bytes: where (24 bits, from the end when the highest is set), what, and how.
    for (size_t at = 1; at + 5 <= size; at += 5) {
      const size_t offset = data[at] | static_cast<size_t>(data[at + 1]) << 8 | static_cast<size_t>(data[at + 2] & 0x7f) << 16;
      if (bytes.empty()) break;
      const size_t i = data[at + 2] & 0x80 ? bytes.size() - 1 - offset % bytes.size() : offset % bytes.size();
      const std::byte value{data[at + 3]};
      if (data[at + 4] < 0xe0) bytes[i] = value;
      else if (data[at + 4] < 0xf0) bytes.insert(bytes.begin() + static_cast<long>(i), value);
      else bytes.erase(bytes.begin() + static_cast<long>(i));
    }
  }
  const StatePtr state = initial_state(model);
  if (!guarded([&] { load_state(model, *state, bytes); })) return false;
  if (save_state(model, *state) != bytes) fault("a state changed in loading and saving");
  // An accepted state must be safe to continue from.
  Jobs jobs(1);
  TickInput input;
  Snapshot seen;
  for (int tick = 0; tick < 2; ++tick) {
    step(model, *state, input, jobs);
    publish(model, *state, seen);
  }
  state_is_valid(model, *state);
  return true;
}

bool mesh(const uint8_t* data, size_t size) {
  if (size == 0) return false;
  const char* kind = data[0] == 's' ? ".stl" : data[0] == 'g' ? ".glb" : data[0] == 'j' ? ".gltf" : ".obj";
  static const std::string stem =
      (std::filesystem::temp_directory_path() / ("catgut_fuzz_" + std::to_string(getpid()))).string();
  const std::string path = stem + kind;
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size - 1));
  const bool good = guarded([&] {
    const TriangleMesh read = read_mesh(path, "");
    for (const Triangle& t : read.triangle)
      for (const uint32_t v : t)
        if (v >= read.position.size()) fault("a triangle names a vertex that is not there");
  });
  std::filesystem::remove(path);
  return good;
}

std::span<const Entry> entries() {
  static constexpr Entry kEntry[] = {
      {"scene", scene}, {"setting", setting}, {"recording", recording}, {"state", state}, {"mesh", mesh}};
  return kEntry;
}

}  // namespace catgut::fuzz
