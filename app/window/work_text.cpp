// SPDX-License-Identifier: Apache-2.0
// app/window: see work_text.h.
#include "window/work_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "exchange/strand.h"
#include "procedure/manager.h"
#include "technique/technique.h"
#include "window/language.h"

namespace catgut {
namespace {

constexpr float kAside = 0.0015f, kDeep = 0.4f;  // [m] from the target, fraction of the wanted depth: within tolerance
constexpr double kErrorShown = 10;               // [s]
constexpr double kRemarkShown = 15;              // [s]

struct KeyLine {
  const char* text;
  bool (*used)(const WindowInput& in);
};
constexpr KeyLine kKeys[] = {
    {"mouse            move instrument",
     [](const WindowInput& in) { return in.mouse.right != 0 && !in.mouse.turn && !in.mouse.both; }},
    {"wheel, Shift     depth", [](const WindowInput& in) { return in.mouse.wheel != 0; }},
    {"left, space      close or open jaws", [](const WindowInput& in) { return in.mouse.jaw_presses > 0; }},
    {"right            drive needle, roll instrument",
     [](const WindowInput& in) { return in.mouse.turn && in.mouse.right != 0; }},
    {"Ctrl+right, Q E  arcball rotation", [](const WindowInput& in) { return in.mouse.roll != 0; }},
    {"W                both hands: wrap, pull apart",
     [](const WindowInput& in) { return in.mouse.both && in.mouse.right != 0; }},
    {"Tab              other hand", [](const WindowInput& in) { return in.mouse.hand_changes > 0; }},
    {"C  N             cut thread or pen, new suture", [](const WindowInput& in) { return in.mouse.cut || in.mouse.fresh; }},
    {"I  K             next instrument, park or lay down",
     [](const WindowInput& in) { return in.key == Key::next_instrument || in.key == Key::park; }},
    {"1 2 3            fine, normal, fast", [](const WindowInput& in) { return in.speed >= 0; }},
    {"middle, arrows   orbit; Ctrl+wheel: zoom",
     [](const WindowInput& in) { return in.orbit_right != 0 || in.orbit_up != 0 || in.closer != 0; }},
    {"- +              slow motion", [](const WindowInput& in) { return in.key == Key::slower || in.key == Key::faster; }},
    {"Backspace        undo bite", [](const WindowInput& in) { return in.key == Key::take_back; }},
    {"F2  F3  F12      settings, profiler, screenshot",
     [](const WindowInput& in) { return in.key == Key::settings || in.key == Key::developer || in.key == Key::picture; }},
    {"R                record, stop recording", [](const WindowInput& in) { return in.key == Key::record; }},
    {"F9               haptic force on or off", [](const WindowInput& in) { return in.key == Key::arms_off; }},
    {"Esc              pause     F1 hide keys", [](const WindowInput&) { return false; }},
};

std::string instrument_in_hand(const WorkView& v, size_t hand) {
  const int i = v.seen->tool[hand].instrument;
  return i < 0 ? "empty" : v.picture->instrument[static_cast<size_t>(i)].title;
}

// A procedure that starts at a later stage: what was there before counts as present.
SessionMetrics with_stages_before(const LiveStatus& s) {
  SessionMetrics out = s.metrics;
  if (!s.procedure.begun) return out;
  out.bites = std::max(out.bites, s.procedure.bites);
  out.throws = std::max(out.throws, s.procedure.throws);
  out.knots = std::max(out.knots, out.throws > 0 ? 1u : 0u);
  return out;
}

Panel state_panel(const WorkView& v, const Settings& settings, bool procedure) {
  const LiveStatus& s = *v.status;
  const bool silent = settings.guidance == Guidance::exam && !v.watching;
  Panel p{"state", {{Tone::normal, v.scene->title}}, 2, -1, 0, 0, 0, 0.62f};
  auto& line = p.line;
  if (s.settling) {
    line.push_back({Tone::quiet, s.preparing ? fmt::format("Preparing: {}", s.doing) : "Settling..."});
    return p;
  }
  const bool still = s.paused || s.reading, slow = s.time_factor > 0 && s.time_factor < 0.93f * s.speed && !still;
  const std::string pace =
      still ? "paused" : fmt::format("real-time factor {:.2f}{}", s.time_factor, s.speed < 1 && !slow ? "  slow motion" : "");
  line.push_back({Tone::quiet, clock_text(s.metrics.time_s) + "   " + pace + (s.recording ? "   REC" : "")});
  if (slow) line.push_back({Tone::bad, "! below real time"});
  if (!procedure) line.push_back({Tone::quiet, fmt::format("tick {:.1f} ms, {:.1f} fps", s.tick_ms, v.pictures_per_s)});
  if (!v.headset.empty()) line.push_back({Tone::quiet, v.headset});
  if (silent) line.push_back({Tone::quiet, "exam: no feedback"});
  else
    for (const std::string& text : technique_lines(*v.scene, *v.seen, with_stages_before(s)))
      line.push_back({Tone::normal, text});
  if (!s.doing.empty()) line.push_back({Tone::quiet, "surgeon: " + s.doing});
  const TechniqueRow* technique = find_technique(v.scene->technique.name);
  if (technique && settings.guidance == Guidance::learn && !v.watching && !procedure)
    line.push_back({Tone::accent, technique->hint});
  for (size_t k = 0; k < 2; ++k) {
    const ArmView& arm = s.arm_view[k];
    if (arm.most <= 0) continue;  // no such device
    const auto bars = static_cast<size_t>(std::clamp(20 * arm.force / arm.most, 0.0f, 20.0f));
    line.push_back(
        {*arm.off ? Tone::bad : Tone::quiet,
         fmt::format("{} arm {:.1f} N {:<20}{}{}{}", arm.side == 0 ? "right" : "left", arm.force, std::string(bars, '|'),
                     arm.strength == 1 ? "" : fmt::format(" x{:.2g}", arm.strength), *arm.off ? "  no force: " : "", arm.off)});
  }
  if (!s.fault.empty()) line.push_back({Tone::bad, "! " + s.fault}), p.columns = 60;
  return p;
}

Panel hand_panel(const WorkView& v, const Settings& settings) {
  const size_t k = v.mouse->active;
  const char* speed = v.speed < 1 ? "  fine" : v.speed > 1 ? "  fast" : "";
  Panel p{"hand",
          {{Tone::normal, fmt::format("{} ({} hand){}", instrument_in_hand(v, k),
                                      (k == 0) != settings.left_handed ? "right" : "left", speed)}},
          2,
          -1,
          1,
          1,
          0,
          0.62f};
  if (v.steering->hand[k].snapped) {
    const HelpAt at = v.steering->hand[k].at;
    p.line.push_back({Tone::accent, at == HelpAt::needle ? "needle: close jaws"
                                    : at == HelpAt::tail ? "tail: close jaws"
                                    : at == HelpAt::bite ? "bite: drive needle"
                                    : at == HelpAt::rim  ? "wall: close jaws"
                                                         : "tip on tissue; wheel: lift it"});
  }
  if (const int i = v.seen->tool[k].instrument; i >= 0 && v.picture->instrument[static_cast<size_t>(i)].can(kCauterize)) {
    const PenMode mode = v.seen->instrument[static_cast<size_t>(i)].pen;
    p.line.push_back({mode == PenMode::cut ? Tone::bad : Tone::quiet, mode == PenMode::cut ? "C  cutting: on" : "C  cut: off"});
    p.line.push_back({mode == PenMode::coagulate ? Tone::bad : Tone::quiet,
                      mode == PenMode::coagulate ? "N  coagulating: on" : "N  coagulate: off"});
    p.line.push_back({Tone::quiet, "F7 F8  pedals: cut, coagulate"});
  }
  if (joins_clamped_ends(*v.scene)) p.line.push_back({Tone::quiet, "F4 F6  assistant: ends together, apart"});
  for (const std::string& text : tray_lines(*v.seen, *v.picture, k)) p.line.push_back({Tone::quiet, text});
  if (!v.pad.empty()) p.line.push_back({Tone::quiet, v.pad});
  return p;
}

Panel keys_panel(const UsedKeys& used) {
  Panel p{"keys", {}, 0, -1, 0, 1, 0, 0.5f};
  for (size_t k = 0; k < std::size(kKeys); ++k)
    if (!(used.bits & 1u << k)) p.line.push_back({Tone::quiet, kKeys[k].text});
  if (p.line.size() == 1) p.line.clear();  // all are known
  return p;
}

Panel log_panel(const WorkView& v) {
  Panel p{"log", {}, 0, -1, 1, 0, 0, 0.5f};
  for (const LogLine& l : *v.log)
    p.line.push_back(
        {l.bad ? Tone::bad : Tone::quiet, fmt::format("{:>7} {} {}", clock_text(l.time_s), l.bad ? '!' : ' ', tr(l.text))});
  return p;
}

// The newest lines of the log that fit; the others are in the results.
std::vector<Panel> shorter_logs(const Panel& log) {
  std::vector<Panel> out{log};
  for (const size_t n : {4u, 1u}) {
    if (log.line.size() <= n) continue;
    Panel p = log;
    p.line.erase(p.line.begin(), p.line.end() - static_cast<ptrdiff_t>(n));
    out.push_back(p);
  }
  return out;
}

// Distance of the bite from its target, as text and color.
Panel bite_panel(const BiteGuide& g, const Snapshot& seen) {
  const BiteView& bite = seen.active().bite.back();
  const Vec3 off = bite.entry - entry_of(g);
  const float aside = length(off - g.out * dot(off, g.out));
  const bool good = aside < kAside, deep_enough = std::abs(bite.depth - g.depth) < kDeep * g.depth + 0.0003f;
  const auto say = [](bool ok, const std::string& text) {
    return PanelLine{ok ? Tone::accent : Tone::bad, (ok ? "+ " : "! ") + text};
  };
  return {"bite",
          {say(good, fmt::format("entry {:.1f} mm from target", 1000 * aside)),
           say(deep_enough, fmt::format("depth {:.1f} mm, target {:.1f} mm", 1000 * bite.depth, 1000 * g.depth))},
          0,
          -1,
          1,
          0.5f,
          0,
          0.7f};
}

// Numbers of the moment, and remarks on the last stitch. A mark, not only a color, distinguishes good from bad.
Panel feedback_panel(const WorkView& v) {
  Panel p{"feedback", {}, 2, -1, 1, 0.5f, 46, 0.7f};
  if (v.cues)
    for (const assess::Cue& c : *v.cues) p.line.push_back({c.good ? Tone::accent : Tone::bad, (c.good ? "+ " : "! ") + c.text});
  if (v.remarks)
    for (const assess::Remark& r : *v.remarks) {
      if (v.seen->time_s - static_cast<double>(r.tick) / static_cast<double>(v.scene->solver.tick_rate) > kRemarkShown)
        continue;
      p.line.push_back({r.good ? Tone::accent : Tone::bad, (r.good ? "+ " : "! ") + r.text});
    }
  return p;
}

}  // namespace

void UsedKeys::note(const WindowInput& in) {
  for (size_t k = 0; k < std::size(kKeys); ++k)
    if (kKeys[k].used(in)) bits |= 1u << k;
}

Panel procedure_panel(const Procedure& procedure, const LiveStatus& status, const Snapshot& seen, Guidance guidance,
                      bool tutorial) {
  const ProcedureRun& run = status.procedure;
  const size_t n = procedure.stage.size();
  Panel p{"procedure", {}, 0, static_cast<float>(run.stage) / static_cast<float>(std::max<size_t>(1, n)), 0.5f, 1, 64, 0.8f};
  auto& line = p.line;
  if (guidance == Guidance::exam && !tutorial) {
    p.progress = -1;
    line = {{Tone::accent, "Exam: " + procedure.title}, {Tone::quiet, "F10: finish and see the results"}};
    p.keep = 1;
    return p;
  }
  if (finished(run, procedure)) {
    size_t well = 0;
    std::vector<std::string> again;
    for (const Feedback& f : feedback(run, procedure)) f.well ? void(++well) : again.push_back(f.text);
    line.push_back({Tone::accent, fmt::format("{}: complete. {} of {} stages done well", procedure.title, well, n)});
    for (size_t i = 0; i < again.size() && i < 3; ++i) line.push_back({Tone::bad, "! repeat: " + again[i]});
    if (again.size() > 3) line.push_back({Tone::bad, fmt::format("! and {} more", again.size() - 3)});
    line.push_back({Tone::quiet, "F10: results"});
    p.keep = 1;
    return p;
  }
  const ProcedureStage& s = procedure.stage[run.stage];
  line.push_back({Tone::accent, fmt::format("{} of {}  {}", run.stage + 1, n, s.title)});
  line.push_back({Tone::normal, s.text});
  p.keep = 2;
  if (status.demonstrating) {
    line.insert(line.begin() + 1, {Tone::bad, "Demonstration at half speed; it does not count. S: stop"});
    return p;
  }
  if (status.reading) line.insert(line.begin() + 1, {Tone::bad, "Time stands still. Enter or click: begin"}), p.keep = 3;
  // What became of the stages just before: none is left without a word.
  for (uint32_t k = run.stage;
       k-- > 0 && (run.record[k].state == StageState::met || run.record[k].state == StageState::skipped);) {
    const bool met = run.record[k].state == StageState::met;
    line.push_back(
        {met ? Tone::quiet : Tone::bad, fmt::format("{} {}: {}", k + 1, procedure.stage[k].title,
                                                    met ? "already reached" : "skipped. " + procedure.stage[k].skip_text)});
  }
  if (const std::string missing = guard_of(run, procedure); !missing.empty()) line.push_back({Tone::bad, "! " + missing});
  if (!run.error.empty()) {
    const ErrorNote& e = run.error.back();
    if (e.error < procedure.error.size() &&
        static_cast<double>(seen.tick - std::min(seen.tick, e.tick)) * run.tick_s < kErrorShown)
      line.push_back({Tone::bad, "! " + procedure.error[e.error].text + " " + procedure.error[e.error].why});
  }
  if (status.not_shown)
    line.push_back({Tone::bad, "No demonstration from here. Grasp the needle, or undo the bite (Backspace)."});
  if (const std::string hint = hint_of(run, procedure, seen); !hint.empty() && (tutorial || guidance == Guidance::learn))
    line.push_back({Tone::quiet, hint});
  if (!s.demo.empty() && tutorial) line.push_back({Tone::quiet, "S: demonstration"});
  return p;
}

std::vector<Panel> work_panels(const WorkText& work, const Settings& settings) {
  const WorkView& v = *work.view;
  const LiveStatus& s = *v.status;
  const bool silent = settings.guidance == Guidance::exam && !v.watching;
  const bool procedure = work.procedure && s.procedure.begun && !s.settling;
  std::vector<Panel> out;
  if (procedure) out.push_back(procedure_panel(*work.procedure, s, *v.seen, settings.guidance, work.tutorial));
  if (work.guide && v.seen->active().needle.in_tissue && !v.seen->active().bite.empty())
    out.push_back(bite_panel(*work.guide, *v.seen));
  if (!silent)
    if (Panel p = feedback_panel(v); !p.line.empty()) out.push_back(p);
  out.push_back(state_panel(v, settings, procedure));
  if (!v.watching && !s.settling && !v.inside) out.push_back(hand_panel(v, settings));
  if (!v.log->empty() && !silent)
    for (Panel& p : shorter_logs(log_panel(v))) out.push_back(p);  // the first that fits
  // A lesson names the keys that it needs.
  if (settings.hints && !v.watching && !v.inside && !s.settling && !work.tutorial) out.push_back(keys_panel(work.used));
  for (Panel& p : out)
    for (PanelLine& l : p.line) l.text = tr(l.text);
  return out;
}

}  // namespace catgut
