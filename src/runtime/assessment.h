// SPDX-License-Identifier: Apache-2.0
// runtime: assesses recordings and runs: feeds assess/facts tick by tick.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "assess/metrics.h"
#include "assess/rubric.h"
#include "runtime/session.h"

namespace catgut {

// Collects the facts of a run through its hooks. The hooks that are set before attach() still run, before these.
class Assessor {
 public:
  explicit Assessor(const SceneSpec& scene);
  void attach(SessionHooks& hooks);
  // After the run. One score per rubric.
  assess::Result finish(const RunResult& run, const std::vector<assess::Rubric>& rubrics) const;

 private:
  SceneSpec scene_;
  PictureModel picture_;
  assess::Facts facts_;
  const Snapshot* seen_ = nullptr;
  Snapshot last_;
};

assess::Setup assess_setup(const SceneSpec& scene);

// The rubric that is meant by `--rubric`: a name or path; empty: that of the technique, if there is one.
std::vector<assess::Rubric> rubrics_for(const std::string& name, const SceneSpec& scene);

// Replays a recording and assesses it. Throws InputError when it comes from a program with another layout of the state.
assess::Result assess_recording(const Recording& recording, const std::string& name, int threads,
                                const std::vector<assess::Rubric>& rubrics, SessionHooks hooks = {});

}  // namespace catgut
