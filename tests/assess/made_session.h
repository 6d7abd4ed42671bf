// SPDX-License-Identifier: Apache-2.0
// tests/assess: a stitched session made by construction: every distance, depth, angle and spacing is known. The tissue is the
// generated bowel of the scene `stay`; it is moved rigidly, so that positions in the field and at rest differ.
#pragma once
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "assess/metrics.h"
#include "procedure/scene_file.h"
#include "sim/simulation.h"

namespace catgut::assess::made {

constexpr float kRadius = 0.020f, kWall = 0.0018f, kEnd = 0.0045f;  // [m] of the scene
constexpr double kDt = 1.0 / 60;

struct World {
  SceneSpec scene = read_scene("stay");
  PictureModel picture;
  Snapshot start;
  World() {
    // A cylinder: its positions and directions are known.
    for (const char* set : {"body.haustra=0", "body.taeniae=0"}) set_value(scene, set);
    const auto model = build_model(scene);
    picture = picture_model(*model);
    const StatePtr state = initial_state(*model);
    publish(*model, *state, start);
  }
};
inline const World& world() {
  static const World w;
  return w;
}

// A bite across or along the edge, given on the outer surface at rest: `edge` [mm] distance of entry and exit from the rim,
// `angle` [deg] about the axis from the top.
struct Plan {
  uint32_t wall = 0;
  double edge_in = 8, edge_out = 4;    // [mm]
  double angle_in = 0, angle_out = 0;  // [deg] about the axis
  double tip_depth = 1.1;              // [mm] below the serosa
  double tilt = 90;                    // [deg] of the needle to the surface at entry and exit
  int attempts = 1, grasps = 2;
  bool through = false;  // exits on the mucosa
  double wander = 0;     // [mm] of the needle's center
  double grasp_at = 0.35, grasp_angle = 90;
  double shift = 0;  // [mm] of the entry while the needle is in the wall
  double sweep = 0;  // [mm] straight path of the tip in the wall, with least jerk; 0: it waits
  double rock = 0;   // [deg] by which the needle turns forward and back before it passes; 0: it passes at once
};

// One session, built tick by tick from happenings.
class Session {
 public:
  Session() : turn_(axis_angle({0.3f, 1, 0.2f}, 0.4f)), away_{0.03f, -0.02f, 0.05f}, seen_(world().start) {
    for (size_t i = 0; i < world().picture.particle_rest.size(); ++i) {
      seen_.particle[i] = moved(world().picture.particle_rest[i]);
      seen_.rotation[i] = turn_;
    }
    Setup setup;
    setup.tick_s = kDt, setup.wall = static_cast<double>(kWall) * 1000, setup.technique = "stay";
    facts_ = begin_facts(world().picture, setup);
    for (size_t k = 0; k < 2; ++k) input_.hand[k].pose.p = {k == 0 ? 0.1f : -0.1f, 0.1f, 0};
    seen_.tick = 0;
    tick();
  }

  Vec3 moved(Vec3 p) const { return rotate(turn_, p) + away_; }
  Vec3 turned(Vec3 d) const { return rotate(turn_, d); }

  // Hands move with minimum-jerk strokes while time passes, one after the other.
  void tick(int n = 1) {
    for (int i = 0; i < n; ++i) {
      ++seen_.tick;
      for (Event& e : seen_.event) e.tick = seen_.tick;
      for (size_t k = 0; k < 2; ++k) {
        const double c = static_cast<double>((seen_.tick + 40 * k) % 160) / 40;  // out, rest, back, rest
        const double t = c < 1 ? c : c < 2 ? 1 : c < 3 ? 3 - c : 0, x = 0.08 * t * t * t * (10 - 15 * t + 6 * t * t);
        Vec3 p{k == 0 ? 0.1f : -0.1f, 0.1f + static_cast<float>(x), 0};
        if (all_idle) p = {k == 0 ? 0.1f : -0.1f, 0.1f, 0};
        // 8 Hz, 0.5 mm
        p.z += shake * static_cast<float>(std::sin(6.2831853 * 8 * static_cast<double>(seen_.tick) * kDt));
        input_.hand[k].pose.p = p;
        if (k == 0 && twist != 0) input_.hand[k].pose.q = axis_angle({0, 1, 0}, twist * static_cast<float>(seen_.tick));
      }
      note(facts_, world().picture, seen_, input_);
      seen_.event.clear();
    }
  }
  void happen(EventKind kind, uint32_t which = 0, float value = 0, Fault fault = Fault::none) {
    seen_.event.push_back({.kind = kind, .which = which, .value = value, .where = away_, .fault = fault, .tick = seen_.tick});
  }

