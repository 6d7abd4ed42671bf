// SPDX-License-Identifier: Apache-2.0
// runtime: takes the pictures of a run; see pictures.h.
#include "runtime/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

#include "core/check.h"
#include "render/camera.h"
#include "render/image.h"
#include "render/renderer.h"
#include "render/video.h"

namespace catgut {
namespace {

constexpr size_t kSheetCells = 12, kSheetColumns = 4;
constexpr double kMomentsApart = 0.6;  // [s] simulated: simultaneous events share one picture
constexpr size_t kMostMoments = 48;    // pictures kept in memory; beyond it every other one is dropped

bool is_moment(const Snapshot& seen) {
  return std::any_of(seen.event.begin(), seen.event.end(), [](const Event& e) {
    return e.kind == EventKind::bite_completed || e.kind == EventKind::closure_started ||
           e.kind == EventKind::closure_finished || e.kind == EventKind::loop_formed || e.kind == EventKind::throw_locked;
  });
}

// The render room throws std::runtime_error; the user sees one line like for any other fault.
template <typename Work>
auto guarded(const std::string& where, Work&& work) {
  try {
    return work();
  } catch (const InputError&) { throw; } catch (const std::runtime_error& error) {
    throw InputError(where, error.what(), "leave out --video, --frames, --still and --contact-sheet to run without pictures");
  }
}

}  // namespace

struct Pictures::Studio {
  PictureOptions options;
  std::unique_ptr<Renderer> renderer;
  std::unique_ptr<VideoWriter> film;
  FollowCamera follow;
  Camera camera;
  std::optional<Pose> head, gaze;
  std::optional<Camera> fixed;
  double next_s = 0, last_s = -1, last_moment_s = 0;  // [s] simulated
  size_t frame = 0;
  std::vector<SheetCell> moment;
  Snapshot last;  // of the run so far, for the sheet's last cell
  std::string last_caption;
  const PictureModel model;
  std::unique_ptr<Renderer> still_renderer, sheet_renderer;

  Studio(const PictureOptions& o, const PictureModel& m) : options(o), follow(m), camera(overview(m)), model(m) {
    std::sort(options.still.begin(), options.still.end(), std::greater<>());  // the next one last
    fixed = fixed_camera(o.camera, m);
    renderer = make_renderer(model, o.width, o.height, Quality::low);
    if (!o.video.empty()) film = std::make_unique<VideoWriter>(o.video, o.width, o.height, o.rate);
    if (!o.frames.empty()) std::filesystem::create_directories(o.frames);
  }

  static std::string caption_of(const Snapshot& seen, const std::string& caption) {
    return caption.empty() ? fmt::format("{:6.1f} s", seen.time_s) : fmt::format("{:6.1f} s   {}", seen.time_s, caption);
  }

  // For the few pictures that are looked at longer than a film's.
  Renderer& smooth() {
    if (!sheet_renderer) sheet_renderer = make_renderer(model, options.width, options.height, Quality::medium);
    return *sheet_renderer;
  }

  // Without caption: the caller adds it where it is shown once.
  Image take(const Snapshot& seen, bool sheet) {
    // The camera eases in film time: its motion is smooth at any time-lapse factor.
    const double dt = last_s < 0 ? 0 : (seen.time_s - last_s) / options.speed;
    last_s = seen.time_s;
    camera = head                        ? head_camera()
             : fixed                     ? *fixed
             : options.camera == "close" ? close_up(model, seen)
                                         : follow.update(seen, static_cast<float>(dt));
    Image picture = (sheet ? smooth() : *renderer).render(seen, camera, {});
    if (gaze) draw_gaze(picture, gaze_point(*gaze, model, seen));
    return picture;
  }

  void draw_gaze(Image& picture, Vec3 at) const {
    constexpr float kRing = 0.035f, kLine = 1.2f;  // of the image's height; [pixels]
    const float w = static_cast<float>(picture.width), h = static_cast<float>(picture.height), r = kRing * h;
    float x = 0, y = 0;
    if (!project(camera, at, w, h, x, y)) return;
    for (int py = std::max(0, static_cast<int>(y - r - 2)); py < std::min(picture.height, static_cast<int>(y + r + 3)); ++py)
      for (int px = std::max(0, static_cast<int>(x - r - 2)); px < std::min(picture.width, static_cast<int>(x + r + 3)); ++px) {
        const float off = std::abs(std::hypot(static_cast<float>(px) - x, static_cast<float>(py) - y) - r);
        if (off > kLine) continue;
        uint8_t* p = &picture.rgba[4 * (size_t(py) * size_t(picture.width) + size_t(px))];
        p[0] = 60, p[1] = 220, p[2] = 235;
      }
  }

