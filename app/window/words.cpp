// SPDX-License-Identifier: Apache-2.0
// app/window: see words.h.
#include "window/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "device/tray.h"
#include "technique/technique.h"

namespace catgut {
namespace {

const char* tool_name(uint8_t hand) {
  constexpr const char* kName[kMaxHands] = {"needle holder", "forceps", "assistant right", "assistant left"};
  return hand < kMaxHands ? kName[hand] : "parked clamp";
}

bool closes_opening(const SceneSpec& scene) {
  const TechniqueRow* row = find_technique(scene.technique.name);
  return row && row->closes_opening;
}

std::string counted(int n, const char* one) { return fmt::format("{} {}{}", n, one, n == 1 ? "" : "s"); }

std::string fault_words(Fault fault) {
  switch (fault) {
    case Fault::wrong_body:
      return "wrong side";
    case Fault::wrong_layer:
      return "wrong bite direction";
    case Fault::one_wall_only:
      return "only one wall tied";
    case Fault::knot_without_bite:
      return "throw before bites";
    case Fault::needle_in_tissue:
      return "needle still in tissue";
    case Fault::cut_in_stitch:
      return "stitch cut";
    case Fault::cut_before_knot:
      return "cut before knot";
    case Fault::too_few_throws:
      return "too few throws";
    case Fault::cut_off_line:
      return "cut off the line";
    case Fault::pulled_attached:
      return "pulled while still attached";
    case Fault::cut_at_suture:
      return "wall cut at a suture";
    case Fault::bite_in_char:
      return "bite in charred tissue";
    case Fault::inner_wall_cut:
      return "inner wall cut";
    case Fault::clamp_torn_out:
      return "clamp torn out";
    case Fault::bite_torn:
      return "thread or needle tears the wall";
    case Fault::bite_torn_out:
      return "bite torn out";
    case Fault::thread_broken:
      return "thread broken";
    case Fault::needle_torn_out:
      return "needle torn out of the wall";
    default:
      return fault_name(fault);
  }
}

std::string loop_words(LoopReason reason) {
  switch (reason) {
    case LoopReason::no_crossing:
      return "no loop: no crossing";
    case LoopReason::tip_outside:
      return "no loop: tip outside";
    case LoopReason::too_deep:
      return "no loop: turns apart";
    default:
      return "no loop";
  }
}

}  // namespace

std::string clock_text(double seconds) {
  const int tenths = static_cast<int>(std::lround(10 * std::max(0.0, seconds)));
  return fmt::format("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10);
}

std::string words_for(const Event& e, bool& bad) {
  bad = false;
  const char* tool = tool_name(e.who);
  const auto released = [&](const char* what) {
    bad = e.value > 0;
    return bad ? fmt::format("{} slipped from {} at {:.1f} N", what, tool, e.value)
               : fmt::format("{} released by {}", what, tool);
  };
  switch (e.kind) {
    case EventKind::needle_grasped:
      return fmt::format("needle grasped by {}, at {:.0f} %", tool, 100 * e.value);
    case EventKind::needle_released:
      return released("needle");
    case EventKind::thread_grasped:
      return fmt::format("thread grasped by {}", tool);
    case EventKind::thread_released:
      return released("thread");
    case EventKind::tissue_grasped:
      return fmt::format("tissue grasped by {}", tool);
    case EventKind::tissue_released:
      return released("tissue");
    case EventKind::tip_entered:  // a tip entered by moving tissue enters backward: use the line, not its sense
      return fmt::format("needle entered, {:.0f}\u00b0 from surface normal", std::min(e.value, kPi - e.value) * 180 / kPi);
    case EventKind::tip_exited:
      return "needle tip exited";
    case EventKind::bite_withdrawn:
      return "needle withdrawn";
    case EventKind::bite_completed:
      return fmt::format("bite completed, {:.1f} mm", 1000 * e.value);
    case EventKind::bite_out_of_order:
      bad = true;
      return "bite out of order";
    case EventKind::ring_complete:
      return fmt::format("ring complete, {} suture points", e.which);
    case EventKind::closure_started:
      return "closure started";
    case EventKind::closure_finished:
      return "closure complete";
    case EventKind::thread_exhausted:
      bad = true;
      return "thread exhausted";
    case EventKind::loop_formed:
      return fmt::format("{} on {}", counted(static_cast<int>(e.which), "wrap"), tool);
    case EventKind::loop_rejected:
      return loop_words(e.reason);
    case EventKind::throw_started:
      return fmt::format("throw started, {}", counted(static_cast<int>(std::lround(e.value)), "wrap"));
    case EventKind::throw_locked:
      return fmt::format("throw locked at {:.1f} N", e.value);
    case EventKind::throw_undone:
      bad = true;
      return "throw undone";
    case EventKind::thread_cut:
      return "thread cut";
    case EventKind::suture_loaded:
      return "new suture loaded";
    case EventKind::suture_baked:
      return "suture finished";
    case EventKind::seam_closed:
      return fmt::format("edges approximated, gap {:.1f} mm", 1000 * e.value);
    case EventKind::instrument_taken:
      return "instrument taken";
    case EventKind::instrument_laid_down:
      return "instrument laid down";
    case EventKind::instrument_parked:
      return "clamp parked";
    case EventKind::instrument_refused:
      bad = true;
      return e.value > 0 ? "no room beside the parked clamp: move the hand away first" : "instrument unavailable";
    case EventKind::technique_fault:
      bad = true;
      return fault_words(e.fault);
    case EventKind::pen_activated:
      return fmt::format("pen on, {:.0f} W", e.value);
    case EventKind::pen_deactivated:
      return fmt::format("pen off after {:.1f} s", e.value);
    case EventKind::wall_scored:
      return fmt::format("wall scored {:.1f} mm deep, not cut through", 1000 * e.value);
    case EventKind::wall_cut_through:
      return e.value < 0 ? "wall cut through" : fmt::format("wall cut through, {:.1f} mm from the line", 1000 * e.value);
    case EventKind::piece_freed:
      return fmt::format("specimen free, {:.1f} g", 1000 * e.value);
    case EventKind::tissue_snipped:
      return fmt::format("tissue cut over {:.0f} mm", 1000 * e.value);
    case EventKind::bleeding_started:
      bad = true;
      return fmt::format("bleeding, {:.1f} ml/min", 6e7 * static_cast<double>(e.value));
    case EventKind::bleeding_stopped:
      return "bleeding stopped";
    default:
      return "";
  }
}

bool repeated_exit(const std::vector<Event>& events, size_t i) {
  const Event& e = events[i];
  if (e.kind != EventKind::tip_exited) return false;
  while (i-- > 0) {
    const Event& o = events[i];
    if (o.suture != e.suture) continue;
    if (o.kind == EventKind::tip_entered) return false;
    if (o.kind == EventKind::tip_exited) return o.which == e.which;
  }
  return false;
}

std::vector<std::string> technique_lines(const SceneSpec& scene, const Snapshot& seen, const SessionMetrics& metrics) {
  std::vector<std::string> lines;
  if (closes_opening(scene)) {
    lines.push_back(fmt::format("bites {} of {}", metrics.bites, scene.technique.min_bites));
    if (metrics.opening_start > 0)
      lines.push_back(fmt::format("opening {:.0f} %", 100 * metrics.opening / metrics.opening_start));
  } else {
    lines.push_back(fmt::format("bites {}", metrics.bites));
  }
  if (!seen.active().seam.empty()) {
    float worst = 1;
    for (const SeamView& s : seen.active().seam) worst = std::min(worst, s.progress);
    lines.push_back(fmt::format("approximation {:.0f} %", 100 * worst));
  }
  if (metrics.throws > 0) lines.push_back(fmt::format("knots {}, throws {}", metrics.knots, metrics.throws));
  if (const uint32_t faults = metrics.faults_in_all + metrics.overloads; faults > 0)
    lines.push_back(fmt::format("faults {}", faults));
  if (seen.active().needle.in_tissue) lines.push_back(fmt::format("bite {}: needle in tissue", metrics.bites + 1));
  for (size_t k = 0; k < kMaxHands; ++k) {
    static constexpr const char* kHeld[] = {"", "needle", "thread", "tissue"};
    const ToolView& tool = seen.tool[k];
    if (tool.held == Held::nothing && tool.loop_wraps == 0) continue;
    std::string what = kHeld[static_cast<size_t>(tool.held)];
    if (tool.loop_wraps > 0) what += (what.empty() ? "" : ", ") + counted(static_cast<int>(tool.loop_wraps), "wrap");
    lines.push_back(fmt::format("{}: {}, {:.1f} N", tool_name(static_cast<uint8_t>(k)), what, length(tool.force)));
  }
  return lines;
}

bool joins_clamped_ends(const SceneSpec& scene) {
  const auto clamped =
      std::count_if(scene.body.begin(), scene.body.end(), [](const BodySpec& b) { return b.pinned_length > 0; });
  return scene.mechanics.kind == "physical" && clamped > 1;
}

std::vector<std::string> tray_lines(const Snapshot& seen, const PictureModel& picture, size_t hand) {
  std::vector<std::string> lines;
  const Command next = next_from_tray(seen, hand), park = park_or_take_up(seen, hand);
  const auto title = [&](size_t i) { return picture.instrument[i].title; };
  if (next.kind != CommandKind::none) lines = {"tray", "I  " + title(next.argument)};
  for (size_t i = 0; i < seen.instrument.size(); ++i)
    if (seen.instrument[i].place == InstrumentPlace::tray && i != next.argument) lines.push_back("   " + title(i));
  const bool clamps = park.kind == CommandKind::park && picture.instrument[park.argument].can(kClamp);
  if (park.kind == CommandKind::unpark) lines.push_back("K  take up " + title(park.argument));
  if (clamps && seen.tool[hand].held != Held::nothing) lines.push_back("K  park " + title(park.argument));
  if (park.kind == CommandKind::lay_down) lines.push_back("K  lay down " + title(park.argument));
  return lines;
}

std::vector<ResultRow> result_rows(const SceneSpec& scene, const SessionMetrics& p) {
  std::vector<ResultRow> rows;
  const bool opening = closes_opening(scene);
  rows.push_back({"time", clock_text(p.time_s)});
  rows.push_back(
      {"bites", opening ? fmt::format("{} (minimum {})", p.bites, scene.technique.min_bites) : fmt::format("{}", p.bites)});
  rows.push_back({"needle withdrawals", fmt::format("{}", p.bites_withdrawn)});
  if (p.opening_start > 0 && opening)
    rows.push_back({"residual opening", fmt::format("{:.0f} %", 100 * p.opening / p.opening_start)});
  rows.push_back({"knots, throws", fmt::format("{}, {}", p.knots, p.throws)});
  rows.push_back({"cuts", fmt::format("{}", p.cuts)});
  rows.push_back({"finished sutures", fmt::format("{}", p.sutures_baked)});
  rows.push_back({"needle slips", fmt::format("{}", p.needle_slips)});
  if (p.thread_slips + p.tissue_slips > 0)
    rows.push_back({"thread, tissue slips", fmt::format("{}, {}", p.thread_slips, p.tissue_slips)});
  rows.push_back({"peak thread tension", fmt::format("{:.1f} N", p.peak_tension)});
  for (uint8_t hand = 0; hand < kMaxHands; ++hand) {
    if (hand > 1 && p.path[hand] == 0) continue;  // an assistant who did nothing
    rows.push_back({fmt::format("{} path", tool_name(hand)), fmt::format("{:.2f} m", p.path[hand])});
    rows.push_back({fmt::format("{} peak force", tool_name(hand)), fmt::format("{:.1f} N", p.peak_force[hand])});
    if (p.peak_rendered[hand] >= 0) rows.back().value += fmt::format(", rendered {:.1f} N", p.peak_rendered[hand]);
  }
  rows.push_back({"undos", fmt::format("{}", p.undos)});
  for (size_t f = 1; f < p.faults.size(); ++f)
    if (p.faults[f] > 0) rows.push_back({"fault", fmt::format("{} x {}", p.faults[f], fault_words(static_cast<Fault>(f)))});
  if (p.overloads > 0) rows.push_back({"fault", fmt::format("{} x pull above what bowel bears (3.2 N)", p.overloads)});
  return rows;
}

std::string event_json(const Event& e) {
  std::string why;
  if (e.fault != Fault::none) why = fmt::format(R"("fault":"{}",)", fault_name(e.fault));
  if (e.reason != LoopReason::none) why += fmt::format(R"("reason":"{}",)", loop_reason_name(e.reason));
  return fmt::format(R"({{"tick":{},"event":"{}","who":{},"which":{},"value":{:.6g},{}"where":[{:.5f},{:.5f},{:.5f}]}})",
                     e.tick, event_name(e.kind), e.who, e.which, e.value, why, e.where.x, e.where.y, e.where.z);
}

}  // namespace catgut