  static Vec3 on_serosa(uint32_t wall, double edge_mm, double angle_deg, double below_mm = 0) {
    const double a = angle_deg / 180 * 3.14159265358979, r = static_cast<double>(kRadius) - below_mm * 1e-3;
    const double x = static_cast<double>(kEnd) + edge_mm * 1e-3;
    return {static_cast<float>(wall == 0 ? -x : x), static_cast<float>(r * std::cos(a)), static_cast<float>(r * std::sin(a))};
  }

  void bite(const Plan& p) {
    SutureView& s = seen_.active();
    const SuturePicture& shape = world().picture.suture[0];
    const Vec3 in = on_serosa(p.wall, p.edge_in, p.angle_in);
    const Vec3 out = on_serosa(p.wall, p.edge_out, p.angle_out, p.through ? static_cast<double>(kWall) * 1000 : 0);
    for (int g = 0; g < p.grasps; ++g) happen(EventKind::needle_grasped);
    tick(5);
    for (int a = 1; a < p.attempts; ++a) {
      begin_bite(p, in, out);
      tick(10);
      happen(EventKind::bite_withdrawn, static_cast<uint32_t>(s.bite.size() - 1));
      s.needle.in_tissue = false;
      tick(5);
    }
    begin_bite(p, in, out);
    const auto number = static_cast<uint32_t>(s.bite.size() - 1);
    s.needle.pose = needle_through(in, p.angle_in, in - out, p.tilt, true);
    for (ToolView& t : seen_.tool) t.held = Held::nothing;
    ToolView& holder = seen_.tool[0];
    holder.held = Held::needle, holder.held_at = static_cast<float>(p.grasp_at), holder.held_suture = 0;
    {  // the shaft at `grasp_angle` to the needle
      const float phi = holder.held_at * shape.needle_arc;
      const Vec3 along = rotate(s.needle.pose.q, {-std::sin(phi), std::cos(phi), 0});
      const Vec3 up = rotate(s.needle.pose.q, {0, 0, 1});
      const float a = static_cast<float>(p.grasp_angle / 180 * 3.14159265358979);
      const Vec3 z = along * std::cos(a) + up * std::sin(a), x = any_perpendicular(z);
      holder.pose.q = from_axes(x, cross(z, x), z);
    }
    tick();
    // The tip waits at the entry, and once it is at its greatest depth.
    const double middle = 0.5 * (p.angle_in + p.angle_out), edge = 0.5 * (p.edge_in + p.edge_out);
    const Vec3 tip = moved(on_serosa(p.wall, edge, middle, p.tip_depth));
    const Pose entered = s.needle.pose;
    for (int k = 0; k < 400; ++k) {
      s.needle.pose = k == 200 ? tip_at(tip, entered.q) : entered;
      if (p.sweep > 0) {
        const double t = k / 399.0, x = p.sweep * 1e-3 * t * t * t * (10 - 15 * t + 6 * t * t);
        s.needle.pose = entered;
        s.needle.pose.p += turned({static_cast<float>(x), 0, 0});
      }
      if (p.rock > 0) {
        const Pose out_pose = needle_through(out, p.angle_out, in - out, p.tilt, false);
        const float a = static_cast<float>(p.rock / 180 * 3.14159265358979);
        s.needle.pose = k < 100 || (k >= 200 && k < 300) ? entered : out_pose;
        if (k >= 100 && k < 200) s.needle.pose.q = entered.q * axis_angle({0, 0, 1}, a);
      }
      s.bite[number].entry = moved(in) + (k >= 200 ? turned({0, 0, static_cast<float>(p.shift * 1e-3)}) : Vec3{});
      if (k != 200) s.needle.pose.p += turned({static_cast<float>((k % 2 ? 1 : -1) * p.wander * 1e-3), 0, 0});
      tick();
    }
    s.needle.pose = needle_through(out, p.angle_out, in - out, p.tilt, false);
    s.bite[number].has_exit = true;
    s.bite[number].depth = 0;
    happen(EventKind::tip_exited, number);
    tick(20);
    s.bite[number].complete = true;
    s.needle.in_tissue = false;
    happen(EventKind::bite_completed, number, distance(in, out));
    tick(5);
  }

