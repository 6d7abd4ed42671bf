// app/window: see words.h.
#include "window/words.h"

#include <fmt/format.h>

#include <algorithm>

namespace catgut {
namespace {

const char* tool_name(uint8_t who) { return who == 0 ? "needle driver" : "forceps"; }

std::string fault_words(Fault fault) {
  switch (fault) {
    case Fault::wrong_body:
      return "the bite belongs on the other side";
    case Fault::wrong_layer:
      return "the bite goes the wrong way through the wall";
    case Fault::one_wall_only:
      return "tied through one wall only";
    case Fault::knot_without_bite:
      return "a knot before the bites were complete";
    case Fault::needle_in_tissue:
      return "pulled with the needle still in the tissue";
    case Fault::cut_in_stitch:
      return "cut inside the stitch: it is open";
    case Fault::cut_before_knot:
      return "cut before anything was tied";
    case Fault::too_few_throws:
      return "too few throws to hold";
    default:
      return fault_name(fault);
  }
}

}  // namespace

std::string words_for(const Event& e, bool& bad) {
  bad = false;
  const char* tool = tool_name(e.who);
  const auto lost = [&](const char* what) {
    bad = e.value > 0;
    return bad ? fmt::format("the {} slipped out of the {} ({:.1f} N)", what, tool, e.value)
               : fmt::format("{}: {} let go", tool, what);
  };
  switch (e.kind) {
    case EventKind::needle_grasped:
      return fmt::format("{}: needle, {:.0f} % from its back end", tool, 100 * e.value);
    case EventKind::needle_released:
      return lost("needle");
    case EventKind::thread_grasped:
      return fmt::format("{}: thread", tool);
    case EventKind::thread_released:
      return lost("thread");
    case EventKind::tissue_grasped:
      return fmt::format("{}: tissue", tool);
    case EventKind::tissue_released:
      return lost("tissue");
    case EventKind::tip_entered:
      return fmt::format("the needle goes in, {:.0f} degrees off upright", e.value * 180 / kPi);
    case EventKind::tip_exited:
      return "the tip is out";
    case EventKind::bite_cancelled:
      return "the needle was drawn back";
    case EventKind::bite_completed:
      return fmt::format("bite {} done, {:.1f} mm", e.which + 1, 1000 * e.value);
    case EventKind::order_broken:
      bad = true;
      return "this bite is not next to the one before";
    case EventKind::ring_complete:
      return fmt::format("the ring is complete: {} points", e.which);
    case EventKind::closure_started:
      return "the opening begins to close";
    case EventKind::closure_finished:
      return "the opening is closed";
    case EventKind::thread_ran_out:
      bad = true;
      return "the thread has run out";
    case EventKind::loop_formed:
      return fmt::format("a loop of {} round the {}", e.which, tool);
    case EventKind::loop_rejected:
      return fmt::format("no loop: {}", loop_reason_name(static_cast<LoopReason>(e.which)));
    case EventKind::knot_begun:
      return fmt::format("a throw is begun ({} wraps)", e.value);
    case EventKind::knot_locked:
      return fmt::format("the throw is set, {:.1f} N", e.value);
    case EventKind::knot_cancelled:
      bad = true;
      return "the throw came undone";
    case EventKind::thread_cut:
      return "the thread is cut";
    case EventKind::suture_taken:
      return "a fresh needle and thread";
    case EventKind::stitch_settled:
      return "the stitch is finished";
    case EventKind::seam_closed:
      return fmt::format("the edges are together, {:.1f} mm left", 1000 * e.value);
    case EventKind::technique_fault:
      bad = true;
      return fault_words(static_cast<Fault>(e.value));
    default:
      return "";
  }
}

std::vector<std::string> technique_lines(const SceneSpec& scene, const Snapshot& seen, const Practice& practice) {
  std::vector<std::string> lines;
  const std::string& name = scene.technique.name;
  if (name == "purse_string") {
    lines.push_back(fmt::format("bites {} of {}", practice.bites, scene.technique.min_bites));
    if (practice.opening_start > 0)
      lines.push_back(fmt::format("opening {:.0f} %", 100 * practice.opening / practice.opening_start));
  } else {
    lines.push_back(fmt::format("bites {}", practice.bites));
  }
  if (!seen.seam.empty()) {
    float worst = 1;
    for (const SeamView& s : seen.seam) worst = std::min(worst, s.progress);
    lines.push_back(fmt::format("edges together {:.0f} %", 100 * worst));
  }
  if (practice.throws > 0) lines.push_back(fmt::format("knots {}, throws {}", practice.knots, practice.throws));
  if (practice.faults_in_all > 0) lines.push_back(fmt::format("faults {}", practice.faults_in_all));
  if (seen.needle.in_tissue) lines.push_back(fmt::format("bite {}: the needle is in", seen.needle.bite + 1));
  for (size_t k = 0; k < 2; ++k) {
    static constexpr const char* kHeld[] = {"nothing", "needle", "thread", "tissue"};
    const ToolView& tool = seen.tool[k];
    if (tool.held != Held::nothing || tool.loop_wraps > 0)
      lines.push_back(
          fmt::format("{}: {}{}, {:.1f} N", tool_name(static_cast<uint8_t>(k)), kHeld[static_cast<size_t>(tool.held)],
                      tool.loop_wraps > 0 ? fmt::format(" and {} wraps", tool.loop_wraps) : "", length(tool.force)));
  }
  return lines;
}

std::vector<ResultRow> result_rows(const SceneSpec& scene, const Practice& p) {
  std::vector<ResultRow> rows;
  const int seconds = static_cast<int>(p.time_s);
  rows.push_back({"time", fmt::format("{}:{:02}", seconds / 60, seconds % 60)});
  rows.push_back({"bites", scene.technique.name == "purse_string"
                               ? fmt::format("{} (at least {} are wanted)", p.bites, scene.technique.min_bites)
                               : fmt::format("{}", p.bites)});
  rows.push_back({"needle drawn back", fmt::format("{}", p.bites_cancelled)});
  if (p.opening_start > 0 && scene.technique.name == "purse_string")
    rows.push_back({"opening left", fmt::format("{:.0f} %", 100 * p.opening / p.opening_start)});
  rows.push_back({"knots, throws", fmt::format("{}, {}", p.knots, p.throws)});
  rows.push_back({"cuts", fmt::format("{}", p.cuts)});
  rows.push_back({"stitches finished", fmt::format("{}", p.stitches_settled)});
  rows.push_back({"needle slipped", fmt::format("{}", p.needle_slips)});
  rows.push_back({"way of the tools", fmt::format("driver {:.2f} m, forceps {:.2f} m", static_cast<double>(p.path[0]),
                                                  static_cast<double>(p.path[1]))});
  rows.push_back({"most force", fmt::format("driver {:.1f} N, forceps {:.1f} N", static_cast<double>(p.most_force[0]),
                                            static_cast<double>(p.most_force[1]))});
  rows.push_back({"taken back", fmt::format("{}", p.taken_back)});
  for (size_t f = 1; f < p.faults.size(); ++f)
    if (p.faults[f] > 0) rows.push_back({"fault", fmt::format("{} x {}", p.faults[f], fault_words(static_cast<Fault>(f)))});
  return rows;
}

std::string event_json(const Event& e) {
  return fmt::format(R"({{"tick":{},"event":"{}","who":{},"which":{},"value":{:.6g},"where":[{:.5f},{:.5f},{:.5f}]}})", e.tick,
                     event_name(e.kind), e.who, e.which, e.value, e.where.x, e.where.y, e.where.z);
}

}  // namespace catgut
