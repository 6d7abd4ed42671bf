// SPDX-License-Identifier: Apache-2.0
// tests/app: a simulated user of the window. A real X server (Xvfb), real mouse and keyboard events (xdotool); the test checks
// the simulation and the recording, not pixels. Skips where one of the two programs is missing.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include "../hands/x_server.h"
#include "device/mouse.h"
#include "procedure/scene_file.h"
#include "render/orbit.h"
#include "render/renderer.h"
#include "sim/recording.h"
#include "sim/simulation.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

constexpr int kWidth = 640, kHeight = 360;

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

class Window : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(CATGUT_APP)) GTEST_SKIP() << "the program is not built here";
    if (!renderer_available()) GTEST_SKIP() << "no EGL driver here, or a build without pictures (CATGUT_RENDER=OFF)";
    for (const char* program : {"Xvfb", "xdotool"})
      if (!on_path(program)) GTEST_SKIP() << program << " is missing (Debian: apt install xvfb xdotool)";
    x_ = std::make_unique<XServer>();
    if (x_->display.empty()) GTEST_SKIP() << "Xvfb does not start here";
    folder_ = fs::path(testing::TempDir()) / ("catgut_window_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override {
    if (app_ > 0) {
      kill(app_, SIGKILL);
      waitpid(app_, nullptr, 0);
    }
    if (!folder_.empty()) fs::remove_all(folder_);
  }

  void start(const std::vector<std::string>& arguments) {
    app_ = fork();
    if (app_ != 0) return;
    setenv("DISPLAY", x_->display.c_str(), 1);
    setenv("SDL_VIDEODRIVER", "x11", 1);
    setenv("XDG_RUNTIME_DIR", folder_.c_str(), 1);
    setenv("XDG_CONFIG_HOME", folder_.c_str(), 1);           // the settings of the user who runs the tests stay untouched,
    setenv("XDG_DATA_HOME", (folder_ / "data").c_str(), 1);  // and so do the sessions
    if (chdir(folder_.c_str()) != 0) _exit(97);  // files written to the working directory are removed with the folder
    if (!std::freopen((folder_ / "stderr").c_str(), "w", stderr)) _exit(98);
    std::vector<char*> argv{const_cast<char*>("catgut")};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    execv(CATGUT_APP, argv.data());
    _exit(99);
  }
  void xdo(const std::string& what) {
    EXPECT_EQ(std::system(("DISPLAY=" + x_->display + " xdotool " + what + " >/dev/null 2>&1").c_str()), 0) << what;
  }
  // Small steps with pauses, like a hand; the server must not merge them.
  void drag(float right, float down, int steps = 10) {
    float x = 0, y = 0;
    for (int i = 1; i <= steps; ++i) {
      const float part = static_cast<float>(i) / static_cast<float>(steps);
      const int dx = static_cast<int>(std::lround(right * part - x)), dy = static_cast<int>(std::lround(down * part - y));
      x += static_cast<float>(dx), y += static_cast<float>(dy);
      xdo("mousemove_relative -- " + std::to_string(dx) + " " + std::to_string(dy));
      pause(20);
    }
  }
  static void pause(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }
  size_t count(const std::string& what) const {
    const std::string text = read_file(folder_ / "events");
    size_t n = 0;
    for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
    return n;
  }
  // Until it appears in the events, for the n-th time.
  bool happens(const std::string& what, size_t n = 1, int seconds = 40) const {
    for (int i = 0; i < seconds * 20; ++i) {
      if (count("\"" + what + "\"") >= n) return true;
      pause(50);
    }
    return false;
  }
  int exit_code(int seconds = 40) {
    int status = 0;
    for (int i = 0; i < seconds * 20; ++i) {
      if (waitpid(app_, &status, WNOHANG) == app_) {
        app_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
      }
      pause(50);
    }
    return -2;
  }
  std::string said() const { return read_file(folder_ / "stderr") + read_file(folder_ / "events"); }

  std::unique_ptr<XServer> x_;
  fs::path folder_;
  pid_t app_ = -1;
};