  // Throws of a knot, from the tissue.
  void knot(const std::vector<KnotThrow>& thrown) {
    SutureView& s = seen_.active();
    const auto number = static_cast<uint32_t>(s.knot.size());
    s.knot.emplace_back();
    s.knot.back().position = moved(on_serosa(0, 0, 0));
    for (const KnotThrow& t : thrown) {
      happen(EventKind::throw_started, number, static_cast<float>(t.wraps));
      tick(30);
      KnotView& k = s.knot.back();
      k.thrown[k.throws++] = t;
      k.phase = KnotPhase::locked;
      happen(EventKind::throw_locked, number, t.tension);
      tick();
    }
  }
  void pair(double gap_mm) {
    const Vec3 a = moved(on_serosa(0, 0, 0));
    seen_.active().seam.push_back({a, a + turned({static_cast<float>(gap_mm * 1e-3), 0, 0}), 0.009f, 1, true});
  }
  void tension(float newton) {
    SuturePointView p;
    p.position = moved(on_serosa(0, 4, 0)), p.tension_needle = newton;
    seen_.active().suture_point.push_back(p);
    tick();
    seen_.active().suture_point.pop_back();
    tick();
  }
  // Closes the jaws of a hand on nothing for half a second.
  void grasp_nothing() {
    seen_.tool[1].held = Held::nothing;
    seen_.tool[1].jaw = 1;
    tick();
    seen_.tool[1].jaw = 0;
    tick(30);
  }
  // Leans the edge's tissue of wall 0 by `degrees` outward.
  void lean(double degrees) {
    const PictureModel& p = world().picture;
    for (const uint32_t i : p.rim[0]) {
      const Vec3 radial = normalized(Vec3{0, p.particle_rest[i].y, p.particle_rest[i].z});
      const Vec3 hinge = cross({1, 0, 0}, radial);  // turns the axis of the opening toward the outside
      seen_.rotation[i] = axis_angle(hinge, static_cast<float>(degrees / 180 * 3.14159265358979));
    }
  }
  void narrow(float factor) {
    for (const uint32_t i : world().picture.rim[0]) {
      const Vec3 r = world().picture.particle_rest[i];
      seen_.particle[i] = moved({r.x, r.y * factor, r.z * factor});
    }
  }
  void pull_tissue(float newton) {
    seen_.tool[1].held = Held::tissue;
    seen_.instrument[1].pull = {newton, 0, 0};
    happen(EventKind::tissue_grasped);
    tick(30);
    seen_.tool[1].held = Held::nothing;
  }

  Result result() const {
    Result r = measure(facts_, world().picture, seen_);
    r.ticks = seen_.tick;
    return r;
  }
  Snapshot& seen() { return seen_; }
  const Facts& facts() const { return facts_; }
  // As an undone bite: state and facts of that moment, with the paths of the hands in place.
  void go_back_to(const Session& then) {
    rewind(facts_, then.facts_);
    seen_ = then.seen_;
  }
  // Holds the needle with its tip on the serosa, at an angle to it.
  void aim(uint32_t wall, double edge_mm, double tilt) {
    const Vec3 in = on_serosa(wall, edge_mm, 20);
    SutureView& s = seen_.active();
    s.needle.pose = needle_through(in, 20, Vec3{1, 0, 0}, tilt, true);
    seen_.tool[0].held = Held::needle, seen_.tool[0].held_at = 0.3f;
  }
  bool all_idle = false;
  float shake = 0;  // [m]
  float twist = 0;  // [rad] of the right hand, per tick

