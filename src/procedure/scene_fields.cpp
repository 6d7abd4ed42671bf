// procedure: the table of scene keys. Reads sim/scene.h's defaults; writes nothing.
#include "procedure/scene_fields.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "exchange/event.h"

namespace catgut {
namespace {

constexpr double kAny = 1e30;  // no bound worth stating
#define TOP(member) [](SceneSpec& s, size_t) -> FieldRef { return &s.member; }
#define BODY(member) [](SceneSpec& s, size_t i) -> FieldRef { return &s.body[i].member; }

// clang-format off
const Field kField[] = {
    {"", "name", "", 0, 0, nullptr, "short name in reports; the file's own name when left out", TOP(name)},
    {"", "title", "", 0, 0, nullptr, "what is practised, in words", TOP(title)},
    {"", "seed", "", 0, 9.2e18, nullptr, "start of every random sequence: tremor, aim", TOP(seed)},
    {"", "duration", "s", 0.001, 1e5, nullptr, "simulated time at most; a run ends earlier when the surgeon is done", TOP(duration)},
    {"", "settle", "s", 0, 1000, nullptr, "simulated time before the hands are let in", TOP(settle)},

    {"body", "name", "", 0, 0, nullptr, "name of the body in messages", BODY(name)},
    {"body", "mesh", "", 0, 0, nullptr, "organ surface to import, file or file#node, sought beside the scene file; empty: a generated tube", BODY(mesh)},
    {"body", "particles", "", 1, 200000, nullptr, "exact number of particles", BODY(particles)},
    {"body", "radius", "m", 0.001, 1, nullptr, "outer radius of the tube", BODY(radius)},
    {"body", "length", "m", 0.001, 2, nullptr, "length of the tube", BODY(length)},
    {"body", "wall", "m", 0.0001, 0.1, nullptr, "thickness of the wall", BODY(wall)},
    {"body", "closed_start", "", 0, 0, nullptr, "far end closed by a cap", BODY(closed_start)},
    {"body", "closed_end", "", 0, 0, nullptr, "near end, where the procedure works, closed by a cap", BODY(closed_end)},
    {"body", "haustra", "m", 0, 0.05, nullptr, "depth of the sacculations; they fade out toward an open rim", BODY(haustra)},
    {"body", "taeniae", "", 0, 16, nullptr, "longitudinal bands", BODY(taeniae)},
    {"body", "position", "m", -1, 1, nullptr, "centre of the near end", BODY(position)},
    {"body", "axis", "", -1, 1, nullptr, "direction in which the near end faces", BODY(axis)},
    {"body", "density", "kg/m^3", 1, 20000, nullptr, "of the tissue", BODY(density)},
    {"body", "pinned_length", "m", 0, 2, nullptr, "length of the far end that the surroundings hold", BODY(pinned_length)},
    {"body", "inner_radius", "m", 0, 1, nullptr, "outer radius of a second tube inside the first, as in a bowel folded into itself; 0: none", BODY(inner_radius)},

    {"thread", "particles", "", 2, 10000, nullptr, "thread particles from the free end to the needle", TOP(thread.particles)},
    {"thread", "spacing", "m", 0.0001, 0.1, nullptr, "rest distance of neighbours", TOP(thread.spacing)},
    {"thread", "radius", "m", 0.00001, 0.01, nullptr, "of the thread", TOP(thread.radius)},
    {"thread", "mass", "kg", 1e-9, 0.01, nullptr, "per particle", TOP(thread.mass)},
    {"thread", "stretch_compliance", "m/N", 0, 1, nullptr, "per segment; 0: cannot stretch", TOP(thread.stretch_compliance)},

    {"needle", "radius", "m", 0.0005, 0.1, nullptr, "radius of the needle's circle", TOP(needle.radius)},
    {"needle", "arc", "rad", 0.1, 6.2, nullptr, "angle from swage to tip", TOP(needle.arc)},
    {"needle", "wire_radius", "m", 0.00001, 0.01, nullptr, "radius of the wire", TOP(needle.wire_radius)},
    {"needle", "mass", "kg", 1e-7, 0.1, nullptr, "of the needle", TOP(needle.mass)},

    {"solver", "preset", "", 0, 0, "default|paper", "sets every other key of [solver]; keys written beside it override it. paper: as in section 2.1 of the paper", TOP(solver.preset)},
    {"solver", "tick_rate", "1/s", 1, 10000, nullptr, "ticks a second", TOP(solver.tick_rate)},
    {"solver", "substeps", "", 1, 1000, nullptr, "per tick", TOP(solver.substeps)},
    {"solver", "shape_sweeps", "", 0, 100, nullptr, "shape matching sweeps per substep", TOP(solver.shape_sweeps)},
    {"solver", "shape_stiffness", "", 0, 1, nullptr, "the paper's deformation resistance, per sweep", TOP(solver.shape_stiffness)},
    {"solver", "shape_relaxation", "", 0.01, 2, nullptr, "over-relaxation of the averaged goals; stiffness times relaxation must stay below 2", TOP(solver.shape_relaxation)},
    {"solver", "distance_sweeps", "", 0, 100, nullptr, "distance sweeps per substep", TOP(solver.distance_sweeps)},
    {"solver", "bend_sweeps", "", 0, 100, nullptr, "bending sweeps per substep", TOP(solver.bend_sweeps)},
    {"solver", "bend_compliance", "1/J", 0, 1e12, nullptr, "of the thread's bending in its cosine form", TOP(solver.bend_compliance)},
    {"solver", "self_contact_sweeps", "", 0, 100, nullptr, "tissue against tissue, per substep", TOP(solver.self_contact_sweeps)},
    {"solver", "contact_sweeps", "", 0, 100, nullptr, "tools, thread and needle, per substep", TOP(solver.contact_sweeps)},
    {"solver", "thread_direct", "", 0, 0, nullptr, "direct solve along the thread before the distance sweeps", TOP(solver.thread_direct)},
    {"solver", "volume", "", 0, 0, nullptr, "tetrahedral volume constraints in the wall", TOP(solver.volume)},
    {"solver", "volume_compliance", "m^6/J", 0, 1e12, nullptr, "of the volume constraints; 0: incompressible", TOP(solver.volume_compliance)},
    {"solver", "damping", "1/s", 0, 10000, nullptr, "of tissue velocities", TOP(solver.damping)},
    {"solver", "thread_damping", "1/s", 0, 10000, nullptr, "of thread velocities", TOP(solver.thread_damping)},
    {"solver", "gravity", "m/s^2", -1000, 1000, nullptr, "y is up", TOP(solver.gravity)},
    {"solver", "mass_scale", "", 1, 10000, nullptr, "tissue inertia times this at unchanged weight: sets the force with which tissue answers", TOP(solver.mass_scale)},
    {"solver", "friction_tissue", "", 0, 10, nullptr, "coefficient of Coulomb friction, tissue on tissue", TOP(solver.friction_tissue)},
    {"solver", "friction_tool", "", 0, 10, nullptr, "coefficient of Coulomb friction, tool on tissue and on the other tool", TOP(solver.friction_tool)},
    {"solver", "friction_thread", "", 0, 10, nullptr, "coefficient of Coulomb friction, thread on tissue and thread", TOP(solver.friction_thread)},
    {"solver", "hand_stiffness", "N/m", 1, 100000, nullptr, "of the coupling between a hand and its tool; a haptic arm renders no more than some 300", TOP(solver.hand_stiffness)},
    {"solver", "tool_force", "N", 0, 1000, nullptr, "with which two tools press each other at most; beyond it they slip past each other (at the mouse: 1.5 at most)", TOP(solver.tool_force)},

    {"suture", "attach_threshold", "m", 0, 0.1, nullptr, "how near a particle must be to the needle's tip to be attached (X of the paper's figure 4)", TOP(suture.attach_threshold)},
    {"suture", "release_distance", "m", 0, 0.1, nullptr, "drag beyond which the attached particle is let go (figure 5)", TOP(suture.release_distance)},
    {"suture", "attach_compliance", "m/N", 0, 1000, nullptr, "of that attachment", TOP(suture.attach_compliance)},
    {"suture", "channel_compliance", "m/N", 0, 1000, nullptr, "how softly the bitten tissue holds the needle's shaft sideways", TOP(suture.channel_compliance)},
    {"suture", "pass_tension", "N", 0, 1000, nullptr, "tension difference beyond which thread slides through a suture point", TOP(suture.pass_tension)},
    {"suture", "capstan", "", 0, 10, nullptr, "and so much more per newton of tension: friction coefficient times the angle by which the suture point bends the thread", TOP(suture.capstan)},
    {"suture", "collision_off", "", 0, 100, nullptr, "thread particles on each side of a locked one that do not collide", TOP(suture.collision_off)},
    {"suture", "grasp_reach", "m", 0, 0.1, nullptr, "how near a closing jaw must be to hold needle or thread", TOP(suture.grasp_reach)},

    {"technique", "name", "", 0, 0, "purse_string|connell|stay|lembert|none", "which points close with which, and when", TOP(technique.name)},
    {"technique", "anvil", "m", -1, 1, nullptr, "focal point of the closure, relative to the rim's centre", TOP(technique.anvil)},
    {"technique", "anvil_radius", "m", 0, 0.1, nullptr, "the rim ends on a ring of this radius", TOP(technique.anvil_radius)},
    {"technique", "closure_compliance", "m/N", 0, 1000, nullptr, "of the pull of the edge particles toward the anvil", TOP(technique.closure_compliance)},
    {"technique", "min_bites", "", 0, 1000, nullptr, "bites needed before the closure may start", TOP(technique.min_bites)},
    {"technique", "closed_gap", "m", 0, 0.1, nullptr, "what is left between two points that a seam or a knot draws together", TOP(technique.closed_gap)},
    {"technique", "step", "m", 0.0001, 0.1, nullptr, "between the pairs that a seam draws together in between (dist_threshold of section 2.5.2)", TOP(technique.step)},
    {"technique", "throws", "", 1, 8, nullptr, "with fewer a knot does not hold", TOP(technique.throws)},

    {"surgeon", "plan", "", 0, 0, "|purse_string|connell|stay|lembert|running", "what the scripted surgeon does; empty: the technique. running: bites in one bowel, row under row", TOP(surgeon.plan)},
    {"surgeon", "bites", "", 0, 1000, nullptr, "bites the scripted surgeon makes", TOP(surgeon.bites)},
    {"surgeon", "edge_distance", "m", 0, 0.1, nullptr, "of the bites from the rim", TOP(surgeon.edge_distance)},
    {"surgeon", "bite_length", "m", 0, 0.1, nullptr, "along the rim", TOP(surgeon.bite_length)},
    {"surgeon", "tail", "m", 0, 10, nullptr, "thread left at the free end", TOP(surgeon.tail)},
    {"surgeon", "speed", "m/s", 0.001, 10, nullptr, "of free hand motion", TOP(surgeon.speed)},
    {"surgeon", "drive_speed", "m/s", 0.0001, 10, nullptr, "of the needle in tissue", TOP(surgeon.drive_speed)},
    {"surgeon", "tremor", "m", 0, 0.05, nullptr, "standard deviation", TOP(surgeon.tremor)},
    {"surgeon", "aim_error", "m", 0, 0.05, nullptr, "standard deviation", TOP(surgeon.aim_error)},
};
// clang-format on
#undef TOP
#undef BODY

struct Section {
  const char* name;
  const char* meaning;
};
constexpr Section kSection[] = {
    {"", "The top of the file"},
    {"body", "One soft body, `[[body]]`, as many as there are organs"},
    {"thread", "The suture thread"},
    {"needle", "The needle: an arc of a circle"},
    {"solver", "The solver's knobs"},
    {"suture", "Guided suturing (sections 2.2 and 2.3 of the paper)"},
    {"technique", "The technique's plan"},
    {"surgeon", "The scripted surgeon"},
    {"expect", "What must hold at the end of a run: every scene is a test"},
};

SceneSpec& defaults() {
  static SceneSpec scene = [] {
    SceneSpec s;
    s.body.resize(1);
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
// that; where it would not, the nine digits of max_digits10 do.
std::string float_text(float value) {
  std::string text = fmt::format("{}", value);
  if (static_cast<float>(std::strtod(text.c_str(), nullptr)) != value) text = fmt::format("{:.9g}", value);
  return text == "-0" ? "-0.0" : text;  // TOML's -0 is a whole number, and those have no sign of zero
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

const Field* find_field(std::string_view section, std::string_view key) {
  for (const Field& f : kField)
    if (section == f.section && key == f.key) return &f;
  return nullptr;
}

std::string full_key(const Field& field) {
  const std::string section = field.section;
  if (section.empty()) return field.key;
  return section + (section == "body" ? "[]." : ".") + field.key;
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
    std::string out = field.choices;
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
        {"knots", "", "locked knots, those of settled sutures included"},
        {"throws", "", "locked throws of all knots"},
        {"last_knot_throws", "", "locked throws of the last knot"},
        {"sutures", "", "tied sutures, settled or not"},
        {"pairs", "", "pairs of places that are drawn together: midpoints and those in between"},
        {"seam_gap", "m", "largest distance between the two places of a midpoint pair at the end"},
        {"seam_gap_all", "m", "the same over all pairs"},
        {"seam_gap_start", "m", "smallest distance that a midpoint pair had when it was made; 0 without one"},
        {"needle_off", "", "1 when the needle was cut off the thread at the end, else 0"},
        {"held_ends", "", "ends of thread that one tool holds at the end, the most of the two tools"},
        {"ends_uneven", "",
         "difference over sum of the thread before the first and after the last suture point when the first knot was begun"},
        {"particles", "", "tissue and thread particles"},
        {"opening_ratio", "", "area of the opening at the end over its area when the hands were let in"},
        {"closure", "", "0 open .. 1 at the anvil"},
        {"thread_length_error", "",
         "largest relative error of the thread's length in ticks in which no particle passed a suture point"},
        {"thread_length_error_passing", "", "the same in ticks in which one did"},
        {"lost", "", "thread particles missing from the thread's order or there twice, the most in any tick"},
        {"sane", "", "1 when nothing was NaN, infinite or more than 1 m away, else 0"},
        {"simulated_s", "s", "simulated time, settling included"},
        {"ticks", "", "ticks, settling included"},
        {"surgeon_done", "", "1 when the surgeon finished before the time was over and did not give up"},
    };
    for (int k = 0; k < static_cast<int>(EventKind::count_); ++k) {
      const std::string name = event_name(static_cast<EventKind>(k));
      if (name != "suture_point")  // so close to suture_points that it would only confuse
        out.push_back({name, "", "number of `" + name + "` events"});
    }
    for (int k = 1; k < static_cast<int>(Fault::count_); ++k) {
      const std::string name = fault_name(static_cast<Fault>(k));
      out.push_back({"fault_" + name, "", "number of `technique_fault` events that say " + name});
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
  // A word half of whose letters are wrong is another word.
  return best_distance <= std::max<size_t>(2, word.size() / 2) ? best : std::string();
}

}  // namespace catgut
