// SPDX-License-Identifier: Apache-2.0
// procedure: see measures.h. A new measure is one row here and one in docs/procedures.md.
#include "procedure/measures.h"

#include <fmt/format.h>

#include <algorithm>

#include "exchange/strand.h"
#include "procedure/manager.h"
#include "procedure/scene_fields.h"

namespace catgut {
namespace {

using Seen = const Snapshot&;
using Run = const ProcedureRun&;

double flag(bool on) { return on ? 1 : 0; }
double mm(float meters) { return 1000 * static_cast<double>(meters); }
constexpr double kNone = 1e9;  // a distance that does not exist

double worst_seam(Seen s, bool gap) {  // mm, or percent
  double worst = gap ? 0 : 100;
  bool any = false;
  for (const SutureView& suture : s.suture)
    for (const SeamView& m : suture.seam) {
      if (!m.midpoint) continue;
      any = true;
      worst = gap ? std::max(worst, mm(distance(m.a, m.b))) : std::min(worst, 100 * static_cast<double>(m.progress));
    }
  return any ? worst : gap ? kNone : 0;
}

double strand_from(Seen s, size_t a, size_t b) { return s.active().suture_point.empty() ? kNone : mm(length_between(s, a, b)); }

bool square(Seen s) {
  for (const KnotView& k : s.active().knot)
    if (k.throws >= 2 && k.phase == KnotPhase::locked) {
      const KnotThrow &a = k.thrown[k.throws - 2], &b = k.thrown[k.throws - 1];
      if (a.chirality != b.chirality) return true;
    }
  return false;
}

std::vector<Measure> table() {
  std::vector<Measure> rows = {
      {"bites", "", "completed bites so far", [](Seen, Run r) { return double{1} * r.bites; }},
      {"throws", "", "locked throws so far", [](Seen, Run r) { return double{1} * r.throws; }},
      {"square_knot", "0 or 1", "the last two throws of a knot have opposite chirality",
       [](Seen s, Run) { return flag(square(s)); }},
      {"needle_in_holder", "0 or 1", "the needle holder alone holds the needle",
       [](Seen s, Run) { return flag(s.tool[0].held == Held::needle && s.tool[1].held != Held::needle); }},
      {"needle_in_forceps", "0 or 1", "the forceps alone holds the needle",
       [](Seen s, Run) { return flag(s.tool[1].held == Held::needle && s.tool[0].held != Held::needle); }},
      {"needle_in_tissue", "0 or 1", "the needle is in tissue", [](Seen s, Run) { return flag(s.active().needle.in_tissue); }},
      {"needle_detached", "0 or 1", "the thread was cut off the needle",
       [](Seen s, Run) { return flag(!s.active().needle_on_thread); }},
      {"stitches_cut_off", "", "stitches whose thread is cut between its last hole and the needle",
       [](Seen s, Run) { return static_cast<double>(std::count_if(s.suture.begin(), s.suture.end(), is_cut_off)); }},
      {"holder_holds_thread", "0 or 1", "the needle holder holds thread",
       [](Seen s, Run) { return flag(s.tool[0].held == Held::thread); }},
      {"forceps_holds_thread", "0 or 1", "the forceps holds thread",
       [](Seen s, Run) { return flag(s.tool[1].held == Held::thread); }},
      {"tissue_held", "0 or 1", "an instrument holds tissue",
       [](Seen s, Run) {
         return flag(std::any_of(s.instrument.begin(), s.instrument.end(),
                                 [](const InstrumentView& i) { return i.held == Held::tissue; }));
       }},
      {"clamps_parked", "", "clamps closed on tissue without a hand",
       [](Seen s, Run) {
         return static_cast<double>(std::count_if(s.instrument.begin(), s.instrument.end(),
                                                  [](const InstrumentView& i) { return i.place == InstrumentPlace::parked; }));
       }},
      {"held_ends", "", "strands between the jaws of one instrument",
       [](Seen s, Run) {
         uint32_t most = 0;
         for (const ToolView& t : s.tool) most = std::max(most, t.held_strands);
         return double{1} * most;
       }},
      {"wraps", "", "turns of thread around an instrument",
       [](Seen s, Run) {
         uint32_t most = 0;
         for (const ToolView& t : s.tool) most = std::max(most, t.loop_wraps);
         return double{1} * most;
       }},
      {"throw_open", "0 or 1", "a throw was started and is not locked yet",
       [](Seen s, Run) { return flag(!s.active().knot.empty() && s.active().knot.back().phase == KnotPhase::tightening); }},
      {"tail_mm", "mm", "thread between the free end and the first bite",
       [](Seen s, Run) { return strand_from(s, 0, first_point_node(s)); }},
      {"strand_mm", "mm", "thread between the last bite and the needle",
       [](Seen s, Run) {
         return strand_from(s, last_point_node(s), s.active().thread_order.empty() ? 0 : s.active().thread_order.size() - 1);
       }},
      {"approximation", "%", "of the least approximated pair of stitch points: 0 apart, 100 together",
       [](Seen s, Run) { return worst_seam(s, false); }},
      {"gap_mm", "mm", "largest gap between stitch points that the suture approximates",
       [](Seen s, Run) { return worst_seam(s, true); }},
      {"opening", "%", "area of the opening, of that at the start",
       [](Seen s, Run r) { return r.opening_start > 0 ? 100 * static_cast<double>(s.opening_area / r.opening_start) : 100; }},
      {"pieces", "", "connected pieces of the tissue", [](Seen s, Run) { return double{1} * s.topology.pieces; }},
      {"bleeding", "", "vessels that bleed",
       [](Seen s, Run) {
         return static_cast<double>(
             std::count_if(s.wound.bleeding.begin(), s.wound.bleeding.end(), [](const BleedingView& b) { return b.flow > 0; }));
       }},
      {"freed_g", "g", "mass of the heaviest piece of tissue that came free; slivers of a cut weigh milligrams",
       [](Seen s, Run) { return 1e3 * static_cast<double>(s.wound.freed_mass); }},
      {"specimen_mm", "mm", "from where the heaviest piece came free to the nearest instrument that holds tissue; 0: none did",
       [](Seen s, Run) {
         if (s.wound.freed_mass == 0) return 0.0;
         double least = kNone;
         for (const InstrumentView& i : s.instrument)
           if (i.held == Held::tissue) least = std::min(least, mm(distance(i.pose.p, s.wound.freed_at)));
         return least;
       }},
      {"stitch_mm", "mm", "distance of the first and the last suture point of the suture in hand",
       [](Seen s, Run) {
         const auto& p = s.active().suture_point;
         return p.size() < 2 ? kNone : mm(distance(p.front().position, p.back().position));
       }},
      {"bite_mm", "mm", "length of the last bite, entry to exit", [](Seen, Run r) { return mm(r.bite_length); }},
      {"bite_depth_mm", "mm", "maximum depth of the last bite below the surface", [](Seen, Run r) { return mm(r.bite_depth); }},
      {"entry_angle", "degrees", "angle of the needle to the surface normal at the last entry",
       [](Seen, Run r) { return static_cast<double>(std::min(r.bite_angle, kPi - r.bite_angle)) * 180 / double{kPi}; }},
      {"peak_force_n", "N", "largest force on a hand in this stage",
       [](Seen, Run r) { return static_cast<double>(r.peak_force); }},
      {"peak_tension_n", "N", "largest tension of the thread in this stage",
       [](Seen, Run r) { return static_cast<double>(r.peak_tension); }},
      {"path_cm", "cm", "path of both tips in this stage", [](Seen, Run r) { return 100 * static_cast<double>(r.path); }},
      {"time_s", "s", "simulated time in this stage",
       [](Seen s, Run r) {
         const uint64_t from = r.stage < r.record.size() ? r.record[r.stage].from : s.tick;
         return static_cast<double>(s.tick - from) * r.tick_s;
       }},
  };
  const auto particle = [](EventKind k) {
    return k == EventKind::particle_attached || k == EventKind::particle_released || k == EventKind::particle_passed;
  };
  for (size_t k = 0; k < static_cast<size_t>(EventKind::count_); ++k) {
    const auto kind = static_cast<EventKind>(k);
    if (!particle(kind)) rows.push_back({event_name(kind), "", "these events in this stage", nullptr, kind, Fault::none});
  }
  for (size_t k = 1; k < static_cast<size_t>(Fault::count_); ++k) {
    const auto fault = static_cast<Fault>(k);
    rows.push_back({std::string("fault_") + fault_name(fault), "", "these faults of technique in this stage", nullptr,
                    EventKind::technique_fault, fault});
  }
  return rows;
}

}  // namespace

const std::vector<Measure>& measures() {
  static const std::vector<Measure> kRows = table();
  return kRows;
}

std::string measures_text() {
  std::string out = "Measures of goals, guards, hints and errors in procedures/NAME.toml; see docs/procedures.md\n";
  for (const Measure& m : measures())
    out += fmt::format("  {:<24} {}{}\n", m.name, m.meaning, m.unit.empty() ? "" : " [" + m.unit + "]");
  return out;
}

double measured(uint32_t measure, const Snapshot& seen, const ProcedureRun& run) {
  const Measure& m = measures()[measure];
  if (m.value) return m.value(seen, run);
  return m.fault != Fault::none ? run.faults[static_cast<size_t>(m.fault)] : run.events[static_cast<size_t>(m.event)];
}

bool hold(const Conditions& conditions, const Snapshot& seen, const ProcedureRun& run) {
  return std::all_of(conditions.begin(), conditions.end(), [&](const Condition& c) {
    const double v = measured(c.measure, seen, run);
    return v >= c.min && v <= c.max;
  });
}

std::string condition_text(const Condition& c, double value) {
  const Measure& m = measures()[c.measure];
  const std::string unit = m.unit.empty() || m.unit == "0 or 1" ? "" : " " + m.unit;
  std::string name = m.name;
  for (const char* suffix : {"_mm", "_cm", "_n", "_s"})
    if (name.ends_with(suffix)) name.erase(name.size() - std::string(suffix).size());
  std::replace(name.begin(), name.end(), '_', ' ');
  const Condition open;
  std::string want = fmt::format("{}", number_text(c.min));
  if (c.min == open.min) want = fmt::format("at most {}", number_text(c.max));
  else if (c.max == open.max) want = fmt::format("at least {}", number_text(c.min));
  else if (c.min != c.max) want = fmt::format("{} to {}", number_text(c.min), number_text(c.max));
  return fmt::format("{} {:.{}f}{} ({})", name, value, value == static_cast<int64_t>(value) ? 0 : 1, unit, want);
}

}  // namespace catgut
