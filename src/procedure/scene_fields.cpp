// SPDX-License-Identifier: Apache-2.0
// procedure: the table of scene keys. Reads sim/scene.h's defaults; writes nothing.
#include "procedure/scene_fields.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "exchange/event.h"
#include "surgeon/plan.h"
#include "technique/technique.h"
#include "thread/material.h"

namespace catgut {
namespace {

// "|purse_string|...|running"
std::string plan_choices() {
  std::string all;
  for (const char* name : plan_names()) all += std::string("|") + name;
  return all;
}

// "silk 4-0|silk 3-0|..."
std::string material_choices() {
  std::string all;
  for (const thread::Properties& p : thread::materials()) all += (all.empty() ? "" : "|") + std::string(p.name);
  return all;
}

constexpr double kAny = 1e30;  // no meaningful bound
#define TOP(member) [](SceneSpec& s, size_t) -> FieldRef { return &s.member; }
#define BODY(member) [](SceneSpec& s, size_t i) -> FieldRef { return &s.body[i].member; }
#define INSTRUMENT(member) [](SceneSpec& s, size_t i) -> FieldRef { return &s.instrument[i].member; }
#define SUTURE(member) [](SceneSpec& s, size_t i) -> FieldRef { return &s.suture[i].member; }

// clang-format off
const Field kField[] = {
    {"", "name", "", 0, 0, nullptr, "short name in reports; the file's own name when left out", TOP(name)},
    {"", "title", "", 0, 0, nullptr, "title on screens and in reports", TOP(title)},
    {"", "seed", "", 0, 9.2e18, nullptr, "random seed of tremor and aim", TOP(seed)},
    {"", "duration", "s", 0.001, 1e5, nullptr, "maximum simulated time; a run ends earlier when the surgeon is done", TOP(duration)},
    {"", "settle", "s", 0, 1000, nullptr, "simulated time before the hands connect", TOP(settle)},
    {"", "surroundings", "", 0, 0, "table|perineum", "what is drawn round the organ; perineum: the first body comes through the anal verge of a patient in lithotomy", TOP(surroundings)},

    {"body", "name", "", 0, 0, nullptr, "name of the body in messages", BODY(name)},
    {"body", "kind", "", 0, 0, "tube|pad", "tube: a piece of bowel. pad: one lip of a slit in flat skin, its edge 2 x radius long", BODY(kind)},
    {"body", "mesh", "", 0, 0, nullptr, "organ surface to import, file or file#node, relative to the scene file; empty: generated tube", BODY(mesh)},
    {"body", "particles", "", 1, 200000, nullptr, "exact number of particles", BODY(particles)},
    {"body", "radius", "m", 0.001, 1, nullptr, "outer radius of the tube", BODY(radius)},
    {"body", "length", "m", 0.001, 2, nullptr, "length of the tube", BODY(length)},
    {"body", "wall", "m", 0.0001, 0.1, nullptr, "thickness of the wall", BODY(wall)},
    {"body", "closed_start", "", 0, 0, nullptr, "close the far end by a cap", BODY(closed_start)},
    {"body", "closed_end", "", 0, 0, nullptr, "close the near end, where the procedure works, by a cap", BODY(closed_end)},
    {"body", "haustra", "m", 0, 0.05, nullptr, "depth of the sacculations; they fade out toward an open rim", BODY(haustra)},
    {"body", "taeniae", "", 0, 16, nullptr, "longitudinal bands", BODY(taeniae)},
    {"body", "position", "m", -1, 1, nullptr, "center of the near end", BODY(position)},
    {"body", "axis", "", -1, 1, nullptr, "direction of the near end", BODY(axis)},
    {"body", "density", "kg/m^3", 1, 20000, nullptr, "tissue density", BODY(density)},
    {"body", "pinned_length", "m", 0, 2, nullptr, "fixed length at the far end", BODY(pinned_length)},
    {"body", "modulus_along", "Pa", 1000, 1e9, nullptr, "physical mechanics: Young's modulus of the wall along the organ", BODY(modulus_along)},
    {"body", "modulus_around", "Pa", 1000, 1e9, nullptr, "physical mechanics: Young's modulus of the wall around the organ", BODY(modulus_around)},
    {"body", "stiff_along", "Pa", 0, 1e9, nullptr, "physical mechanics: Young's modulus along the organ beyond the strain `knee`, where its fibers are straight; 0: the same as before", BODY(stiff_along)},
    {"body", "stiff_around", "Pa", 0, 1e9, nullptr, "physical mechanics: the same around the organ", BODY(stiff_around)},
    {"body", "knee", "", 0.01, 2, nullptr, "physical mechanics: strain from which `stiff_along` and `stiff_around` are added", BODY(knee)},
    {"body", "poisson", "", 0, 0.49, nullptr, "physical mechanics: Poisson's ratio of the wall, contraction around when stretched along", BODY(poisson)},
    {"body", "foundation", "Pa/m", 0, 1e9, nullptr, "physical mechanics: an elastic bed under the wall, its modulus over its thickness; 0: none", BODY(foundation)},
    {"body", "inner_radius", "m", 0, 1, nullptr, "outer radius of a second tube inside the first, as in a prolapse; 0: none", BODY(inner_radius)},
    {"body", "folded", "", 0, 0, nullptr, "the two tubes are one wall, folded at the near end: a prolapse before it is cut", BODY(folded)},

    {"instrument", "name", "", 0, 0, nullptr, "name in this scene; empty: that of its kind", INSTRUMENT(name)},
    {"instrument", "kind", "", 0, 0, nullptr, "needle_holder, forceps, debakey, allis, scissors, cautery, retractor, swab, or a kind of the host program", INSTRUMENT(kind)},
    {"instrument", "where", "", 0, 0, "tray|right|left|assistant_right|assistant_left|parked", "on the tray, in a hand, or (a clamp) closed on tissue without a hand", INSTRUMENT(where)},
    {"instrument", "at", "m", -1, 1, nullptr, "parked: point whose nearest tissue surface is held", INSTRUMENT(at)},
    {"instrument", "pull", "N", -100, 100, nullptr, "parked: traction force instead of the weight; zero: the weight", INSTRUMENT(pull)},
    {"instrument", "stretch", "m", 0, 1, nullptr, "parked: `pull` is that of an elastic cord, which is slack when the instrument has gone so far with it from where it was parked; 0: the pull is constant", INSTRUMENT(stretch)},

    {"thread", "particles", "", 2, 10000, nullptr, "thread particles from the free end to the needle", TOP(thread.particles)},
    {"thread", "spacing", "m", 0.0001, 0.1, nullptr, "rest distance of neighboring particles", TOP(thread.spacing)},
    {"thread", "radius", "m", 0.00001, 0.01, nullptr, "thread radius", TOP(thread.radius)},
    {"thread", "mass", "kg", 1e-9, 0.01, nullptr, "per particle", TOP(thread.mass)},
    {"thread", "stretch_compliance", "m/N", 0, 1, nullptr, "per segment; 0: inextensible", TOP(thread.stretch_compliance)},
    {"thread", "material", "", 0, 0, &material_choices, "physical mechanics: suture material and size, with its diameter, stiffness, friction and strength", TOP(thread.material)},

    {"needle", "radius", "m", 0.0005, 0.1, nullptr, "radius of the needle's circle", TOP(needle.radius)},
    {"needle", "arc", "rad", 0.1, 6.2, nullptr, "angle from swage to tip", TOP(needle.arc)},
    {"needle", "wire_radius", "m", 0.00001, 0.01, nullptr, "radius of the wire", TOP(needle.wire_radius)},
    {"needle", "mass", "kg", 1e-7, 0.1, nullptr, "needle mass", TOP(needle.mass)},

    {"suture", "thread.particles", "", 2, 10000, nullptr, "thread particles from the free end to the needle", SUTURE(thread.particles)},
    {"suture", "thread.spacing", "m", 0.0001, 0.1, nullptr, "rest distance of neighboring particles", SUTURE(thread.spacing)},
    {"suture", "thread.radius", "m", 0.00001, 0.01, nullptr, "thread radius", SUTURE(thread.radius)},
    {"suture", "thread.mass", "kg", 1e-9, 0.01, nullptr, "per particle", SUTURE(thread.mass)},
    {"suture", "thread.stretch_compliance", "m/N", 0, 1, nullptr, "per segment; 0: inextensible", SUTURE(thread.stretch_compliance)},
    {"suture", "thread.material", "", 0, 0, &material_choices, "physical mechanics: suture material and size", SUTURE(thread.material)},
    {"suture", "needle.radius", "m", 0.0005, 0.1, nullptr, "radius of the needle's circle", SUTURE(needle.radius)},
    {"suture", "needle.arc", "rad", 0.1, 6.2, nullptr, "angle from swage to tip", SUTURE(needle.arc)},
    {"suture", "needle.wire_radius", "m", 0.00001, 0.01, nullptr, "radius of the wire", SUTURE(needle.wire_radius)},
    {"suture", "needle.mass", "kg", 1e-7, 0.1, nullptr, "needle mass", SUTURE(needle.mass)},

    {"solver", "preset", "", 0, 0, "default|paper", "sets all other keys of [solver]; keys in the same section override it. paper: section 2.1 of the paper", TOP(solver.preset)},
    {"solver", "tick_rate", "1/s", 1, 10000, nullptr, "ticks per second", TOP(solver.tick_rate)},
    {"solver", "substeps", "", 1, 1000, nullptr, "per tick", TOP(solver.substeps)},
    {"solver", "shape_sweeps", "", 0, 100, nullptr, "shape matching sweeps per substep", TOP(solver.shape_sweeps)},
    {"solver", "shape_stiffness", "", 0, 1, nullptr, "deformation resistance of the paper, per sweep", TOP(solver.shape_stiffness)},
    {"solver", "shape_relaxation", "", 0.01, 2, nullptr, "over-relaxation of the averaged goals; stiffness times relaxation must stay below 2", TOP(solver.shape_relaxation)},
    {"solver", "distance_sweeps", "", 0, 100, nullptr, "distance sweeps per substep", TOP(solver.distance_sweeps)},
    {"solver", "bend_sweeps", "", 0, 100, nullptr, "bending sweeps per substep", TOP(solver.bend_sweeps)},
    {"solver", "bend_compliance", "1/J", 0, 1e12, nullptr, "bending compliance of the thread, cosine form", TOP(solver.bend_compliance)},
    {"solver", "self_contact_sweeps", "", 0, 100, nullptr, "tissue self-contact sweeps per substep", TOP(solver.self_contact_sweeps)},
    {"solver", "contact_sweeps", "", 0, 100, nullptr, "contact sweeps of instruments, thread and needle per substep", TOP(solver.contact_sweeps)},
    {"solver", "thread_direct", "", 0, 0, nullptr, "direct solve along the thread before the distance sweeps", TOP(solver.thread_direct)},
    {"solver", "volume", "", 0, 0, nullptr, "tetrahedral volume constraints in the wall", TOP(solver.volume)},
    {"solver", "volume_compliance", "m^6/J", 0, 1e12, nullptr, "compliance of the volume constraints; 0: incompressible", TOP(solver.volume_compliance)},
    {"solver", "damping", "1/s", 0, 10000, nullptr, "damping of tissue velocity", TOP(solver.damping)},
    {"solver", "thread_damping", "1/s", 0, 10000, nullptr, "damping of thread velocity", TOP(solver.thread_damping)},
    {"solver", "gravity", "m/s^2", -1000, 1000, nullptr, "gravity; y is up", TOP(solver.gravity)},
    {"solver", "mass_scale", "", 1, 10000, nullptr, "scales tissue inertia at constant weight, and with it the tissue's reaction force", TOP(solver.mass_scale)},
    {"solver", "friction_tissue", "", 0, 10, nullptr, "Coulomb friction coefficient, tissue on tissue", TOP(solver.friction_tissue)},
    {"solver", "friction_tool", "", 0, 10, nullptr, "Coulomb friction coefficient, instrument on tissue and on instrument", TOP(solver.friction_tool)},
    {"solver", "friction_thread", "", 0, 10, nullptr, "Coulomb friction coefficient, thread on tissue and on thread", TOP(solver.friction_thread)},
    {"solver", "hand_stiffness", "N/m", 1, 100000, nullptr, "stiffness of the coupling between hand and instrument; a haptic device renders about 300", TOP(solver.hand_stiffness)},
    {"solver", "tool_force", "N", 0, 1000, nullptr, "maximum contact force between two instruments; above it they pass each other (mouse: at most 1.5)", TOP(solver.tool_force)},

    {"mechanics", "kind", "", 0, 0, "guided|physical", "guided: the paper's technique closes the wound. physical: a wall with a modulus, a thread that knots itself", TOP(mechanics.kind)},
    {"mechanics", "attach_threshold", "m", 0, 0.1, nullptr, "maximum distance of an attached particle from the needle tip (X of figure 4)", TOP(mechanics.attach_threshold)},
    {"mechanics", "release_distance", "m", 0, 0.1, nullptr, "drag distance at which the attached particle is released (figure 5)", TOP(mechanics.release_distance)},
    {"mechanics", "attach_compliance", "m/N", 0, 1000, nullptr, "compliance of that attachment", TOP(mechanics.attach_compliance)},
    {"mechanics", "track_compliance", "m/N", 0, 1000, nullptr, "lateral compliance of the needle track", TOP(mechanics.track_compliance)},
    {"mechanics", "pass_tension", "N", 0, 1000, nullptr, "tension difference above which thread slides through a suture point", TOP(mechanics.pass_tension)},
    {"mechanics", "capstan_friction", "", 0, 10, nullptr, "capstan friction: increase of pass_tension per newton of tension, friction coefficient times bending angle", TOP(mechanics.capstan_friction)},
    {"mechanics", "collision_off", "", 0, 100, nullptr, "thread particles without collision on each side of a locked one", TOP(mechanics.collision_off)},
    {"mechanics", "grasp_reach", "m", 0, 0.1, nullptr, "maximum distance at which a closing jaw grasps needle or thread", TOP(mechanics.grasp_reach)},

    {"technique", "name", "", 0, 0, &technique_choices, "suturing technique", TOP(technique.name)},
    {"technique", "anvil", "m", -1, 1, nullptr, "focal point of the closure, relative to the center of the rim", TOP(technique.anvil)},
    {"technique", "anvil_radius", "m", 0, 0.1, nullptr, "radius of the closed rim", TOP(technique.anvil_radius)},
    {"technique", "closure_compliance", "m/N", 0, 1000, nullptr, "compliance of the closing pull toward the anvil", TOP(technique.closure_compliance)},
    {"technique", "min_bites", "", 0, 1000, nullptr, "minimum bites before closure", TOP(technique.min_bites)},
    {"technique", "closed_gap", "m", 0, 0.1, nullptr, "final gap between two approximated points", TOP(technique.closed_gap)},
    {"technique", "step", "m", 0.0001, 0.1, nullptr, "spacing of the pairs between two midpoints (dist_threshold of section 2.5.2)", TOP(technique.step)},
    {"technique", "throws", "", 1, 8, nullptr, "minimum throws of a secure knot", TOP(technique.throws)},

    {"surgeon", "plan", "", 0, 0, &plan_choices, "plan of the scripted surgeon; empty: that of the technique. running: rows of bites in one bowel. interrupted: one stitch over a gap, without a technique. simple: the same, tied and cut. over_and_over: a running suture over a gap. lembert_thread: a stitch that turns the edges inward. connell_thread: a loop along both edges. skin_tied: a stitch over a slit in skin, tied. purse_string_thread: a purse-string that its thread alone draws. purse_string_tied: the same, tied with an assistant's forceps on the first throw. excision: the end of a bowel is cut off with an electrosurgical pen. slit: its opening is lengthened with scissors", TOP(surgeon.plan)},
    {"surgeon", "bites", "", 0, 1000, nullptr, "number of bites; of stitches in altemeier", TOP(surgeon.bites)},
    {"surgeon", "edge_distance", "m", 0, 0.1, nullptr, "distance of the bites from the rim", TOP(surgeon.edge_distance)},
    {"surgeon", "bite_length", "m", 0, 0.1, nullptr, "bite length along the rim", TOP(surgeon.bite_length)},
    {"surgeon", "tail", "m", 0, 10, nullptr, "length of the tail", TOP(surgeon.tail)},
    {"surgeon", "speed", "m/s", 0.001, 10, nullptr, "speed of free hand motion", TOP(surgeon.speed)},
    {"surgeon", "drive_speed", "m/s", 0.0001, 10, nullptr, "speed of the needle in tissue", TOP(surgeon.drive_speed)},
    {"surgeon", "tremor", "m", 0, 0.05, nullptr, "standard deviation of hand tremor", TOP(surgeon.tremor)},
    {"surgeon", "aim_error", "m", 0, 0.05, nullptr, "standard deviation of the aim", TOP(surgeon.aim_error)},
    {"surgeon", "angle_error", "rad", 0, 1, nullptr, "standard deviation of the needle's direction at a bite", TOP(surgeon.angle_error)},
    {"surgeon", "pause", "s", 0, 60, nullptr, "mean time of thought before a task", TOP(surgeon.pause)},
    {"surgeon", "tension_error", "", 0, 2, nullptr, "relative standard deviation of the force of a pull", TOP(surgeon.tension_error)},
    {"surgeon", "grasp_error", "", 0, 0.9, nullptr, "probability that a grasp misses", TOP(surgeon.grasp_error)},
    {"surgeon", "order_error", "", 0, 1, nullptr, "probability of a throw in the wrong direction, or of two bites exchanged (purse-string)", TOP(surgeon.order_error)},
};
// clang-format on
#undef TOP
#undef BODY
#undef INSTRUMENT
#undef SUTURE

struct Section {
  const char* name;
  const char* meaning;
};
constexpr Section kSection[] = {
    {"", "Top level"},
    {"body", "Soft body; one `[[body]]` per organ"},
    {"instrument", "Instrument; one `[[instrument]]` each. Default: needle holder right, forceps left"},
    {"thread", "Suture thread"},
    {"needle", "Needle, a circular arc"},
    {"suture",
     "Needle with its thread; one `[[suture]]` each. Omitted keys are those of `[thread]` and `[needle]`. Default: one"},
    {"solver", "Solver parameters"},
    {"mechanics",
     "Mechanics of suturing. All keys but `kind` and `grasp_reach` are of guided mechanics (sections 2.2 and 2.3 of the "
     "paper)"},
    {"technique", "Technique"},
    {"surgeon", "Scripted surgeon"},
    {"expect", "Expected results at the end of a run"},
};

SceneSpec& defaults() {
  static SceneSpec scene = [] {
    SceneSpec s;
    s.body.resize(1);
    s.instrument.resize(1);
    s.suture.resize(1);
    return s;
  }();
  return scene;
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    const unsigned char u = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') (out += '\\') += c;
    else if (c == '\n') out += "\\n";
    else if (c == '\t') out += "\\t";
    else if (u < 0x20 || u == 0x7f) out += fmt::format("\\u{:04X}", u);
    else out += c;
  }
  return out + '"';
}

// A scene file's number is read as a double and then rounded to float. The shortest decimal of a float almost always survives
// that; otherwise the nine digits of max_digits10 do.
std::string float_text(float value) {
  std::string text = fmt::format("{}", value);
  if (static_cast<float>(std::strtod(text.c_str(), nullptr)) != value) text = fmt::format("{:.9g}", value);
  return text == "-0" ? "-0.0" : text;  // TOML's -0 is an integer, and integers have no signed zero
}

}  // namespace

