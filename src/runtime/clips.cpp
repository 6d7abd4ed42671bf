// SPDX-License-Identifier: Apache-2.0
// runtime: see clips.h. Snapshots of the moments are kept during the replay and drawn afterward: a clip's camera is chosen at
// its moment, after its first pictures.
#include "runtime/clips.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/check.h"
#include "render/camera.h"
#include "render/jpeg.h"
#include "render/renderer.h"

namespace catgut {

std::vector<std::vector<std::string>> make_clips(const Recording& recording, const std::string& name,
                                                 const std::vector<double>& moments, const ClipOptions& o,
                                                 const SessionHooks& given) {
  std::vector<double> due;  // [s] of all pictures
  for (const double m : moments)
    for (const double off : o.at) due.push_back(std::max(0.0, m + off));
  std::sort(due.begin(), due.end());
  due.erase(std::unique(due.begin(), due.end()), due.end());
  std::map<double, Snapshot> kept;
  PictureModel model;
  SessionHooks hooks = given;
  hooks.on_start = [&](const PictureModel& picture) { model = picture; };
  hooks.on_tick = [&, next = size_t{0}](const Snapshot& seen, const std::string&) mutable {
    for (; next < due.size() && seen.time_s >= due[next]; ++next) kept.emplace(due[next], seen);
  };
  replay_session(recording, name, false, 1, hooks);
  std::vector<std::vector<std::string>> clips(moments.size());
  try {
    const auto renderer = make_renderer(model, o.width, o.height, Quality::low);
    for (size_t k = 0; k < moments.size(); ++k) {
      const auto moment = kept.find(std::max(0.0, moments[k]));
      if (moment == kept.end()) continue;
      const Camera camera = FollowCamera(model).update(moment->second, 0);
      for (const double off : o.at) {
        const auto at = kept.find(std::max(0.0, moments[k] + off));
        if (at == kept.end()) continue;
        Overlay overlay;
        overlay.caption = fmt::format("{:.1f} s{}", at->second.time_s, off == 0 ? "  <" : "");
        clips[k].push_back(jpeg_bytes(renderer->render(at->second, camera, overlay), o.quality));
      }
    }
  } catch (const InputError&) { throw; } catch (const std::runtime_error& error) {
    throw InputError("clips", error.what(), "leave out --clips");
  }
  return clips;
}

}  // namespace catgut
