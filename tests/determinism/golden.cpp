// SPDX-License-Identifier: Apache-2.0
// tests/determinism: the golden hashes. Runs a scene with the scripted surgeon and hashes the published data of every tick. The
// hashes must equal those in golden.txt, for any compiler, instruction set and number of workers.
//   golden check FILE SCENE PRESET       compares the run with the file's rows; exit code 1 at the first difference
//   golden print [SCENE PRESET]          prints the rows, with a last column for the bytes of the whole state
//   golden update FILE                   runs everything and writes the file
// Options after these: --seconds S (maximum simulated time), --threads N, --simd NAME (avx3, avx2, sse4, neon: the
// kernels' instruction set, instead of the best one of the processor).
//
// The hashes cover physical quantities of the Snapshot, not the bytes of `State`: a new layout of the state keeps them. Three
// columns show what changed: motion (positions and orientations), force (tensions and forces), events (tick, name, place).
// A row holds the hash of all ticks up to its time, so the first row that differs gives the second of the first difference.
#include <hwy/targets.h>

#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "catgut/catgut.h"
#include "core/hash.h"

namespace {
using namespace catgut;

struct Case {
  const char *scene, *preset;
  double seconds;  // [s] simulated, maximum
};
// The whole procedure of each technique, ten seconds of repetitive scenes, and of the tied stitch the sewing and the first
// throw.
constexpr Case kCase[] = {{"purse_string", "default", 200},
                          {"connell", "default", 200},
                          {"stay", "default", 200},
                          {"lembert", "default", 200},
                          {"two_sutures", "default", 200},
                          {"stress_one_body", "default", 10},
                          {"stress_two_bodies", "default", 10},
                          {"interrupted_tied", "default", 30},
                          {"purse_string", "paper", 10},
                          {"connell", "paper", 10},
                          {"stay", "paper", 10},
                          {"lembert", "paper", 10}};

// A hash of a sequence of numbers.
class Hash {
 public:
  void add(const void* data, size_t bytes) { value_ = hash_bytes(data, bytes, value_); }
  void add(float v) { add(&v, sizeof v); }
  void add(uint32_t v) { add(&v, sizeof v); }
  void add(const Vec3& v) {
    const float f[3] = {v.x, v.y, v.z};
    add(f, sizeof f);
  }
  void add(const Quat& q) {
    const float f[4] = {q.x, q.y, q.z, q.w};
    add(f, sizeof f);
  }
  void add(const Pose& p) {
    add(p.p);
    add(p.q);
  }
  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 0;
};

struct Row {
  int second = 0;
  uint64_t motion = 0, force = 0, events = 0, state = 0;  // state: not in the file, its layout may change
};

class Seen {
 public:
  void tick(const Snapshot& s) {
    for (const Vec3& p : s.particle) motion_.add(p);
    for (const Quat& q : s.rotation) motion_.add(q);
    for (const ToolView& t : s.tool) {
      if (t.instrument < 0) continue;  // an empty hand
      motion_.add(t.pose);
      motion_.add(t.jaw);
      force_.add(t.force);
      force_.add(t.torque);
    }
    for (const SutureView& suture : s.suture) {
      motion_.add(suture.needle.pose);
      for (uint32_t i : suture.thread_order) motion_.add(i);
      for (const SuturePointView& p : suture.suture_point) motion_.add(p.position);
      for (const KnotView& k : suture.knot) motion_.add(k.position);
    }
    motion_.add(s.opening_area);
    motion_.add(s.closure);
    for (const SutureView& suture : s.suture)
      for (float tension : suture.thread_tension) force_.add(tension);
    for (const Event& e : s.event) {
      events_.add(static_cast<uint32_t>(e.tick));
      const std::string_view name = event_name(e.kind);
      events_.add(name.data(), name.size());
      events_.add(e.where);
    }
  }
  Row row(int second, uint64_t state) const { return {second, motion_.value(), force_.value(), events_.value(), state}; }