std::span<const Field> scene_fields() { return kField; }

const std::vector<std::string>& scene_sections() {
  static const std::vector<std::string> sections = [] {
    std::vector<std::string> out;
    for (const Section& s : kSection)
      if (*s.name) out.push_back(s.name);
    return out;
  }();
  return sections;
}

const char* section_meaning(std::string_view section) {
  for (const Section& s : kSection)
    if (section == s.name) return s.meaning;
  return "";
}

bool is_list(std::string_view section) { return section == "body" || section == "instrument" || section == "suture"; }

size_t rows_of(const SceneSpec& scene, std::string_view section) {
  if (section == "body") return scene.body.size();
  if (section == "instrument") return scene.instrument.size();
  return section == "suture" ? scene.suture.size() : 1;
}

void add_row(SceneSpec& scene, std::string_view section) {
  if (section == "body") scene.body.emplace_back();
  if (section == "instrument") scene.instrument.emplace_back();
  if (section == "suture") scene.suture.push_back({scene.thread, scene.needle});
}

const Field* find_field(std::string_view section, std::string_view key) {
  for (const Field& f : kField)
    if (section == f.section && key == f.key) return &f;
  return nullptr;
}

std::string full_key(const Field& field) {
  const std::string section = field.section;
  if (section.empty()) return field.key;
  return section + (is_list(section) ? "[]." : ".") + field.key;
}

