// SPDX-License-Identifier: Apache-2.0
// app/window: see visit.h.
#include "window/visit.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

namespace catgut {
namespace {

constexpr size_t kLogLines = 8;
constexpr size_t kMostListed = 40;
constexpr size_t kMostTips = 16;
constexpr size_t kMostRemarks = 5;

std::string json_text(const std::string& text) {  // as JSON
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 32 ? ' ' : c;
  }
  return out + "\"";
}

}  // namespace

Visit::Visit(const SceneSpec& s, const LiveOptions& options, std::FILE* events, std::function<void(const Event&)> on_event)
    : scene(s), live(s, options), watching(!options.surgeon.empty()), events_(events), on_event_(std::move(on_event)) {}

void Visit::look(double at_s) {
  have = live.look(seen, at_s);
  take_events();
}

void Visit::take_events() {
  // What was undone leaves the log, as it leaves the results.
  if (const LiveStatus& now = live.status(); std::exchange(log_epoch_, now.epoch) != now.epoch) {
    std::erase_if(log, [&](const LogLine& l) { return l.time_s > now.time_s + 1e-9; });
    std::erase_if(tip_, [&](const Event& e) { return e.tick > now.tick; });
    std::erase_if(remarks, [&](const assess::Remark& r) { return r.tick > now.tick; });
  }
  for (Event e; live.event(e);) {
    if (events_) std::fprintf(events_, "%s\n", event_json(e).c_str());
    if (on_event_) on_event_(e);
    if (e.kind == EventKind::tip_entered || e.kind == EventKind::tip_exited) {
      tip_.push_back(e);
      if (repeated_exit(tip_, tip_.size() - 1)) continue;
      if (tip_.size() > kMostTips) tip_.erase(tip_.begin());
    }
    LogLine line;
    line.text = words_for(e, line.bad);
    line.time_s = static_cast<double>(e.tick) / static_cast<double>(scene.solver.tick_rate);
    if (line.text.empty()) continue;
    log.push_back(line);
    if (log.size() > kLogLines) log.pop_front();
  }
  for (assess::Remark r; live.remark(r);) {
    // Only those on the last stitch stay.
    std::erase_if(remarks, [&](const assess::Remark& old) { return old.tick != r.tick; });
    if (events_)
      std::fprintf(events_, "{\"tick\":%llu,\"remark\":%s}\n", static_cast<unsigned long long>(r.tick),
                   json_text(r.text).c_str());
    remarks.push_back(r);
    if (remarks.size() > kMostRemarks) remarks.pop_front();
  }
  if (events_) std::fflush(events_);
}

LiveResult Visit::finish() {
  live.look(seen);
  LiveResult result = live.finish();
  take_events();
  return result;
}

Viewing::Viewing(const std::string& path) : Viewing(path, read_recording(path)) {}

Viewing::Viewing(const std::string& path, const Recording& recording)
    : file(path),
      version(recording.header.catgut_version),
      cut(recording.truncated ? recording.fault : ""),
      playback(recording, path) {
  result = playback.result();
}

void Viewing::look() {
  have = playback.look(seen);
  if (gathered == playback.status().gathered) return;
  gathered = playback.status().gathered;
  result = playback.result();
}

void Viewing::go_by(int64_t ticks) {
  const PlaybackStatus& s = playback.status();
  const int64_t to = static_cast<int64_t>(s.at) + ticks;
  playback.go_to(static_cast<uint64_t>(std::clamp<int64_t>(to, 0, static_cast<int64_t>(s.ticks))));
}

void Viewing::change_speed(bool faster) {
  const float speed = playback.status().speed;
  playback.speed(std::clamp(faster ? 2 * speed : 0.5f * speed, 0.125f, 8.0f));
}

std::vector<std::string> recordings_in(const std::string& folder, const std::vector<std::string>& also) {
  namespace fs = std::filesystem;
  std::vector<std::pair<fs::file_time_type, std::string>> found;
  std::set<fs::path> known;
  std::error_code error;
  const auto add = [&](const fs::path& path) {
    const fs::path whole = fs::weakly_canonical(path, error);
    if (error || !fs::is_regular_file(path, error) || !known.insert(whole).second) return;
    found.push_back({fs::last_write_time(path, error), path.string()});
  };
  for (const std::string& path : also) add(path);
  // A folder with many files must not delay the start screen.
  int looked_at = 0;
  for (fs::directory_iterator i(folder, fs::directory_options::skip_permission_denied, error), end; !error && i != end;
       i.increment(error)) {
    if (i->path().extension() == ".cgrec") add(folder == "." ? i->path().filename() : i->path());
    if (++looked_at > 5000) break;
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  if (found.size() > kMostListed) found.resize(kMostListed);
  std::vector<std::string> out;
  for (const auto& f : found) out.push_back(f.second);
  return out;
}

}  // namespace catgut
