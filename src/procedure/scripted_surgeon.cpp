// SPDX-License-Identifier: Apache-2.0
// procedure: makes the surgeon from a scene's tables; see scripted_surgeon.h.
#include "procedure/scripted_surgeon.h"

#include <algorithm>
#include <stdexcept>

#include "core/check.h"
#include "technique/technique.h"

namespace catgut {

SurgeonSkill skill_of(const SceneSpec& scene) {
  const SurgeonSpec& s = scene.surgeon;
  SurgeonSkill k;
  if (scene.solver.preset == "paper") k.most_load = 0;
  k.bites = s.bites;
  k.edge_distance = s.edge_distance;
  k.bite_length = s.bite_length;
  k.tail = s.tail;
  k.speed = s.speed;
  k.drive_speed = s.drive_speed;
  k.tremor = s.tremor;
  k.aim_error = s.aim_error;
  k.angle_error = s.angle_error;
  k.pause = s.pause;
  k.tension_error = s.tension_error;
  k.grasp_error = s.grasp_error;
  k.order_error = s.order_error;
  k.wall = scene.body[0].wall;
  k.seed = scene.seed;
  return k;
}

std::string plan_of(const SceneSpec& scene) {
  if (!scene.surgeon.plan.empty()) return scene.surgeon.plan;
  const TechniqueRow* row = find_technique(scene.technique.name);
  return row ? row->plan : "";
}

std::unique_ptr<Surgeon> scripted_surgeon(const SceneSpec& scene, const PictureModel& picture) {
  const std::string plan = plan_of(scene);
  if (plan.empty())
    throw InputError("--surgeon scripted", "the scene has no technique to carry out", "use --surgeon none, or a recording");
  if (plan == "excision") {
    const bool pen = std::any_of(scene.instrument.begin(), scene.instrument.end(),
                                 [](const InstrumentSpec& i) { return i.kind == "cautery" && i.where == "right"; });
    if (scene.mechanics.kind != "physical" || !pen)
      throw InputError("surgeon.plan = \"excision\"",
                       pen ? "a wall of guided mechanics cannot be cut" : "the right hand holds no electrosurgical pen",
                       pen ? "set mechanics.kind = \"physical\"" : "add [[instrument]] kind = \"cautery\", where = \"right\"");
  }
  if (plan == "slit") {
    const auto has = [&](const char* kind, const char* where) {
      return std::any_of(scene.instrument.begin(), scene.instrument.end(),
                         [&](const InstrumentSpec& i) { return i.kind == kind && i.where == where; });
    };
    if (scene.mechanics.kind != "physical" || !has("scissors", "right") || !has("swab", "tray") || !has("cautery", "tray"))
      throw InputError("surgeon.plan = \"slit\"",
                       "it needs physical mechanics, scissors in the right hand, swab and pen on the tray",
                       "set mechanics.kind = \"physical\", and add the missing [[instrument]]");
  }
  if (plan == "altemeier") {
    const auto on_tray = [&](const char* kind) {
      return std::count_if(scene.instrument.begin(), scene.instrument.end(),
                           [&](const InstrumentSpec& i) { return i.kind == kind && i.where == "tray"; });
    };
    if (scene.mechanics.kind != "physical" || on_tray("allis") == 0 || on_tray("cautery") == 0 || on_tray("needle_holder") == 0)
      throw InputError("surgeon.plan = \"altemeier\"",
                       "it needs physical mechanics, and allis, cautery and needle_holder on the tray",
                       "set mechanics.kind = \"physical\", and add the missing [[instrument]]");
  }
  try {
    return make_surgeon(plan, picture, skill_of(scene));
  } catch (const std::invalid_argument&) {
    throw InputError("--surgeon scripted", "there is no script for \"" + plan + "\" in this scene",
                     "use --surgeon none, or a recording");
  }
}

}  // namespace catgut