// Target of the pointer, computed from the program's initial state.
std::array<float, 2> from_tool_to_needle() {
  const auto model = build_model(read_scene("purse_string"));
  const auto state = initial_state(*model);
  Snapshot seen;
  publish(*model, *state, seen);
  const PictureModel picture = picture_model(*model);
  const Camera c = camera_of(start_orbit(picture, seen.active().needle.pose.p));
  const ViewFrame view = view_frame(c.eye, c.target, c.up, c.fov_deg, kHeight);
  const auto on_screen = [&](Vec3 p) {
    const Vec3 d = p - view.eye;
    const float scale = 1 / (view.pixel * dot(d, view.ahead));
    return std::array<float, 2>{dot(d, view.right) * scale, -dot(d, view.up) * scale};
  };
  const auto tool = on_screen(start_steering(picture, false).hand[0].pose.p);
  const auto needle = on_screen(good_grip(picture, seen, 0, {0, 1, 0}, {}).p);
  EXPECT_LT(std::abs(needle[0]), kWidth / 2) << "the needle is in the picture from the start";
  EXPECT_LT(std::abs(needle[1]), kHeight / 2);
  return {needle[0] - tool[0], needle[1] - tool[1]};
}

TEST_F(Window, somebody_takes_the_needle_and_everything_is_recorded) {
  const fs::path events = folder_ / "events", recording = folder_ / "r.cgrec";
  start({"play", "purse_string", "--size", "640x360", "--quality", "low", "--events", events.string(), "--record",
         recording.string(), "--seconds", "180"});
  ASSERT_TRUE(happens("practice", 1, 60)) << said();
  pause(500);
  const auto way = from_tool_to_needle();
  drag(way[0], way[1], 20);
  pause(1500);  // after one slow frame the assist has moved the tool to the needle
  xdo("click 1");
  ASSERT_TRUE(happens("needle_grasped")) << said();
  xdo("mousedown 3");
  drag(120, 0);
  pause(800);
  xdo("mouseup 3");
  for (int i = 0; i < 5; ++i) xdo("click 4");  // the wheel
  xdo("key space");
  EXPECT_TRUE(happens("needle_released")) << said();
  xdo("key Tab");
  pause(500);
  drag(60, 20);
  xdo("key n");
  EXPECT_TRUE(happens("suture_loaded")) << said();
  pause(500);

  // The screens, by keys.
  xdo("key Escape");
  EXPECT_TRUE(happens("pause")) << said();
  xdo("key period");
  xdo("key Escape");
  EXPECT_TRUE(happens("practice", 2)) << said();
  xdo("key F10");
  EXPECT_TRUE(happens("results")) << said();
  xdo("key Escape");
  EXPECT_TRUE(happens("start")) << said();
  xdo("key Escape");
  EXPECT_EQ(exit_code(), 0) << said();

  // The recording contains the session, and it replays.
  const Recording r = read_recording(recording.string());
  EXPECT_FALSE(r.truncated) << r.fault;
  ASSERT_GT(r.tick.size(), 60u);
  const Pose first = start_steering(picture_model(*build_model(read_scene("purse_string"))), false).hand[1].pose;
  float farthest = 0;
  bool pressed = false, closed = false;
  for (const RecordedTick& t : r.tick) {
    if (t.input.hand[1].connected) farthest = std::max(farthest, distance(t.input.hand[1].pose.p, first.p));
    for (const Command& c : t.input.commands) pressed = pressed || (c.kind == CommandKind::new_suture && c.hand == 1);
    closed = closed || t.input.hand[0].jaw == 0;
  }
  EXPECT_GT(farthest, 0.005f) << "Tab gave the mouse to the other hand";
  EXPECT_TRUE(pressed);
  EXPECT_TRUE(closed);
  EXPECT_EQ(std::system(("'" CATGUT_APP "' replay '" + recording.string() + "' --check >/dev/null").c_str()), 0);
}