 private:
  Hash motion_, force_, events_;
};

// A row each second for ten seconds, then every tenth second and at the end.
std::vector<Row> run(const Case& which, double seconds, int threads) {
  SceneSpec scene = read_scene(which.scene);
  use_preset(scene, which.preset);
  const std::shared_ptr<const Model> model = build_model(scene);
  const StatePtr state = initial_state(*model);
  Jobs jobs(threads);
  Snapshot seen;
  publish(*model, *state, seen);
  const std::unique_ptr<Surgeon> surgeon = scripted_surgeon(scene, picture_model(*model));

  const double rate = static_cast<double>(scene.solver.tick_rate);
  const auto ticks = [&](double s) { return static_cast<uint64_t>(std::llround(s * rate)); };
  const uint64_t last = ticks(std::min(seconds, which.seconds)), settled = ticks(static_cast<double>(scene.settle));
  TickInput nobody, input;
  for (ToolInput& hand : nobody.hand) hand.connected = 0;
  Seen hashes;
  std::vector<Row> rows;
  int second = 1;
  for (uint64_t t = 0; t < last && !surgeon->done(); ++t) {
    if (t < settled) input.hand = nobody.hand;
    else input = surgeon->operate(seen, static_cast<float>(1 / rate));
    input.tick = t;
    step(*model, *state, input, jobs);
    publish(*model, *state, seen);
    hashes.tick(seen);
    if (t + 1 != ticks(second) && t + 1 != last && !surgeon->done()) continue;
    rows.push_back(hashes.row(second, hash_state(*model, *state)));
    second += second < 10 ? 1 : 10;
  }
  return rows;
}

using Golden = std::map<std::string, std::map<int, Row>>;  // "scene preset" -> second -> row

Golden read_golden(const char* path) {
  Golden golden;
  std::ifstream in(path);
  if (!in) throw InputError(path, "it cannot be read", "golden update FILE writes it");
  for (std::string line; std::getline(in, line);) {
    char scene[64], preset[64];
    Row r;
    if (line.empty() || line[0] == '#') continue;
    if (std::sscanf(line.c_str(), "%63s %63s %d %lx %lx %lx", scene, preset, &r.second, &r.motion, &r.force, &r.events) != 6)
      throw InputError(path, "not a row of scene, preset, second and three hashes: " + line, "golden update FILE writes it");
    golden[std::string(scene) + " " + preset][r.second] = r;
  }
  return golden;
}

void print(FILE* out, const Case& c, const Row& r, bool with_state) {
  std::fprintf(out, "%s %s %d %016lx %016lx %016lx", c.scene, c.preset, r.second, r.motion, r.force, r.events);
  if (with_state) std::fprintf(out, " %016lx", r.state);
  std::fputc('\n', out);
}

int check(const char* path, const Case& c, double seconds, int threads) {
  const auto want = read_golden(path)[std::string(c.scene) + " " + c.preset];
  const std::vector<Row> got = run(c, seconds, threads);
  if (want.empty() || got.empty()) {
    std::printf("%s %s: no rows to compare\n", c.scene, c.preset);
    return 1;
  }
  for (const Row& r : got) {
    const auto w = want.find(r.second);
    // A run shortened by --seconds ends between two rows of the file.
    if (w == want.end() && &r == &got.back() && seconds < c.seconds) break;
    std::string differs;
    if (w == want.end()) differs = " the length of the run";
    else {
      if (w->second.motion != r.motion) differs += " motion";
      if (w->second.force != r.force) differs += " force";
      if (w->second.events != r.events) differs += " events";
    }
    if (!differs.empty()) {
      std::printf("%s %s: differs from %s in the time up to %d s:%s\n", c.scene, c.preset, path, r.second, differs.c_str());
      std::printf("A deliberate change of behavior: golden update FILE, and one sentence of why in the commit.\n");
      return 1;
    }
  }
  if (seconds >= c.seconds && got.size() != want.size()) {
    std::printf("%s %s: the run ended after %d s, the file goes on\n", c.scene, c.preset, got.back().second);
    return 1;
  }
  std::printf("%s %s: %zu rows equal\n", c.scene, c.preset, got.size());
  return 0;
}

int update(const char* path, int threads) {
  std::vector<std::vector<Row>> rows;  // all of them first: a failing run leaves the file unchanged
  for (const Case& c : kCase) rows.push_back(run(c, c.seconds, threads));
  FILE* out = std::fopen(path, "w");
  if (!out) throw InputError(path, "it cannot be written", "choose another file");
  std::fputs(
      "# Golden hashes: scene, preset, second, motion, force, events. Written by tests/determinism/golden.cpp (update).\n",
      out);
  for (size_t i = 0; i < rows.size(); ++i)
    for (const Row& r : rows[i]) print(out, kCase[i], r, false);
  return std::fclose(out) == 0 ? 0 : 2;
}

void use_simd(const std::string& name) {
  std::string there;
  for (int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    const int64_t target = left & -left;
    std::string its_name = hwy::TargetName(target);
    for (char& c : its_name) c = static_cast<char>(std::tolower(c));
    if (its_name == name) return hwy::SetSupportedTargetsForTest(target);
    there += " " + its_name;
  }
  throw InputError("--simd " + name, "this processor does not have it", "it has" + there);
}

int main_of(std::vector<std::string> arg) {
  double seconds = 1e9;
  int threads = 1;
  for (size_t i = 0; i + 1 < arg.size();) {
    if (arg[i] == "--seconds") seconds = std::atof(arg[i + 1].c_str());
    else if (arg[i] == "--simd") use_simd(arg[i + 1]);
    else if (arg[i] == "--threads") threads = std::atoi(arg[i + 1].c_str());
    else {
      ++i;
      continue;
    }
    arg.erase(arg.begin() + static_cast<ptrdiff_t>(i), arg.begin() + static_cast<ptrdiff_t>(i) + 2);
  }
  const auto named = [&](size_t at) -> const Case& {
    for (const Case& c : kCase)
      if (arg[at] == c.scene && arg[at + 1] == c.preset) return c;
    throw InputError(arg[at] + " " + arg[at + 1], "no such case", "golden.cpp lists them");
  };
  if (arg.size() == 4 && arg[0] == "check") return check(arg[1].c_str(), named(2), seconds, threads);
  if (arg.size() == 2 && arg[0] == "update") return update(arg[1].c_str(), threads);
  if (!arg.empty() && arg[0] == "print" && (arg.size() == 1 || arg.size() == 3)) {
    for (const Case& c : kCase)
      if (arg.size() == 1 || &c == &named(1))
        for (const Row& r : run(c, seconds, threads)) print(stdout, c, r, true);
    return 0;
  }
  throw InputError("golden", "wrong arguments",
                   "golden check FILE SCENE PRESET, golden print [SCENE PRESET], golden update FILE");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return main_of({argv + 1, argv + argc});
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
}
