// SPDX-License-Identifier: Apache-2.0
// app/xr: see register.h.
#include "xr/register.h"

#include <toml++/toml.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "core/check.h"

namespace catgut::xr {
namespace {

constexpr float kSpread = 0.03f;      // [m] of the points, horizontally: below it a rotation is noise
constexpr float kPlausible = 0.005f;  // [m]

toml::table read_table(const std::string& path) {
  if (path.empty() || !std::filesystem::exists(path)) return {};
  try {
    return toml::parse_file(path);
  } catch (const toml::parse_error& error) {
    throw InputError(path, std::string("not valid TOML: ") + std::string(error.description()), "correct or remove the file");
  }
}

}  // namespace

ArmFit fit_arms(std::span<const Vec3> room, std::span<const Vec3> world, const Place& place) {
  ArmFit fit;
  fit.place = place;
  if (room.size() != world.size() || room.size() < 3) return fit;
  Vec3 rc, wc;
  for (size_t i = 0; i < room.size(); ++i) rc += room[i], wc += world[i];
  rc = rc / static_cast<float>(room.size()), wc = wc / static_cast<float>(room.size());
  float along = 0, across = 0, vertical = 0, size = 0, flat = 0;
  for (size_t i = 0; i < room.size(); ++i) {
    const Vec3 r = room[i] - rc, w = world[i] - wc;
    along += w.x * r.x + w.z * r.z;
    across += w.x * r.z - w.z * r.x;
    vertical += w.y * r.y;
    size += length2(r);
    flat += r.x * r.x + r.z * r.z;
  }
  const float turned = std::hypot(along, across);
  if (std::sqrt(flat / static_cast<float>(room.size())) < kSpread || turned + vertical <= 0) return fit;
  fit.valid = true;
  fit.place.yaw = std::atan2(across, along);
  fit.place.loupe = size / (turned + vertical);
  const Quat back = axis_angle({0, 1, 0}, -fit.place.yaw);
  fit.place.at = rc - rotate(back, wc - place.focus) * fit.place.loupe;
  for (size_t i = 0; i < room.size(); ++i) {
    const float off = distance(fit.place.to_room(world[i]), room[i]);
    fit.rms += off * off / static_cast<float>(room.size());
    fit.worst = std::max(fit.worst, off);
  }
  fit.rms = std::sqrt(fit.rms);
  return fit;
}

bool is_plausible(const ArmFit& fit) {
  return fit.valid && fit.rms < kPlausible && fit.place.loupe > 0.2f && fit.place.loupe < 6;
}

RoomSettings load_room(const std::string& path, const std::string& room) {
  const toml::table all = read_table(path);
  RoomSettings out;
  const toml::table* table = all[room].as_table();
  if (!table) return out;
  const auto number = [&](const char* key, float otherwise) {
    return static_cast<float>((*table)[key].value_or(static_cast<double>(otherwise)));
  };
  out.height = std::clamp(number("height", out.height), kLowest, kHighest);
  out.reach = std::clamp(number("reach", out.reach), kNearest, kFarthest);
  out.loupe = std::clamp(number("loupe", out.loupe), 1.0f, 4.0f);
  if (const toml::array* at = (*table)["arms_at"].as_array(); at && at->size() == 3) {
    Place arms;
    arms.at = {static_cast<float>((*at)[0].value_or(0.0)), static_cast<float>((*at)[1].value_or(0.0)),
               static_cast<float>((*at)[2].value_or(0.0))};
    arms.yaw = number("arms_yaw", 0);
    arms.loupe = number("arms_scale", 1);
    out.arms_rms = number("arms_residual", 0);
    out.arms = arms;
  }
  return out;
}

void save_room(const std::string& path, const std::string& room, const RoomSettings& settings) {
  if (path.empty()) return;
  toml::table all;
  try {
    all = read_table(path);
  } catch (const InputError&) {  // a damaged file is replaced
  }
  const auto number = [](float v) { return std::round(1e5 * static_cast<double>(v)) / 1e5; };
  toml::table table;
  table.insert("height", number(settings.height));
  table.insert("reach", number(settings.reach));
  table.insert("loupe", number(settings.loupe));
  if (settings.arms) {
    table.insert("arms_at", toml::array{number(settings.arms->at.x), number(settings.arms->at.y), number(settings.arms->at.z)});
    table.insert("arms_yaw", number(settings.arms->yaw));
    table.insert("arms_scale", number(settings.arms->loupe));
    table.insert("arms_residual", number(settings.arms_rms));
  }
  all.insert_or_assign(room, std::move(table));
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), error);
  const std::string beside = path + ".new";
  {
    std::ofstream out(beside);
    out << all << '\n';
    if (!out.flush()) throw InputError(path, "the room's settings cannot be written", "they apply until the program ends");
  }
  if (std::rename(beside.c_str(), path.c_str()) != 0)
    throw InputError(path, "the room's settings cannot be written", "they apply until the program ends");
}

}  // namespace catgut::xr