// Resized, hidden, shown again, and terminated by the system.
TEST_F(Window, whatever_happens_to_the_window_nothing_is_lost) {
  const fs::path events = folder_ / "events", recording = folder_ / "r.cgrec", json = folder_ / "r.json";
  start({"play", "stay", "--size", "640x360", "--quality", "low", "--events", events.string(), "--record", recording.string(),
         "--json", json.string(), "--seconds", "180"});
  ASSERT_TRUE(happens("practice", 1, 60)) << said();
  xdo("search --name Catgut windowsize 500 400");
  pause(700);
  xdo("search --name Catgut windowsize 780 560");
  pause(700);
  xdo("search --name Catgut windowunmap");
  EXPECT_TRUE(happens("pause")) << "hands that are not seen do nothing: " << said();
  xdo("search --name Catgut windowmap");
  pause(500);
  xdo("search --name Catgut windowfocus");
  xdo("key Escape");
  EXPECT_TRUE(happens("practice", 2)) << said();
  drag(40, 10, 5);
  kill(app_, SIGTERM);
  EXPECT_EQ(exit_code(), 130) << said();

  const Recording r = read_recording(recording.string());
  EXPECT_FALSE(r.truncated) << r.fault;
  EXPECT_TRUE(r.interrupted);
  EXPECT_GT(r.tick.size(), 40u);
  EXPECT_EQ(std::system(("'" CATGUT_APP "' replay '" + recording.string() + "' --check >/dev/null").c_str()), 0);
  EXPECT_NE(read_file(json).find("\"technique\": \"stay\""), std::string::npos) << "what was sewn is kept too";
}

// The I key: the hand lays its instrument down and takes the next one from the tray, and again. Recorded, and it replays.
// And the session is kept in the data folder without being asked for; R ends its recording and begins the next.
TEST_F(Window, a_hand_swaps_its_instrument_by_key_and_the_session_is_kept) {
  const fs::path events = folder_ / "events", sessions = folder_ / "data/catgut/sessions";
  start({"play", "three_hands", "--size", "640x360", "--quality", "low", "--events", events.string(), "--seconds", "120"});
  ASSERT_TRUE(happens("practice", 1, 60)) << said();
  pause(500);
  xdo("key i");
  ASSERT_TRUE(happens("instrument_taken")) << said();
  EXPECT_TRUE(happens("instrument_laid_down")) << said();
  xdo("key i");
  EXPECT_TRUE(happens("instrument_taken", 2)) << said();
  xdo("key r");
  xdo("key r");
  pause(300);
  xdo("key F10");
  EXPECT_TRUE(happens("results")) << said();
  kill(app_, SIGTERM);
  EXPECT_EQ(exit_code(), 130) << said();

  std::vector<fs::path> kept;
  for (const auto& entry : fs::directory_iterator(sessions)) kept.push_back(entry.path());
  std::sort(kept.begin(), kept.end());
  ASSERT_EQ(kept.size(), 4u) << "two recordings, and the results as JSON and CSV";
  const auto of = [&](const std::string& end) {
    return std::find_if(kept.begin(), kept.end(), [&](const fs::path& p) { return p.string().ends_with(end); });
  };
  ASSERT_NE(of(".2.cgrec"), kept.end());
  ASSERT_NE(of(".csv"), kept.end());
  EXPECT_EQ(read_file(*of(".csv")).rfind("kind,number,time_s,name,value,unit\nresult,", 0), 0u);
  const fs::path recording = fs::path(of(".csv")->string()).replace_extension(".cgrec");

  std::vector<std::string> taken;
  const std::vector<InstrumentSpec> instruments = read_scene("three_hands").instrument;
  const Recording r = read_recording(recording.string());
  for (const RecordedTick& t : r.tick)
    for (const Command& c : t.input.commands)
      if (c.kind == CommandKind::swap && c.hand == 0) taken.push_back(instruments[c.argument].kind);
  EXPECT_EQ(taken, (std::vector<std::string>{"scissors", "needle_holder"}));
  EXPECT_EQ(std::system(("'" CATGUT_APP "' replay '" + recording.string() + "' --check >/dev/null").c_str()), 0);
}