std::string type_name(const Field& field) {
  static constexpr const char* kName[] = {"text", "whole number", "whole number", "number", "flag", "vector"};
  return kName[field.at(defaults(), 0).index()];
}

std::string range_text(const Field& field) {
  const FieldRef ref = field.at(defaults(), 0);
  if (std::holds_alternative<bool*>(ref)) return "true or false";
  if (std::holds_alternative<std::string*>(ref)) {
    if (!field.choices) return "";
    std::string out = field.choices.text();
    for (size_t bar; (bar = out.find('|')) != std::string::npos;) out.replace(bar, 1, " or ");
    return out;
  }
  if (std::holds_alternative<uint64_t*>(ref)) return "0 or more";
  if (field.max >= kAny) return fmt::format("{} or more", field.min);
  return fmt::format("{}..{}", number_text(field.min), number_text(field.max));
}

std::string default_text(const Field& field) { return value_text(field.at(defaults(), 0)); }

std::string value_text(FieldRef value) {
  struct Write {
    std::string operator()(const std::string* v) const { return quoted(*v); }
    std::string operator()(const int* v) const { return std::to_string(*v); }
    std::string operator()(const uint64_t* v) const { return std::to_string(*v); }
    std::string operator()(const float* v) const { return float_text(*v); }
    std::string operator()(const bool* v) const { return *v ? "true" : "false"; }
    std::string operator()(const Vec3* v) const {
      return fmt::format("[{}, {}, {}]", float_text(v->x), float_text(v->y), float_text(v->z));
    }
  };
  return std::visit(Write{}, value);
}

