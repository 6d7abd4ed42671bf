// SPDX-License-Identifier: Apache-2.0
// assess: the result of a session as plain data, and its JSON and CSV. The store keeps it, reports show it. The same recording
// gives the same result to the bit.
#pragma once
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "core/math.h"

namespace catgut::assess {

constexpr double kNotObserved = std::numeric_limits<double>::quiet_NaN();

// One measured value, with the place and the moment that show it.
struct Sample {
  double value = 0;   // in the unit of its metric
  uint64_t tick = 0;  // of the recording
  Vec3 where;         // [m] in the field at that tick
  std::string of;     // "bite 3", "knot 1 throw 2", "right hand"; empty: the session
};

struct Metric {
  std::string key;              // of a row of metric_rows() (assess/metrics.h), which has name, unit and definition
  double value = kNotObserved;  // summary of the samples, as the row states
  std::vector<Sample> sample;   // in the order of time
};

// One completed bite. Lengths in millimeters on the tissue at rest, angles in degrees; kNotObserved where there is none.
struct Bite {
  uint64_t entered = 0, tick = 0;                          // of the tip's entry, of completion
  uint32_t suture = 0, load = 0;                           // index of its suture; how often that suture was replaced before
  uint32_t number = 0;                                     // in that suture, as in events
  uint32_t wall = 0;                                       // of PictureModel::rim
  Vec3 entry, exit;                                        // [m] at rest
  Vec3 where;                                              // [m] in the field at completion
  double along_in = 0, along_out = 0;                      // along the edge, from its first point
  double edge_in = kNotObserved, edge_out = kNotObserved;  // distance of entry and exit from the cut edge
  double length = 0;                                       // from entry to exit
  double spacing = kNotObserved;  // along the edge to the nearest end of the bite before it in the same wall
  double depth = 0;               // greatest distance of the tip below the serosa
  double depth_fraction = 0;      // of the wall's thickness; 1 or more: the needle entered the lumen
  int layers = 0;                 // 1 serosa, 2 and muscularis, 3 and submucosa, 4 and mucosa
  double entry_angle = kNotObserved, exit_angle = kNotObserved;  // of the needle to the surface, 0..90
  double edge_angle = kNotObserved;                              // of the bite to the edge, 0 along it .. 90 across
  double wander = 0;                               // root mean square distance of the needle's center from its mean, in tissue
  double tremor = kNotObserved;                    // of that center, see metric needle_tremor
  double ldlj = kNotObserved;                      // log dimensionless jerk of the tip in the wall
  double turn_excess = kNotObserved;               // turn of the needle in the wall over its net turn
  double approach = kNotObserved;                  // path of the tip before its entry, over its distance
  double shift = kNotObserved;                     // largest distance of the entry from where the tip entered
  double withdrawal = kNotObserved;                // [s] from the tip's exit to completion
  double seconds = 0;                              // [s] from the tip's entry to completion
  double drive_speed = kNotObserved;               // [mm/s] of the needle along its curve while the tip is in the wall
  double grasp_at = kNotObserved;                  // position of the jaws on the needle at entry, 0 swage .. 1 tip
  double grasp_angle = kNotObserved;               // of the shaft to the needle there
  uint32_t attempts = 1;                           // entries of the tip since the bite before
  uint32_t grasps = 0;                             // of the needle since the bite before
  bool entry_inside = false, exit_inside = false;  // on the mucosa
};

enum class KnotKind : uint8_t { none, single_throw, granny, square, surgeons, mixed, sliding };
std::string_view knot_kind_name(KnotKind kind);  // "granny", "surgeon's", ...

struct Throw {
  uint64_t tick = 0;  // when it locked
  uint32_t wraps = 1;
  int hand = 1;          // chirality, +1 or -1: equal hands in turn make a granny
  bool sliding = false;  // one strand is straight and the other wound on it
  double tension = 0;    // [N] of the pulled strand when it locked
  double gap = 0;        // [mm] to the tissue, or to the throw below
  double seconds = 0;    // [s] from its start to its lock
};

struct Knot {
  uint64_t tick = 0;              // of the last throw
  uint32_t suture = 0, load = 0;  // as in Bite
  uint32_t number = 0;            // in that suture
  Vec3 where;                     // [m] in the field
  KnotKind kind = KnotKind::none;
  std::vector<Throw> thrown;
};

// A lost point, with its reason: a click plays the recording from `tick`.
struct LostPoint {
  std::string item;   // key of the rubric's item
  std::string why;    // a sentence with the number and the band
  std::string of;     // as in Sample
  double value = 0;   // in the unit of the metric
  double points = 0;  // lost
  uint64_t tick = 0;
  double time_s = 0;  // [s] of that tick
  Vec3 where;         // [m]
  bool critical = false;
};

struct ItemScore {
  std::string item, title, metric, unit;
  std::string stage;            // of the operation, as in the rubric
  double value = kNotObserved;  // summary of the metric
  double points = 0, of = 0;
  bool observed = true, passed = true;
  bool validated = false;  // a study with people supports its band
  std::string source;
};

struct Score {
  std::string rubric, title, version;                // name of the rubric's file without .toml; its title; its version
  uint64_t rubric_hash = 0;                          // of the file's text
  double points = 0, of = 0, percent = 0, pass = 0;  // pass: [%] required
  bool every_item = false;                           // every item must pass
  double completed = 1;                              // part of the task, 0..1; all points are earned in this part
  bool passed = false;
  std::string verdict;  // one sentence
  std::vector<ItemScore> item;
  std::vector<LostPoint> lost;  // in the order of time
};

struct Result {
  static constexpr int kVersion = 1;  // of this structure in JSON
  std::string catgut_version, scene, title, technique, surgeon;
  uint64_t seed = 0;
  uint64_t ticks = 0, first_tick = 0;  // of the recording; the first with connected hands
  double tick_s = 1.0 / 60, time_s = 0;
  uint64_t state_hash = 0;  // after the last tick
  bool truncated = false;   // the recording ends early
  std::string filter;       // of the hands' motion, as text
  std::vector<Bite> bite;
  std::vector<Knot> knot;
  std::vector<Metric> metric;  // one per row of metric_rows(), in their order
  std::vector<Score> score;    // one per rubric

  const Metric* find(std::string_view key) const;  // null: no such metric
  double value(std::string_view key) const;        // kNotObserved: none
};

std::string result_json(const Result& result);  // an object, indented, with a final newline; not observed: null
// key,value,unit,samples,... one row per metric, with a heading.
std::string result_csv(const Result& result);

}  // namespace catgut::assess