TEST_F(Window, a_killed_program_leaves_what_it_had_recorded) {
  const fs::path events = folder_ / "events", recording = folder_ / "r.cgrec";
  start({"play", "stay", "--size", "320x180", "--events", events.string(), "--record", recording.string(), "--seconds", "180"});
  ASSERT_TRUE(happens("practice", 1, 60)) << said();
  pause(4000);
  kill(app_, SIGKILL);
  exit_code();
  const Recording r = read_recording(recording.string());
  EXPECT_TRUE(r.truncated);
  EXPECT_GT(r.tick.size(), 40u);
}

// Rendering stalls for half a second every two; the physics equals the headless run bit for bit.
TEST_F(Window, a_stalled_picture_changes_no_hash) {
  const fs::path alone = folder_ / "alone.cgrec", stalled = folder_ / "stalled.cgrec";
  ASSERT_EQ(std::system(("'" CATGUT_APP "' run stay --surgeon scripted --headless --no-expect --seconds 3 --record '" +
                         alone.string() + "' >/dev/null 2>&1")
                            .c_str()),
            0);
  start({"play", "stay", "--surgeon", "scripted", "--size", "320x180", "--stall-ms", "500", "--seconds", "4", "--record",
         stalled.string()});
  ASSERT_EQ(exit_code(90), 0) << said();
  const Recording a = read_recording(alone.string()), b = read_recording(stalled.string());
  EXPECT_FALSE(b.truncated) << b.fault;
  const size_t both = std::min(a.tick.size(), b.tick.size());
  ASSERT_GT(both, 60u);
  for (size_t k = 0; k < both; ++k) ASSERT_EQ(a.tick[k].hash, b.tick[k].hash) << "tick " << k;
}

TEST_F(Window, a_recording_is_looked_at_and_what_was_sewn_is_shown) {
  const fs::path recording = folder_ / "r.cgrec", picture = folder_ / "v.png", results = folder_ / "w.png";
  ASSERT_EQ(std::system(("'" CATGUT_APP "' run stay --surgeon scripted --headless --no-expect --seconds 3 --record '" +
                         recording.string() + "' >/dev/null 2>&1")
                            .c_str()),
            0);
  start({"view", recording.string(), "--size", "640x360", "--screen", "view", "--at", "2", "--after", "2", "--screenshot",
         picture.string()});
  ASSERT_EQ(exit_code(90), 0) << said();
  start({"view", recording.string(), "--size", "640x360", "--screen", "results", "--after", "3", "--screenshot",
         results.string()});
  ASSERT_EQ(exit_code(90), 0) << said();
  const auto red = [](const Image& image) {
    int n = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) n += pixel(image, x, y)[0] > pixel(image, x, y)[1] + 20;
    return n;
  };
  const Image field = read_png(picture.string()), sewn = read_png(results.string());
  EXPECT_GT(red(field), kWidth * kHeight / 40) << "tissue";
  EXPECT_LT(red(sewn), red(field) / 2) << "the panel covers it";
}

// A setting changed in the window persists, and an invalid file does not prevent the start.
// The error ends the program before the first frame, while the driver still uploads the glyphs.
TEST_F(Window, an_unknown_surgeon_is_refused_in_one_line) {
  start({"play", "stay", "--surgeon", "nonsense", "--size", "640x360", "--quality", "low"});
  EXPECT_EQ(exit_code(), 2) << said();
  EXPECT_NE(said().find("nonsense"), std::string::npos) << said();
}