  // Narrower than a headset's view: the part that the wearer looks at.
  Camera head_camera() const {
    const float work = std::max(0.05f, distance(head->p, model.focus));
    return {head->p, head->p + rotate(head->q, {0, 0, -work}), rotate(head->q, {0, 1, 0}), 36, {}};
  }

  void keep(Image picture, const std::string& caption) {
    moment.push_back({std::move(picture), caption});
    if (moment.size() < kMostMoments) return;
    for (size_t i = 1; 2 * i < moment.size(); ++i) moment[i] = std::move(moment[2 * i]);
    moment.resize((moment.size() + 1) / 2);
  }

  // From the best viewpoint at that moment, independent of the film's camera.
  void take_still(const Snapshot& seen) {
    if (!still_renderer) still_renderer = make_renderer(model, options.still_width, options.still_height, Quality::high);
    const Camera from = head                         ? head_camera()
                        : fixed                      ? *fixed
                        : options.camera == "follow" ? FollowCamera(model).update(seen, 0)
                                                     : close_up(model, seen);
    write_png(still_renderer->render(seen, from), options.still.back().second);
    options.still.pop_back();
  }

  void tick(const Snapshot& seen, const std::string& doing) {
    while (!options.still.empty() && seen.time_s >= options.still.back().first) take_still(seen);
    const bool sheet =
        !options.contact_sheet.empty() && (moment.empty() || (seen.time_s >= last_moment_s + kMomentsApart && is_moment(seen)));
    const bool frame_due = (film || !options.frames.empty()) && seen.time_s >= next_s;
    if (sheet || frame_due) {
      const std::string caption = caption_of(seen, doing);
      Image picture = take(seen, sheet && !frame_due);
      if (sheet) keep(picture, caption), last_moment_s = seen.time_s;
      if (frame_due) {
        next_s += options.speed / options.rate;
        next_s = std::max(next_s, seen.time_s);  // slower than the film's rate: frames are skipped
        add_frame(picture, caption);
      }
    }
    if (!options.contact_sheet.empty() || film || !options.frames.empty()) {
      last = seen;
      last_caption = caption_of(seen, doing);
    }
  }

  void add_frame(Image& picture, const std::string& caption) {
    draw_caption(picture, caption);
    if (film) film->add(picture);
    if (!options.frames.empty()) write_png(picture, fmt::format("{}/frame_{:05}.png", options.frames, frame++));
  }

  // The state at the end, in close-up: one picture, held.
  Image last_picture() { return smooth().render(last, head || fixed ? camera : close_up(model, last)); }

  void finish() {
    if ((film || !options.frames.empty()) && last.tick > 0 && options.end_s > 0) {
      Image picture = last_picture();
      draw_caption(picture, last_caption);
      const int count = static_cast<int>(options.end_s * options.rate);
      for (int i = 0; i < count; ++i) add_frame(picture, {});
    }
    if (film) film->finish();
    if (!options.contact_sheet.empty() && !moment.empty()) write_sheet();
    if (!options.still.empty())
      throw InputError(
          "--still",
          fmt::format("the run ended before {} s, so there is no {}", options.still.back().first, options.still.back().second),
          "choose an earlier time; everything else was written");
  }

  void write_sheet() {
    moment.push_back({last_picture(), last_caption});
    std::vector<SheetCell> cell;
    const size_t n = std::min(kSheetCells, moment.size());
    for (size_t i = 0; i < n; ++i) cell.push_back(moment[n == 1 ? 0 : i * (moment.size() - 1) / (n - 1)]);
    write_png(contact_sheet(cell, static_cast<int>(kSheetColumns)), options.contact_sheet);
  }
};

Pictures::Pictures(const PictureOptions& options, const PictureModel& model)
    : studio_(guarded("pictures", [&] { return std::make_unique<Studio>(options, model); })) {}
Pictures::~Pictures() = default;

void Pictures::look_from(const Pose& head) { studio_->head = head; }
void Pictures::mark_gaze(const Pose& head) { studio_->gaze = head; }

void Pictures::tick(const Snapshot& seen, const std::string& caption) {
  guarded("pictures", [&] { studio_->tick(seen, caption); });
}

void Pictures::finish() {
  guarded("pictures", [&] { studio_->finish(); });
}

}  // namespace catgut
