// SPDX-License-Identifier: Apache-2.0
// procedure: see manager.h.
#include "procedure/manager.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/archive.h"
#include "exchange/strand.h"
#include "procedure/measures.h"

namespace catgut {

// The members of a run, for save_run and load_run.
constexpr void reflect(auto& a, Like<StageRecord> auto& r) {
  a(r.state), a(r.ready), a(r.assisted), a(r.from), a(r.to), a(r.errors), a(r.good);
}
constexpr void reflect(auto& a, Like<ErrorNote> auto& n) { a(n.tick), a(n.stage), a(n.error); }
constexpr void reflect(auto& a, Like<ProcedureRun> auto& r) {
  a(r.begun), a(r.stage), a(r.record), a(r.error), a(r.tick_s), a(r.events), a(r.faults), a(r.bites), a(r.throws);
  a(r.peak_force), a(r.peak_tension), a(r.path), a(r.bite_length), a(r.bite_depth), a(r.bite_angle), a(r.opening_start);
  a(r.tip), a(r.raised);
}

namespace {

uint32_t throws_in(const Snapshot& seen) {
  uint32_t n = 0;
  for (const SutureView& s : seen.suture)
    for (const KnotView& k : s.knot) n += k.throws - (k.phase == KnotPhase::tightening && k.throws > 0);
  return n;
}

void start_stage(ProcedureRun& run, const Procedure& procedure, const Snapshot& seen) {
  run.events = {};
  run.faults = {};
  run.peak_force = run.peak_tension = run.path = 0;
  run.raised.assign(procedure.error.size(), 0);
  if (run.stage >= run.record.size()) return;
  StageRecord& r = run.record[run.stage];
  r.state = StageState::active;
  r.from = seen.tick;
  r.ready = hold(procedure.stage[run.stage].guard, seen, run);
}

void end_stage(ProcedureRun& run, const Procedure& procedure, const Snapshot& seen, StageState how) {
  StageRecord& r = run.record[run.stage];
  r.state = how;
  r.to = seen.tick;
  r.good.clear();
  for (const Condition& c : procedure.stage[run.stage].good) r.good.push_back(measured(c.measure, seen, run));
  ++run.stage;
  start_stage(run, procedure, seen);
}

void note_error(ProcedureRun& run, const Snapshot& seen, size_t error) {
  run.error.push_back({seen.tick, run.stage, static_cast<uint32_t>(error)});
  ++run.record[run.stage].errors;
}

void observe(ProcedureRun& run, const Snapshot& seen) {
  for (const Event& e : seen.event) {
    if (e.kind >= EventKind::count_) continue;
    ++run.events[static_cast<size_t>(e.kind)];
    if (e.kind == EventKind::technique_fault && e.fault < Fault::count_) ++run.faults[static_cast<size_t>(e.fault)];
    if (e.kind == EventKind::tip_entered) run.bite_angle = e.value;
    if (e.kind == EventKind::throw_locked) ++run.throws;
    if (e.kind != EventKind::bite_completed) continue;
    ++run.bites;
    run.bite_length = e.value;
    if (e.suture < seen.suture.size() && e.which < seen.suture[e.suture].bite.size())
      run.bite_depth = seen.suture[e.suture].bite[e.which].depth;
  }
  for (size_t k = 0; k < 2; ++k) {
    const Vec3 tip = seen.tool[k].pose.p;
    run.peak_force = std::max(run.peak_force, length(seen.tool[k].force));
    const float step = distance(tip, run.tip[k]);
    if (step < 0.05f) run.path += step;  // a hand that connects has not moved there
    run.tip[k] = tip;
  }
  for (const SutureView& s : seen.suture)
    for (const float t : s.thread_tension) run.peak_tension = std::max(run.peak_tension, t);
}

bool is_off_tray(const Procedure& procedure, uint32_t stage, uint32_t instrument) {
  const std::vector<std::string>& tray = procedure.stage[stage].tray;
  return !tray.empty() && instrument < procedure.instrument.size() &&
         std::find(tray.begin(), tray.end(), procedure.instrument[instrument]) == tray.end();
}

void find_errors(ProcedureRun& run, const Procedure& procedure, const Snapshot& seen) {
  for (size_t i = 0; i < procedure.error.size(); ++i) {
    const StageError& error = procedure.error[i];
    if (!error.in[run.stage]) continue;
    if (error.on != EventKind::count_) {
      for (const Event& e : seen.event)
        if (e.kind == error.on && (error.fault == Fault::none || e.fault == error.fault) &&
            static_cast<double>(e.value) >= error.value_min && (!error.off_tray || is_off_tray(procedure, run.stage, e.which)))
          note_error(run, seen, i);
    } else {
      const bool now = hold(error.when, seen, run);
      if (now && !run.raised[i]) note_error(run, seen, i);
      run.raised[i] = now;
    }
  }
}

const char* state_word(StageState s) {
  static constexpr const char* kWord[] = {"not reached", "not finished", "done", "already reached", "skipped"};
  return kWord[static_cast<size_t>(s)];
}

}  // namespace

void begin_run(ProcedureRun& run, const Procedure& procedure, const Snapshot& seen, double tick_s, size_t stage) {
  run = {};
  run.begun = true;
  run.tick_s = tick_s;
  run.record.resize(procedure.stage.size());
  run.stage = static_cast<uint32_t>(std::min(stage, procedure.stage.size()));
  for (const SutureView& s : seen.suture)
    run.bites +=
        static_cast<uint32_t>(std::count_if(s.bite.begin(), s.bite.end(), [](const BiteView& b) { return b.complete; }));
  run.throws = throws_in(seen);
  run.opening_start = seen.opening_area;
  for (size_t k = 0; k < 2; ++k) run.tip[k] = seen.tool[k].pose.p;
  start_stage(run, procedure, seen);
}

bool update_run(ProcedureRun& run, const Procedure& procedure, const Snapshot& seen) {
  if (!run.begun || finished(run, procedure)) return false;
  observe(run, seen);
  find_errors(run, procedure, seen);
  const uint32_t was = run.stage;
  while (run.stage < procedure.stage.size()) {
    const ProcedureStage& s = procedure.stage[run.stage];
    StageRecord& r = run.record[run.stage];
    r.ready = r.ready || hold(s.guard, seen, run);
    if (r.ready && hold(s.goal, seen, run)) {
      end_stage(run, procedure, seen, run.stage == was ? StageState::done : StageState::met);
    } else if (!s.skip.empty() && hold(s.skip, seen, run)) {
      if (s.skip_is_error) note_error(run, seen, procedure.error.size());
      end_stage(run, procedure, seen, StageState::skipped);
    } else {
      break;
    }
  }
  return run.stage != was;
}

bool finished(const ProcedureRun& run, const Procedure& procedure) { return run.stage >= procedure.stage.size(); }

bool goal_reached(const ProcedureRun& run, const Procedure& procedure, const Snapshot& seen) {
  return !finished(run, procedure) && hold(procedure.stage[run.stage].goal, seen, run);
}

std::string hint_of(const ProcedureRun& run, const Procedure& procedure, const Snapshot& seen) {
  if (finished(run, procedure)) return "";
  for (const StageHint& h : procedure.stage[run.stage].hint)
    if (hold(h.when, seen, run)) return h.text;
  return "";
}

std::string guard_of(const ProcedureRun& run, const Procedure& procedure) {
  if (finished(run, procedure) || run.record[run.stage].ready) return "";
  return procedure.stage[run.stage].guard_text;
}

std::string error_text(const Procedure& procedure, const ErrorNote& note) {
  if (note.error < procedure.error.size()) return procedure.error[note.error].text;
  const ProcedureStage& s = procedure.stage[note.stage];
  return s.title + ": skipped. " + s.skip_text;
}

std::vector<Feedback> feedback(const ProcedureRun& run, const Procedure& procedure) {
  std::vector<Feedback> out;
  for (uint32_t k = 0; k < run.record.size(); ++k) {
    const StageRecord& r = run.record[k];
    const ProcedureStage& s = procedure.stage[k];
    if (r.state == StageState::waiting) continue;
    Feedback f{k, r.state == StageState::done || r.state == StageState::met, ""};
    std::vector<std::string> praise, again;
    if (r.state == StageState::active) again.push_back("not finished");
    if (r.state == StageState::skipped) again.push_back("skipped: " + s.skip_text), f.well = !s.skip_is_error;
    for (size_t e = 0; e <= procedure.error.size(); ++e) {
      const auto n = std::count_if(run.error.begin(), run.error.end(),
                                   [&](const ErrorNote& note) { return note.stage == k && note.error == e; });
      if (n == 0 || e == procedure.error.size()) continue;
      const StageError& error = procedure.error[e];
      again.push_back((n > 1 ? fmt::format("{} x {}", n, error.text) : error.text) +
                      (error.why.empty() ? "" : " " + error.why));
    }
    for (size_t i = 0; i < r.good.size() && i < s.good.size(); ++i) {
      const bool ok = r.good[i] >= s.good[i].min && r.good[i] <= s.good[i].max;
      if (r.state == StageState::done) (ok ? praise : again).push_back(condition_text(s.good[i], r.good[i]));
    }
    if (r.assisted) again.push_back("with a demonstration");
    f.well = f.well && again.empty();
    const std::vector<std::string>& parts = f.well ? praise : again;
    f.text = s.title + (parts.empty() ? "" : fmt::format(": {}", fmt::join(parts, "; ")));
    out.push_back(f);
  }
  return out;
}

std::string run_table(const ProcedureRun& run, const Procedure& procedure) {
  std::string out;
  size_t done = 0;
  for (size_t k = 0; k < run.record.size(); ++k) {
    const StageRecord& r = run.record[k];
    const ProcedureStage& s = procedure.stage[k];
    done += r.state == StageState::done || r.state == StageState::met;
    const std::string time = r.state == StageState::waiting || r.state == StageState::active
                                 ? ""
                                 : fmt::format("{:.1f} s", static_cast<double>(r.to - r.from) * run.tick_s);
    out += fmt::format("{:>3}  {:<26} {:<16} {:>8}{}\n", k + 1, s.name, state_word(r.state), time,
                       r.errors ? fmt::format("  {} error{}", r.errors, r.errors > 1 ? "s" : "") : "");
    if (r.state == StageState::skipped) out += fmt::format("     skipped: {}\n", s.skip_text);
    if (r.state == StageState::active && !r.ready) out += fmt::format("     missing: {}\n", s.guard_text);
  }
  for (const ErrorNote& n : run.error) {
    const bool skip = n.error >= procedure.error.size();
    out += fmt::format("  !  {:.1f} s, {}: {}{}\n", static_cast<double>(n.tick) * run.tick_s, procedure.stage[n.stage].name,
                       error_text(procedure, n),
                       skip || procedure.error[n.error].why.empty() ? "" : " " + procedure.error[n.error].why);
  }
  return out + fmt::format("{} of {} stages, {} error{}\n", done, run.record.size(), run.error.size(),
                           run.error.size() == 1 ? "" : "s");
}

bool faultless(const ProcedureRun& run, const Procedure& procedure) {
  return finished(run, procedure) && run.error.empty() &&
         std::all_of(run.record.begin(), run.record.end(),
                     [](const StageRecord& r) { return r.state == StageState::done || r.state == StageState::met; });
}

std::vector<std::byte> save_run(const ProcedureRun& run) {
  std::vector<std::byte> bytes;
  ByteSink sink{bytes};
  Writer<ByteSink> writer(sink);
  writer(run);
  return bytes;
}

ProcedureRun load_run(const std::vector<std::byte>& bytes, const Procedure& procedure) {
  ProcedureRun run;
  Reader reader(bytes, "procedure");
  reader(run);
  const size_t n = procedure.stage.size(), errors = procedure.error.size();
  bool fits = reader.at == bytes.size() && run.stage <= n && run.record.size() == n && run.raised.size() == errors;
  for (const StageRecord& r : run.record) fits = fits && r.state <= StageState::skipped;
  for (const ErrorNote& e : run.error) fits = fits && e.stage < n && e.error <= errors;
  if (!fits) throw InputError("procedure", "the saved progress belongs to another procedure", "start it again");
  return run;
}

}  // namespace catgut