TEST_F(Window, settings_are_kept) {
  const fs::path file = folder_ / "catgut" / "settings.toml", events = folder_ / "events";
  fs::create_directories(file.parent_path());
  std::ofstream(file) << "hints = maybe\n";
  start({"play", "stay", "--size", "640x360", "--events", events.string(), "--seconds", "120"});
  ASSERT_TRUE(happens("practice", 1, 60)) << said();
  EXPECT_NE(said().find("settings.toml:1"), std::string::npos) << said();
  xdo("key h");  // assist at the needle: off
  pause(500);
  xdo("key F2");
  EXPECT_TRUE(happens("settings")) << said();
  xdo("key Escape");
  EXPECT_TRUE(happens("practice", 2)) << said();
  kill(app_, SIGTERM);
  EXPECT_EQ(exit_code(), 130);
  EXPECT_NE(read_file(file).find("assist = false"), std::string::npos) << read_file(file);
  EXPECT_EQ(read_file(file.string() + ".bad"), "hints = maybe\n");
}

// A trainee practices: the session is in the store, its questions are asked once, and nothing is stored of a look round.
TEST_F(Window, a_trainees_session_is_stored_and_the_survey_is_asked) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1 (the nightly run)";
  const std::string store = (folder_ / "s.db").string(), recording = (folder_ / "r.cgrec").string();
  const std::string list = "'" CATGUT_APP "' store list --store '" + store + "' > '" + (folder_ / "list").string() + "' 2>&1";
  if (std::system(list.c_str()) != 0) GTEST_SKIP() << "built without the store";
  start({"play",       "stay",    "--size",    "1280x720", "--quality", "low", "--events", (folder_ / "events").string(),
         "--record",   recording, "--trainee", "T07",      "--store",   store, "--survey", "rectal_prolapse",
         "--feedback", "live",    "--seconds", "120"});
  ASSERT_TRUE(happens("practice", 1, 60)) << said();
  drag(20, 10);
  xdo("key F10");
  ASSERT_TRUE(happens("results")) << said();
  xdo("key Escape");
  EXPECT_TRUE(happens("survey")) << said();
  xdo("key Escape");
  EXPECT_TRUE(happens("results", 2)) << said();
  xdo("key Escape");
  EXPECT_TRUE(happens("start")) << said();
  xdo("key 1");  // another scene, left without a stitch
  EXPECT_TRUE(happens("practice", 2, 60)) << said();
  xdo("key F2");
  EXPECT_TRUE(happens("settings")) << said();
  kill(app_, SIGTERM);
  EXPECT_EQ(exit_code(), 130) << said();
  ASSERT_EQ(std::system(list.c_str()), 0);
  const std::string rows = read_file(folder_ / "list");
  EXPECT_NE(rows.find("T07"), std::string::npos) << rows;
  EXPECT_NE(rows.find("stay"), std::string::npos) << rows;
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 2) << "a heading and one session\n" << rows;
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "recordings"), {}), 1) << "the recording is kept beside the store";
}

