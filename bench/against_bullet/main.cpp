// SPDX-License-Identifier: Apache-2.0
// bench/against_bullet: Catgut and Bullet's soft bodies with the same tissue, thread, pins, gravity, tool and substeps, in one
// program and alternating tick by tick, so that interference affects both alike.
// docs/benchmarks.md describes what each side simulates.
#include <time.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bullet_side.h"
#include "core/check.h"
#include "core/jobs.h"
#include "sim/state.h"
#include "workload.h"

namespace {
using namespace catgut;

struct Contender {
  std::string name;
  std::vector<double> ms;
  size_t contacts = 0;     // maximum in the last substep of a tick
  double carried_off = 0;  // [m] at the end
};

// On one thread: its own processor time, so that other programs do not count; on more: wall time.
double seconds(bool one_thread) {
  timespec t;
  clock_gettime(one_thread ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double ms_of(bool one_thread, auto&& work) {
  const double start = seconds(one_thread);
  work();
  return 1000 * (seconds(one_thread) - start);
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + static_cast<long>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

struct Result {
  std::string name;
  uint32_t tissue, thread, clusters;
  size_t edges;
  int ticks;
  std::vector<Contender> contender;  // Catgut first
};

Result race(const std::string& scene, int times, int threads, int ticks) {
  const Workload work = make_workload(scene, times);
  const Model& model = *work.model;
  Jobs jobs(threads);
  const StatePtr state = initial_state(model);
  std::vector<std::unique_ptr<BulletSide>> bullet;
  for (BulletWay way : {BulletWay::clusters, BulletWay::fewer_clusters, BulletWay::links})
    bullet.push_back(std::make_unique<BulletSide>(work, way));
  std::vector<Contender> c(4);
  c[0].name = "Catgut";
  c[1].name = "Bullet, a cluster a particle";
  c[2].name = "Bullet, different clusters";
  c[3].name = "Bullet, links";

  const int warm = ticks / 2;  // tissue sinks under its weight, caches fill
  TickInput input;
  input.hand[1].connected = 0;
  for (int t = 0; t < warm + ticks; ++t) {
    const float time = static_cast<float>(t + 1) * model.dt;
    input.tick = static_cast<uint64_t>(t);
    input.hand[0].pose = tool_pose(work, time);
    const double own = ms_of(threads == 1, [&] { step(model, *state, input, jobs); });
    if (t >= warm) c[0].ms.push_back(own), c[0].contacts = std::max<size_t>(c[0].contacts, state->scratch.contacts);
    for (size_t k = 0; k < bullet.size(); ++k) {
      const double theirs = ms_of(threads == 1, [&] { bullet[k]->tick(time); });
      bullet[k]->put_back_pinned();
      if (t >= warm) c[k + 1].ms.push_back(theirs), c[k + 1].contacts = std::max(c[k + 1].contacts, bullet[k]->contacts());
    }
  }
  double sum = 0, count = 0;
  for (uint32_t i = 0; i < model.solver.tissue; ++i)
    if (model.solver.inv_mass[i] > 0) sum += static_cast<double>(distance(xyz(state->solver.x[i]), model.start[i])), ++count;
  c[0].carried_off = sum / count;
  for (size_t k = 0; k < bullet.size(); ++k) c[k + 1].carried_off = bullet[k]->carried_off();
  const SolverModel& m = model.solver;
  return {work.name, m.tissue, m.thread.count, m.shape.clusters, work.edge.size(), ticks, c};
}

void print(const Result& r) {
  std::printf("| %s | %u + %u | %u | %zu |", r.name.c_str(), r.tissue, r.thread, r.clusters, r.edges);
  const double own = median(r.contender[0].ms);
  std::printf(" %.3f |", own);
  for (size_t k = 1; k < r.contender.size(); ++k) {
    const double theirs = median(r.contender[k].ms);
    std::printf(" %.2f (x %.1f) |", theirs, theirs / own);
  }
  for (const Contender& c : r.contender) std::printf(" %.2f%s", 1000 * c.carried_off, &c == &r.contender.back() ? " |" : " /");
  for (const Contender& c : r.contender) std::printf(" %zu%s", c.contacts, &c == &r.contender.back() ? " |\n" : " /");
  std::fflush(stdout);
}

nlohmann::ordered_json to_json(const Result& r) {
  nlohmann::ordered_json j{{"scene", r.name},        {"tissue", r.tissue}, {"thread", r.thread},
                           {"clusters", r.clusters}, {"edges", r.edges},   {"ticks", r.ticks}};
  const double own = median(r.contender[0].ms);
  for (const Contender& c : r.contender)
    j["contender"].push_back({{"name", c.name},
                              {"median_ms", median(c.ms)},
                              {"least_ms", *std::min_element(c.ms.begin(), c.ms.end())},
                              {"ratio", median(c.ms) / own},
                              {"carried_off_mm", 1000 * c.carried_off},
                              {"most_contacts", c.contacts}});
  return j;
}

int run(int argc, char** argv) {
  std::string json;
  int threads = 1, ticks = 120, upto = 4;
  std::vector<std::string> scenes{"purse_string", "connell", "stay", "lembert"};
  CLI::App app("Catgut and Bullet's soft bodies, tick by tick in turns", "against_bullet");
  app.add_option("--scene", scenes, "scenes to run")->capture_default_str();
  app.add_option("--json", json, "results as JSON")->type_name("FILE");
  app.add_option("--threads", threads, "of Catgut; Bullet's soft bodies have one")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_option("--ticks", ticks,
                 "measured; half as many before them are not. A quarter of that for the Lembert scene x 4, a tenth for x 16")
      ->check(CLI::Range(10, 100000))
      ->capture_default_str();
  app.add_option("--upto", upto, "the largest multiple of the Lembert scene's particles")
      ->check(CLI::IsMember({1, 4, 16}))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& done) { return app.exit(done); } catch (const CLI::ParseError& error) {
    return std::fprintf(stderr, "against_bullet: %s; --help explains\n", error.what()), 2;
  }
  // Tried before the work; an existing file stays until the new content is complete.
  if (!json.empty() && !std::ofstream(json, std::ios::app)) throw InputError(json, "cannot be written", "choose another place");

  std::printf(
      "Milliseconds per tick of 1/60 s in 8 substeps, medians of %s, all four interleaved tick by tick. Catgut: preset paper, "
      "everything enabled, %d thread(s). Shape\n"
      "matching runs 2 sweeps over distinct clusters, self-contact 10, tools and thread 5. Bullet: %s precision, one thread, 1 "
      "sweep over the clusters or 3 over the links. Its tools\n"
      "touch tissue, its thread is links on the drape, and with links, vertices also meet faces of other bodies. Displacement: "
      "mean distance of the tissue from its start [mm].\n"
      "Contacts: maximum. Both in the order of the columns.\n\n",
      threads == 1 ? "thread CPU time" : "wall time", threads, kBulletIsSingle ? "single" : "double");
  std::printf(
      "| scene | particles | clusters | edges | Catgut | Bullet, one cluster per particle | Bullet, distinct clusters | "
      "Bullet, "
      "links | displacement | "
      "contacts |\n|---|---|---|---|---|---|---|---|---|---|\n");
  nlohmann::ordered_json all;
  const auto one = [&](const std::string& scene, int times, int n) {
    const Result r = race(scene, times, threads, n);
    print(r);
    all.push_back(to_json(r));
  };
  for (const std::string& scene : scenes) one(scene, 1, ticks);
  if (upto >= 4) one("lembert", 4, std::max(10, ticks / 4));
  if (upto >= 16) one("lembert", 16, std::max(10, ticks / 10));
  if (json.empty()) return 0;
  std::ofstream out(json);
  out << all.dump(2) << "\n";
  out.close();
  if (!out) throw InputError(json, "cannot be written", "is the disk full?");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const InputError& error) {
    std::fprintf(stderr, "against_bullet: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "against_bullet: %s\n", error.what());
    return 1;
  }
}
