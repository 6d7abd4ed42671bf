// SPDX-License-Identifier: Apache-2.0
// assess: feedback while sewing: cues of the moment from what a surgeon sees, and remarks on the stitch or throw just made.
// Both judge by the bands of a rubric. Reads PictureModel and Snapshot, or Facts.
//
// Cues are concurrent feedback, remarks terminal feedback of a part task; which one teaches more depends on the learner
// (docs/assessment.md, "Feedback while sewing"). A silent session computes neither.
#pragma once
#include <string>
#include <vector>

#include "assess/facts.h"
#include "assess/rubric.h"

namespace catgut::assess {

// A number of the moment, with its band. good: within the band for all points.
struct Cue {
  std::string text;  // "edge 3.4 mm (2 to 5)"
  bool good = true;
};

// Constant reference for cues.
struct CueSource {
  double wall = 2.5;              // [mm] thickness
  std::vector<StitchEdge> edge;   // of each wall, at rest
  std::vector<RestSurface> rest;  // one
};
CueSource cue_source(const PictureModel& picture, double wall_mm);

// What matters now: near the tissue with a held needle: distance from the edge, spacing and angle of a bite that would begin
// here; in the tissue: depth; and the position of the grasp, loads of thread and tissue. Only metrics in the rubric, except
// that a thread above 80 % of the force at which bowel tears is always reported. At most six.
std::vector<Cue> cues_now(const Rubric& rubric, const CueSource& source, const PictureModel& picture, const Snapshot& seen);

// On a stitch or throw that was made after `after`: every lost point, or one remark that all is within the bands.
struct Remark {
  uint64_t tick = 0;
  std::string text;
  bool good = true;
};
std::vector<Remark> remarks_since(const Rubric& rubric, const Facts& facts, uint64_t after);

}  // namespace catgut::assess