std::string number_text(double value) { return fmt::format("{}", value); }

const std::vector<ResultName>& result_names() {
  static const std::vector<ResultName> names = [] {
    std::vector<ResultName> out = {
        {"bites", "", "completed bites"},
        {"suture_points", "", "suture points at the end"},
        {"knots", "", "locked knots, including those of baked sutures"},
        {"throws", "", "locked throws of all knots"},
        {"last_knot_throws", "", "locked throws of the last knot"},
        {"sutures", "", "tied sutures, baked or not"},
        {"pairs", "", "closing pairs: midpoints and pairs between them"},
        {"seam_gap", "m", "largest gap of a midpoint pair at the end; not measured without one"},
        {"seam_gap_all", "m", "largest gap of any pair at the end; not measured without one"},
        {"seam_gap_start", "m", "smallest initial gap of a midpoint pair; not measured without one"},
        {"wound_gap", "m",
         "largest gap at the end between the edges of two walls where a stitch crosses it; not measured without such a stitch"},
        {"wound_gap_change", "m", "change of wound_gap since the last instrument let go"},
        {"edge_inversion", "m",
         "how far the edges of two walls lie inward of the line between the holes on either side, where a stitch crosses; the "
         "least; not measured without such a stitch"},
        {"edge_inversion_most", "m", "the largest at any time"},
        {"bite_depth_least", "", "depth of the shallowest complete bite, as part of the wall's thickness; 1 through all of it"},
        {"bite_depth_most", "", "likewise of the deepest"},
        {"full_thickness_bites", "", "complete bites with an end on the inner face: errors of a seromuscular suture"},
        {"hands_off", "s", "time at the end since the last instrument let go"},
        {"thread_force", "N", "largest tension of a thread"},
        {"needle_detached", "", "1 if the needle is cut off the thread at the end, else 0"},
        {"held_ends", "", "thread ends held by one instrument at the end, maximum over instruments"},
        {"tail_asymmetry", "",
         "difference over sum of the thread lengths outside the first and last suture point at the first throw; not measured "
         "without one"},
        {"particles", "", "tissue and thread particles"},
        {"opening_ratio", "", "area of the opening at the end relative to the start"},
        {"opening_ratio_least", "", "smallest area of the opening at any time relative to the start"},
        {"opening_ratio_change", "", "change of opening_ratio since the last instrument let go"},
        {"closure", "", "closure progress, 0 open, 1 at the anvil"},
        {"thread_length_error", "", "maximum relative error of thread length, ticks without a particle passing a suture point"},
        {"thread_length_error_passing", "", "maximum relative error of thread length, other ticks"},
        {"order_errors", "", "thread particles missing or duplicated in the thread order, maximum over ticks"},
        {"state_valid", "", "1 if the state is finite and within 1 m of the origin, else 0"},
        {"pieces", "", "connected pieces of the drawn tissue at the end, once a pen has touched it; 0 before"},
        {"cut_deviation", "m",
         "largest distance of a cut edge from the line edge_distance away from the first body's rim, at rest"},
        {"ring_gap", "m", "largest gap round the rim of the second body to the cut edge of the first; 0 without such an edge"},
        {"stitch_gap", "m", "the same where a stitch crosses from one wall to the other; 0 without such a stitch"},
        {"stitch_tension", "N",
         "tension of the thread there at the end, the smallest of all stitches; a slack one beside taut ones may hold"},
        {"stitch_slip", "m",
         "movement within a second of the two walls of a finished stitch while 2 N pull them apart at its holes, the "
         "largest; one stitch after the other at the end, only if [expect] names it or stitch_bears"},
        {"stitch_bears", "N",
         "tension of the thread then, the smallest of all stitches; a free stitch has 1, a slack one or one without a knot "
         "less"},
        {"stitches_finished", "", "sutures of at least two points whose thread is cut off its needle; 0 with guided mechanics"},
        {"throws_held", "",
         "throws that the thread of a finished stitch shows at the end, the fewest of all; 0 without one, and with guided "
         "mechanics"},
        {"edge_eversion", "rad",
         "largest angle by which the cut edge that stays is turned outward against rest; mucosa that lies outside does not "
         "heal"},
        {"specimen_way", "m", "displacement of the piece with the first body's rim; 0 while it is one with the rest"},
        {"drawn_mass", "kg", "what the drawn tissue encloses at rest, once a pen has touched it; 0 before"},
        {"blood_loss", "m3", "blood lost from vessels that a cut has opened"},
        {"bleeding", "", "vessels that still bleed at the end"},
        {"thermal_spread", "m", "largest distance of heat-damaged tissue from the path of the pen's tip, at rest"},
        {"burnt_area", "m2", "heat-damaged tissue, at rest"},
        {"simulated_s", "s", "simulated time including settling"},
        {"ticks", "", "ticks including settling"},
        {"surgeon_retries", "", "bites, grasps, throws and cuts that the surgeon tried again"},
        {"surgeon_done", "", "1 if the surgeon finished in time and did not give up"},
        {"contacts_dropped", "",
         "contacts of thread and instruments that found no room in a list; what touched there could pass through. 0 with "
         "guided mechanics"},
    };
    for (int k = 0; k < static_cast<int>(EventKind::count_); ++k) {
      const std::string name = event_name(static_cast<EventKind>(k));
      if (name != "suture_point")  // too close to suture_points
        out.push_back({name, "", "number of `" + name + "` events"});
    }
    for (int k = 1; k < static_cast<int>(Fault::count_); ++k) {
      const std::string name = fault_name(static_cast<Fault>(k));
      out.push_back({"fault_" + name, "", "number of `technique_fault` events of kind `" + name + "`"});
    }
    return out;
  }();
  return names;
}

std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates) {
  std::string best;
  size_t best_distance = std::numeric_limits<size_t>::max();
  for (const std::string& c : candidates) {
    std::vector<size_t> row(c.size() + 1);
    for (size_t j = 0; j <= c.size(); ++j) row[j] = j;
    for (size_t i = 1; i <= word.size(); ++i) {
      size_t diagonal = row[0];
      row[0] = i;
      for (size_t j = 1; j <= c.size(); ++j) {
        const size_t change = diagonal + (word[i - 1] == c[j - 1] ? 0 : 1);
        diagonal = row[j];
        row[j] = std::min({change, row[j] + 1, row[j - 1] + 1});
      }
    }
    if (row.back() < best_distance) {
      best_distance = row.back();
      best = c;
    }
  }
  // With a third of its letters different it is another word.
  return best_distance <= std::max<size_t>(2, word.size() / 3) ? best : std::string();
}

}  // namespace catgut