 private:
  void begin_bite(const Plan& p, Vec3 in, Vec3 out) {
    SutureView& s = seen_.active();
    BiteView b;
    b.wall = p.wall, b.entry = moved(in), b.exit = moved(out);
    b.exit_inside = p.through;
    s.bite.push_back(b);
    s.needle.in_tissue = true;
    s.needle.pose = needle_through(in, p.angle_in, in - out, p.tilt, true);
    happen(EventKind::tip_entered, static_cast<uint32_t>(s.bite.size() - 1));
  }
  // A needle whose circle passes `at` (on the serosa) at `tilt` to the surface, in the plane of `way` and the outward normal.
  Pose needle_through(Vec3 at, double angle_deg, Vec3 way, double tilt, bool inward) const {
    const float radius = world().picture.suture[0].needle_radius;
    const double a = angle_deg / 180 * 3.14159265358979, t = tilt / 180 * 3.14159265358979;
    const Vec3 out{0, static_cast<float>(std::cos(a)), static_cast<float>(std::sin(a))};
    const Vec3 along = normalized(way - out * dot(way, out), {1, 0, 0});
    const Vec3 tangent =
        normalized(along * static_cast<float>(std::cos(t)) + out * static_cast<float>(inward ? -std::sin(t) : std::sin(t)));
    const Vec3 normal = normalized(cross(out, along)), radial = cross(tangent, normal);
    const Vec3 center = at - radial * radius;
    // The tip, at the end of the arc, is there.
    const Quat tip_first = axis_angle({0, 0, 1}, -world().picture.suture[0].needle_arc);
    return {moved(center), turn_ * from_axes(radial, tangent, normal) * tip_first};
  }
  Pose tip_at(Vec3 tip, Quat q) const {
    const SuturePicture& s = world().picture.suture[0];
    return {tip - rotate(q, s.needle_radius * Vec3{std::cos(s.needle_arc), std::sin(s.needle_arc), 0}), q};
  }

  Quat turn_;
  Vec3 away_;
  Snapshot seen_;
  TickInput input_;
  Facts facts_;
};

inline const std::vector<KnotThrow> kSquare{{2, 1, 1, 1.0f, 0.0002f}, {1, -1, 1, 1.0f, 0.0001f}, {1, 1, 1, 1.0f, 0.0001f}};

// Two good stitches of two bites each: far in, near out; near in, far out. 4 mm apart.
struct Script {
  std::vector<Plan> bite;
  std::vector<KnotThrow> knot = kSquare;
  std::function<void(Session&)> before = [](Session&) {}, after = [](Session&) {};
  double gap = 0.2;
  float tail = 0.005f;
  Script() {
    for (int s = 0; s < 2; ++s) {
      const double angle = 4.0 * s / static_cast<double>(kRadius * 1000) * 57.29577951308232;
      Plan left, right;
      left.wall = 0, left.edge_in = 8, left.edge_out = 4, left.angle_in = left.angle_out = angle;
      right.wall = 1, right.edge_in = 4, right.edge_out = 8, right.angle_in = right.angle_out = angle;
      bite.push_back(left), bite.push_back(right);
    }
  }
  Result run() const {
    Session session;
    before(session);
    for (size_t i = 0; i < bite.size(); ++i) {
      if (i == 2) session.happen(EventKind::suture_loaded);  // each stitch has its own thread
      session.bite(bite[i]);
    }
    session.knot(knot);
    session.pair(gap);
    session.happen(EventKind::thread_cut, 0, tail);
    session.tick();
    after(session);
    session.tick();
    return session.result();
  }
};

}  // namespace catgut::assess::made
