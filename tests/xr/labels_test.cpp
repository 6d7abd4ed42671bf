// SPDX-License-Identifier: Apache-2.0
// tests/xr: labels of stitches in space, without a runtime: where they stand, and what they say.
#ifdef CATGUT_TESTS_HEADSET
#include <gtest/gtest.h>
#include <imgui.h>

#include "assess/stitch_map.h"
#include "procedure/scene_file.h"
#include "sim/simulation.h"
#include "window/stitch_labels.h"
#include "xr/boards.h"
#include "xr/labels.h"

namespace catgut::xr {
namespace {

Place seated(Vec3 focus, float loupe) {
  Place place;
  place.focus = focus, place.loupe = loupe;
  recenter(place, {{0, 1.2f, 0}, {}});
  return place;
}

// A line of stitches, a circle of them, and one alone.
std::vector<StitchMark> stitches(size_t count, bool circle, Vec3 focus) {
  std::vector<StitchMark> out;
  for (size_t i = 0; i < count; ++i) {
    const auto s = static_cast<float>(i);
    const float a = 2 * kPi * s / static_cast<float>(count), x = 0.005f * (s - 0.5f * static_cast<float>(count - 1));
    const auto at = [&](float away) {
      return focus + (circle ? Vec3{(0.02f + away) * std::cos(a), 0, (0.02f + away) * std::sin(a)} : Vec3{x, 0, away});
    };
    out.push_back({{at(0.005f), at(-0.005f)}, {std::to_string(i), ""}});
  }
  return out;
}

// Seen from any side of the table nothing of a label is behind another one, its lines are legible, its rods end at its own
// suture points, and it stands beside the stitches and not in front of them.
TEST(Labels, stand_beside_the_stitches_legible_from_every_side) {
  const Vec3 focus{0.1f, 0.03f, -0.05f};
  float smallest = 1e9f;
  for (const float loupe : kLoupe)
    for (const bool circle : {false, true})
      for (const size_t count : {size_t{1}, size_t{2}, size_t{7}, size_t{19}, EyeRenderer::kMostLabels}) {
        const Place place = seated(focus, loupe);
        const std::vector<StitchMark> marks = stitches(count, circle, focus);
        for (float yaw = 0; yaw < 6.2f; yaw += 0.35f) {
          const Vec3 eyes = focus + Vec3{0.42f * std::sin(yaw), 0.38f, 0.42f * std::cos(yaw)} / loupe;
          const std::vector<Label> label = place_labels(marks, place, eyes);
          ASSERT_EQ(label.size(), count);
          const Vec3 z = normalized(eyes - focus), x = normalized(cross({0, 1, 0}, z)), y = cross(z, x);
          struct Box {
            float x, y, half_x, half_y;
          };
          std::vector<Box> box;  // tangents of angles around the direction to the field
          for (size_t i = 0; i < count; ++i) {
            const Label& l = label[i];
            ASSERT_EQ(l.text[0], marks[i].text[0]);
            ASSERT_EQ(l.point, marks[i].at);
            const Vec3 d = l.pose.p - eyes;
            const float far = -dot(d, z), half = 0.5f * l.width / far;
            ASSERT_GT(far, 0);
            box.push_back(
                {dot(d, x) / far, dot(d, y) / far, half, half * EyeRenderer::kLabelHeight / EyeRenderer::kLabelWidth});
            EXPECT_GT(dot(rotate(l.pose.q, {0, 0, 1}), normalized(eyes - l.pose.p)), 0.999f) << "it faces the eyes";
            smallest = std::min(smallest, l.width / EyeRenderer::kLabelWidth * EyeRenderer::kBoardText / length(d));
          }
          for (size_t i = 0; i < count; ++i) {
            for (size_t k = 0; k < i; ++k)
              ASSERT_FALSE(std::abs(box[i].x - box[k].x) < 0.9f * (box[i].half_x + box[k].half_x) &&
                           std::abs(box[i].y - box[k].y) < 0.9f * (box[i].half_y + box[k].half_y))
                  << i << " and " << k << " of " << count << ", loupe " << loupe << ", from " << yaw;
            for (const StitchMark& m : marks)
              for (const Vec3 p : m.at) {
                const Vec3 d = p - eyes;
                const float far = -dot(d, z);
                ASSERT_FALSE(std::abs(dot(d, x) / far - box[i].x) < box[i].half_x &&
                             std::abs(dot(d, y) / far - box[i].y) < box[i].half_y)
                    << "label " << i << " of " << count << " covers a suture point, loupe " << loupe << ", from " << yaw;
              }
          }
        }
      }
  std::fprintf(stderr, "smallest line of text: %.2f degrees\n", static_cast<double>(smallest * 180 / kPi));
  EXPECT_GT(smallest * 180 / kPi, 0.25f);
}

// Walking around does not move them: only their direction changes.
TEST(Labels, stay_where_they_are_while_the_wearer_walks) {
  const Place place = seated({}, 1);
  const auto marks = stitches(9, true, {});
  const auto here = place_labels(marks, place, {0, 0.4f, 0.4f}), there = place_labels(marks, place, {-0.4f, 0.3f, -0.2f});
  for (size_t i = 0; i < here.size(); ++i) EXPECT_EQ(here[i].pose.p, there[i].pose.p);
  EXPECT_TRUE(place_labels({}, place, {}).empty());
  EXPECT_EQ(place_labels(stitches(50, true, {}), place, {0, 1, 1}).front().text[0], "20") << "of too many the last ones";
}

// A stitch in moved tissue: its label states the numbers of the stitch map, at the suture points of the snapshot.
TEST(Labels, state_the_numbers_of_the_stitch_map_at_the_suture_points) {
  ImGuiContext* panels = ImGui::CreateContext();  // of the colors
  const SceneSpec scene = read_scene("stay");
  const auto model = build_model(scene);
  const auto state = initial_state(*model);
  Snapshot seen;
  publish(*model, *state, seen);
  const PictureModel picture = picture_model(*model);
  const RestTissue rest = rest_tissue(picture);
  StitchMap map = start_map(picture, 1.0 / 60);
  EXPECT_TRUE(stitch_marks(map, rest, seen, BiteColor::depth).empty());
  StitchBite b;
  b.tick = seen.tick;
  b.entry = picture.particle_rest[10] + Vec3{0.001f, 0, 0}, b.exit = picture.particle_rest[20];
  b.wall = picture.wall.empty() ? 0 : picture.wall[10];
  b.entry_edge = 0.0052f, b.exit_edge = -1, b.depth = 0.0018f;
  map.bite = {b, b};
  map.bite[1].tick = seen.tick + 1;
  // The tissue is moved and turned as a whole: the label's points go with it.
  const Pose motion{{0.02f, 0.01f, -0.03f}, axis_angle(normalized(Vec3{1, 2, 3}), 0.7f)};
  for (size_t i = 0; i < picture.particle_rest.size(); ++i) {
    seen.particle[i] = transform(motion, picture.particle_rest[i]);
    seen.rotation[i] = motion.q;
  }
  std::vector<StitchMark> mark = stitch_marks(map, rest, seen, BiteColor::depth);
  ASSERT_EQ(mark.size(), 1u) << "the second one is not complete yet at this moment";
  EXPECT_LT(distance(mark[0].at[0], transform(motion, b.entry)), 1e-5f);
  EXPECT_LT(distance(mark[0].at[1], transform(motion, b.exit)), 1e-5f);
  EXPECT_EQ(mark[0].text[0], "1: edge 5.2|- mm");
  EXPECT_EQ(mark[0].text[1], "depth 1.8") << "tension is left out without a thread";
  SuturePointView point;
  point.position = transform(motion, b.entry) + Vec3{0.0005f, 0, 0};
  point.tension_needle = 0.4f, point.tension_free = 0.73f;
  seen.suture[0].suture_point = {point};
  mark = stitch_marks(map, rest, seen, BiteColor::depth);
  EXPECT_EQ(mark[0].at[0], point.position) << "where the ball is drawn";
  EXPECT_EQ(mark[0].text[1], "depth 1.8  0.73 N");
  ImGui::DestroyContext(panels);
}

}  // namespace
}  // namespace catgut::xr
#endif