// A visitor of a stand: the window fills the screen, no key of its own leaves it, the settings are locked, and it returns to
// its start screen when it is left alone, but not before. The staff's keys end it.
TEST_F(Window, a_kiosk_fills_the_screen_cannot_be_left_and_returns_when_idle) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1 (the nightly run)";
  constexpr int kIdle = 8;  // [s]
  start({"play", "stay", "--kiosk", "--idle", std::to_string(kIdle), "--size", "640x360", "--quality", "low", "--no-record",
         "--events", (folder_ / "events").string(), "--seconds", "300"});
  ASSERT_TRUE(happens("practice", 1, 60)) << said();
  const std::string size = (folder_ / "size").string();
  xdo("search --name Catgut getwindowgeometry --shell > '" + size + "' ; DISPLAY=" + x_->display +
      " xdotool getdisplaygeometry --shell >> '" + size + "' ; true");
  const std::string sizes = read_file(size);
  const auto number_after = [&](const std::string& key, size_t from) {
    const size_t at = sizes.find(key, from);
    return at == std::string::npos ? -1 : std::atoi(sizes.c_str() + at + key.size());
  };
  const size_t screen = sizes.rfind("WIDTH=");
  EXPECT_GT(number_after("WIDTH=", 0), 640) << sizes;
  EXPECT_EQ(number_after("WIDTH=", 0), number_after("WIDTH=", screen)) << sizes;
  EXPECT_EQ(number_after("HEIGHT=", 0), number_after("HEIGHT=", screen)) << sizes;

  // Busy for longer than the idle time: it stays.
  for (int k = 0; k < 2 * kIdle; ++k) {
    drag(k % 2 ? 12 : -12, 4, 3);
    pause(500);
  }
  EXPECT_EQ(count("\"start\""), 0u) << said();
  xdo("key F2");
  xdo("key Escape");
  EXPECT_TRUE(happens("pause")) << said();
  EXPECT_EQ(count("\"settings\""), 0u) << "the settings are locked: " << said();
  // Left alone.
  const auto left = std::chrono::steady_clock::now();
  ASSERT_TRUE(happens("start", 1, kIdle + 30)) << said();
  EXPECT_GT(std::chrono::duration<double>(std::chrono::steady_clock::now() - left).count(), 0.8 * kIdle);
  for (const char* key : {"Escape", "Escape", "q", "ctrl+q", "alt+F4", "ctrl+c"}) {
    xdo(std::string("key ") + key);
    pause(400);
  }
  int status = 0;
  ASSERT_EQ(waitpid(app_, &status, WNOHANG), 0) << "still open after every key: " << said();
  xdo("key 1");
  EXPECT_TRUE(happens("practice", 2, 60)) << "the next visitor begins: " << said();
  xdo("keydown ctrl keydown shift keydown q");
  EXPECT_EQ(exit_code(), 0) << said();
  app_ = -1;
  xdo("keyup q keyup shift keyup ctrl");
}

// F12: into the data folder, not where the program was started.
TEST_F(Window, a_screenshot_by_key_goes_to_the_data_folder) {
  if (!std::getenv("CATGUT_LONG")) GTEST_SKIP() << "set CATGUT_LONG=1 (the nightly run)";
  start({"play", "stay", "--size", "640x360", "--quality", "low", "--no-record", "--events", (folder_ / "events").string(),
         "--seconds", "120"});
  ASSERT_TRUE(happens("practice", 1, 60)) << said();
  xdo("key F12");
  const auto pictures_in = [](const fs::path& place) {
    size_t n = 0;
    if (fs::exists(place))
      for (const auto& entry : fs::recursive_directory_iterator(place)) n += entry.path().extension() == ".png";
    return n;
  };
  for (int i = 0; i < 400 && pictures_in(folder_ / "data") == 0; ++i) pause(50);
  EXPECT_EQ(pictures_in(folder_ / "data"), 1u) << said();
  EXPECT_EQ(pictures_in(folder_), 1u) << "and nowhere else";
  kill(app_, SIGTERM);
  EXPECT_EQ(exit_code(), 130) << said();
}

TEST_F(Window, a_screenshot_shows_the_field) {
  const fs::path picture = folder_ / "s.png";
  start({"play", "purse_string", "--size", "640x360", "--screenshot", picture.string(), "--after", "3"});
  ASSERT_EQ(exit_code(60), 0) << said();
  const Image image = read_png(picture.string());
  ASSERT_EQ(image.width, kWidth);
  int red = 0, green = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const Color c = pixel(image, x, y);
      red += c[0] > c[1] + 20 && c[0] > c[2] + 20;
      green += c[1] > c[0] + 20;
    }
  EXPECT_GT(red, kWidth * kHeight / 40) << "tissue";
  EXPECT_GT(green, kWidth * kHeight / 4) << "drape";
}

}  // namespace
}  // namespace catgut
