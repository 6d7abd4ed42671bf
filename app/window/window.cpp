// app/window: the loop of the window: events, hands, one picture; and which screen comes after which. Physics has its own
// thread (runtime/live) and never waits for this one.
#include "window/window.h"

#include <SDL.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <utility>

#include "commands/commands.h"
#include "core/check.h"
#include "device/steer.h"
#include "procedure/scene_file.h"
#include "render/orbit.h"
#include "render/window.h"
#include "runtime/guide.h"
#include "window/input.h"
#include "window/latency.h"
#include "window/panels.h"
#include "window/sdl_window.h"

namespace catgut {
namespace {

constexpr const char* kFont = "/usr/share/fonts/truetype/dejavu/DejaVuSansMono.ttf";
constexpr size_t kLogLines = 8;
constexpr double kMostPictures = 150;  // [1/s]
constexpr double kSlowPicture = 0.07;  // [s] a picture that takes longer is drawn coarser

enum class Screen { start, practise, pause, results };
constexpr const char* kScreenNames[] = {"start", "practise", "pause", "results"};

class Window {
 public:
  explicit Window(const PlayOptions& options)
      : options_(options), sdl_(options.width, options.height), width_(options.width), height_(options.height) {
    try {
      renderer_ = make_window_renderer(sdl_.number, width_, height_, kFont);
    } catch (const std::runtime_error& error) { throw InputError("window", error.what(), kHeadless); }
    settings_.quality = options.quality;
    settings_.left_handed = options.left_handed;
    settings_.hints = options.height >= 480;
    // What people practise first, from the simplest; then what is there besides.
    std::vector<std::string> names = scene_names();
    const auto rank = [](const std::string& name) {
      const std::vector<std::string> kFirst{"purse_string", "stay", "connell", "lembert"};
      return std::find(kFirst.begin(), kFirst.end(), name) - kFirst.begin();
    };
    std::stable_sort(names.begin(), names.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
    for (const std::string& name : names) scenes_.push_back({name, read_scene(name).title});
    if (!options.events.empty()) {
      events_ = options.events == "-" ? stdout : std::fopen(options.events.c_str(), "w");
      if (!events_) throw InputError(options.events, "cannot be written", "choose another place");
    }
    resized();
  }
  ~Window() {
    if (events_ && events_ != stdout) std::fclose(events_);
  }
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  int loop() {
    if (!options_.scene.empty()) open(options_.scene, options_.teach);
    const double start = wall_seconds();
    double last = start, drawn_at = start;
    const std::atomic<bool>& stop = stop_on_interrupt();
    while (!quit_ && !stop) {
      const double now = wall_seconds();
      const float dt = static_cast<float>(std::clamp(now - last, 1e-3, 0.25));
      last = now;
      if (options_.seconds > 0 && now - start > options_.seconds) break;
      if (frame(dt)) {
        ++pictures_;
        const double drawn = wall_seconds(), keep = std::exp(-(drawn - drawn_at));
        picture_s_ = picture_s_ * keep + (drawn - drawn_at);
        picture_count_ = picture_count_ * keep + 1;
        drawn_at = drawn;
        coarser_if_slow();
        // Where the display does not set the pace something must, or the picture would take the processor from the physics.
        const double left = 1.0 / kMostPictures - (drawn - now);
        if (left > 0) SDL_Delay(static_cast<uint32_t>(1000 * left));
      } else {
        SDL_Delay(1);  // the driver is behind: hands go on, and the processor is left to it
      }
      if (!options_.screenshot.empty() && pictures_ >= options_.after) break;
    }
    LiveResult result;
    if (live_) result = finish();
    if (options_.seconds > 0 || !options_.screenshot.empty()) latency_.report(pictures_, wall_seconds() - start);
    if (!result.fault.empty()) throw InputError("simulation", result.fault, "the recording holds what went before");
    return stop ? 130 : 0;
  }

 private:
  // --- scenes
  // -----------------------------------------------------------------------------------------------------------------
  void open(const std::string& name, bool teach = false) {
    scene_ = read_scene(name);
    LiveOptions live = options_.live;
    if (!live.record.empty() && opened_++ > 0) {  // every visit has its own file
      const size_t dot = live.record.rfind(".cgrec");
      live.record = live.record.substr(0, dot) + fmt::format("_visit{}.cgrec", opened_);
    }
    live_ = std::make_unique<Live>(scene_, live);
    places_ = bite_places(scene_, live_->picture());
    if (teach) lesson_.begin(first_stitch());
    else lesson_.end();
    steering_ = start_steering(live_->picture(), settings_.left_handed);
    mouse_ = {};
    pad_ = {};
    orbit_set_ = false;
    log_.clear();
    epoch_ = 0;
    renderer_->stage(&live_->picture(), settings_.quality);
    if (coarse_ < 1) renderer_->draw_coarser(coarse_);
    go(Screen::practise);
  }

  LiveResult finish() {
    if (live_) live_->look(seen_);
    LiveResult result = live_ ? live_->finish() : LiveResult{};
    take_events();
    live_.reset();
    return result;
  }

  void go(Screen screen) {
    // While somebody works the mouse is a hand and not a pointer; what it did before the change is nobody's.
    if (screen == Screen::practise && options_.live.surgeon.empty()) SDL_SetRelativeMouseMode(SDL_TRUE);
    else SDL_SetRelativeMouseMode(SDL_FALSE);
    if (live_ && screen == Screen::pause) live_->command(LiveCommand::pause);
    if (live_ && screen == Screen::practise) live_->command(LiveCommand::resume);
    SDL_PumpEvents();
    SDL_FlushEvent(SDL_MOUSEMOTION);
    screen_ = screen;
    tell_screen_ = true;
  }

  void carry_out(const Choice& choice) {
    switch (choice.what) {
      case Chosen::nothing:
        break;
      case Chosen::scene:
        try {
          open(scenes_[choice.scene].name);
          message_.clear();
        } catch (const InputError& error) { message_ = error.what(); }
        break;
      case Chosen::teach:
        open(first_stitch().scene, true);
        break;
      case Chosen::resume:
        go(Screen::practise);
        break;
      case Chosen::single_step:
        live_->command(LiveCommand::single_step);
        break;
      case Chosen::take_back:
        live_->command(LiveCommand::take_back);
        break;
      case Chosen::restart:
        if (live_) {
          live_->command(LiveCommand::restart);
          go(Screen::practise);
        } else {
          open(options_.scene.empty() || scene_.name != options_.scene ? scene_.name : options_.scene, lesson_.on());
        }
        break;
      case Chosen::finish:
        result_ = finish();  // the field stays in the picture, as it was left
        go(Screen::results);
        break;
      case Chosen::start_screen:
        finish();
        renderer_->stage(nullptr, settings_.quality);
        go(Screen::start);
        break;
      case Chosen::quit:
        quit_ = true;
        break;
    }
  }

  // --- a picture
  // ----------------------------------------------------------------------------------------------------------------
  bool frame(float dt) {
    const bool working = screen_ == Screen::practise;
    WindowInput in = events_in_.read(working, dt);
    quit_ = quit_ || in.quit;
    if (in.resized) resized();
    keys(in);
    if (in.left && screen_ == Screen::practise && options_.live.surgeon.empty()) go(Screen::pause);
    if (live_) field(in, dt);
    tell_screen();
    turn_orbit(orbit_, in.orbit_right, in.orbit_up, in.closer);
    if (in.camera_home && live_) orbit_set_ = false;

    Choice choice;
    Image copy;
    WindowRenderer::Frame frame;
    const bool seen = have_picture_ && (live_ || screen_ == Screen::results);
    frame.snapshot = seen ? &seen_ : nullptr;
    frame.camera = camera_of(orbit_);
    frame.suture_points = settings_.suture_points;
    frame.dt = dt;
    frame.panels = [&] { choice = panels(); };
    const bool last = !options_.screenshot.empty() && pictures_ + 1 >= options_.after;
    if (last || picture_wanted_) frame.copy = &copy;
    const bool drawn = renderer_->draw(frame);
    if (drawn) events_in_.panels_drawn();
    if (drawn && last) write_png(copy, options_.screenshot);
    if (drawn && std::exchange(picture_wanted_, false)) save_picture(copy);
    if (drawn && seen && live_) latency_.picture(live_->status());
    carry_out(choice);
    return drawn;
  }

  void save_picture(const Image& image) {
    std::string name;
    for (int i = 1; name.empty() || std::filesystem::exists(name); ++i) name = fmt::format("catgut_{}.png", i);
    LogLine line{seen_.time_s, "picture: " + name, false};
    try {
      write_png(image, name);
    } catch (const std::runtime_error& error) { line.text = error.what(), line.bad = true; }
    log_.push_back(line);
  }

  // Hands in, the field out.
  void field(const WindowInput& in, float dt) {
    have_picture_ = live_->look(seen_);
    if (have_picture_ && !std::exchange(orbit_set_, true)) orbit_ = start_orbit(live_->picture(), seen_.needle.pose.p);
    take_events();
    const LiveStatus& status = live_->status();
    if (status.epoch != epoch_) {
      epoch_ = status.epoch;
      if (status.practice.time_s > 0) resume_steering(steering_, seen_);
      else steering_ = start_steering(live_->picture(), settings_.left_handed);
      mouse_.was_down = false;
    }
    if (!status.fault.empty() && screen_ == Screen::practise) go(Screen::pause);
    if (lesson_.on() && lesson_.look(*live_, seen_, wall_seconds()) && events_)
      std::fprintf(events_, "{\"lesson\":\"%s\"}\n",
                   lesson_.all_done() ? "done" : lesson_.lesson().step[lesson_.step()].name.c_str());
    if (screen_ != Screen::practise || status.settling || !have_picture_ || !options_.live.surgeon.empty()) return;
    steering_.assist = settings_.assist;
    steering_.guide = next_bite(places_, live_->picture(), seen_);
    mouse_.hold_to_close = settings_.hold_to_close;
    if (in.speed >= 0) mouse_.speed = kMouseSpeeds[static_cast<size_t>(in.speed)];
    const Camera camera = camera_of(orbit_);
    const ViewFrame view = view_frame(camera.eye, camera.target, camera.up, camera.fov_deg, static_cast<float>(height_));
    std::array<HandMotion, 2> motion = mouse_motion(mouse_, steering_, in.mouse, view, dt);
    if (in.has_pad) {
      pad_.left_handed = settings_.left_handed;
      const std::array<HandMotion, 2> more = gamepad_motion(pad_, steering_, in.pad, dt);
      for (size_t k = 0; k < 2; ++k) {
        HandMotion &m = motion[k], n = more[k];
        m = {m.right + n.right, m.up + n.up,     m.ahead + n.ahead,        m.drive + n.drive, m.yaw + n.yaw,
             m.pitch + n.pitch, m.roll + n.roll, m.together || n.together, m.both + n.both};
      }
    }
    // One that comes back has nothing to say until its triggers move: what was held is held.
    if (!in.has_pad) pad_.trigger = {};
    if (in.moved_ns) moved_ns_ = in.moved_ns;
    const auto hands = steer(steering_, motion, view, live_->picture(), seen_, dt, moved_ns_);
    for (size_t k = 0; k < 2; ++k) live_->hand(k, hands[k]);
    if (options_.watch && !options_.watch({seen_, view, steering_, mouse_, status, lesson_})) quit_ = true;
  }

  void take_events() {
    if (!live_) return;
    for (Event e; live_->event(e);) {
      if (events_) std::fprintf(events_, "%s\n", event_json(e).c_str());
      if (options_.told) options_.told(e);
      if (lesson_.on()) lesson_.told(e);
      LogLine line;
      line.text = words_for(e, line.bad);
      line.time_s = static_cast<double>(e.tick) / static_cast<double>(scene_.solver.tick_rate);
      if (line.text.empty()) continue;
      log_.push_back(line);
      if (log_.size() > kLogLines) log_.pop_front();
    }
    if (events_) std::fflush(events_);
  }

  // Whoever follows the events also wants to know when hands are let in.
  void tell_screen() {
    if (!events_ || !tell_screen_ || (screen_ == Screen::practise && (!have_picture_ || live_->status().settling))) return;
    tell_screen_ = false;
    std::fprintf(events_, "{\"screen\":\"%s\"}\n", kScreenNames[static_cast<size_t>(screen_)]);
    std::fflush(events_);
  }

  void keys(const WindowInput& in) {
    const bool field = screen_ == Screen::practise || screen_ == Screen::pause;
    switch (in.key) {
      case Key::escape:
        if (screen_ == Screen::start) quit_ = true;
        else if (screen_ == Screen::practise) go(Screen::pause);
        else if (screen_ == Screen::pause) carry_out({live_->status().fault.empty() ? Chosen::resume : Chosen::nothing, 0});
        else carry_out({Chosen::start_screen, 0});
        break;
      case Key::pause:
        if (screen_ == Screen::practise) go(Screen::pause);
        else if (screen_ == Screen::pause && live_->status().fault.empty()) go(Screen::practise);
        break;
      case Key::enter:
        if (screen_ == Screen::results) carry_out({Chosen::restart, 0});
        else if (screen_ == Screen::start && !scenes_.empty()) carry_out({Chosen::scene, 0});
        break;
      case Key::digit:
        if (screen_ == Screen::start && in.digit <= static_cast<int>(scenes_.size()))
          carry_out({Chosen::scene, static_cast<size_t>(in.digit) - 1});
        break;
      case Key::single_step:
        if (screen_ == Screen::pause) carry_out({Chosen::single_step, 0});
        break;
      case Key::take_back:
        if (field) carry_out({Chosen::take_back, 0});
        break;
      case Key::restart:
        if (field) carry_out({Chosen::restart, 0});
        break;
      case Key::finish:
        if (field) carry_out({Chosen::finish, 0});
        break;
      case Key::slower:
        if (field) live_->command(LiveCommand::slower);
        break;
      case Key::faster:
        if (field) live_->command(LiveCommand::faster);
        break;
      case Key::points:
        settings_.suture_points = !settings_.suture_points;
        break;
      case Key::hints:
        settings_.hints = !settings_.hints;
        break;
      case Key::help_at_needle:
        settings_.assist = !settings_.assist;
        break;
      case Key::picture:
        picture_wanted_ = true;
        break;
      case Key::show_me:
        if (screen_ == Screen::practise && live_) show_me();
        break;
      case Key::teach:
        if (screen_ == Screen::start) carry_out({Chosen::teach, 0});
        break;
      case Key::none:
        break;
    }
  }

  Choice panels() {
    WorkView view{&scene_,
                  live_ ? &live_->status() : nullptr,
                  &seen_,
                  &steering_,
                  &mouse_,
                  &log_,
                  events_in_.pad_name(),
                  picture_count_ / std::max(picture_s_, 1e-3)};
    if (screen_ == Screen::start) return start_panel(scenes_, settings_, message_);
    if (screen_ == Screen::results) return result_panel(scene_, result_.practice, result_.recorded, result_.fault);
    if (have_picture_) work_panel(view, settings_);
    if (have_picture_ && live_ && !live_->status().settling) guidance();
    if (screen_ == Screen::pause) return pause_panel(view, settings_);
    return {};
  }

  void show_me() {
    const bool was = lesson_.showing();
    lesson_.show(*live_);
    if (events_ && !was && lesson_.showing())
      std::fprintf(events_, "{\"shows\":\"%s\"}\n", lesson_.lesson().step[lesson_.step()].name.c_str());
  }

  // What is shown of how it should be done, as far as somebody wants it.
  void guidance() {
    const Guidance level = settings_.guidance;
    if (lesson_.on()) lesson_panel(lesson_, level != Guidance::none);
    if (level != Guidance::full || !options_.live.surgeon.empty()) return;
    if (const auto guide = next_bite(places_, live_->picture(), seen_)) {
      const Camera c = camera_of(orbit_);
      const float w = static_cast<float>(width_), h = static_cast<float>(height_);
      guide_overlay(*guide, view_frame(c.eye, c.target, c.up, c.fov_deg, h), live_->picture(), seen_, w, h);
    }
  }

  void resized() {
    SDL_GetWindowSize(sdl_.window, &width_, &height_);
    renderer_->resize(width_, height_);
    style_panels(std::clamp(static_cast<float>(height_) / 720, 0.7f, 2.0f));
  }

  // A machine without a graphics card: fewer points rather than fewer pictures, as long as the low quality was asked for.
  void coarser_if_slow() {
    const float least = std::clamp(180.0f / static_cast<float>(height_), 0.25f, 1.0f);
    if (!live_ || settings_.quality != Quality::draft || coarse_ <= least) return;
    if (++pictures_so_ < 12 || picture_s_ < picture_count_ * kSlowPicture) return;
    coarse_ = std::max(least, 0.7f * coarse_);
    renderer_->draw_coarser(coarse_);
    pictures_so_ = 0;
    picture_s_ = picture_count_ = 0;
  }

  const PlayOptions& options_;
  SdlWindow sdl_;
  int width_, height_;
  std::unique_ptr<WindowRenderer> renderer_;
  WindowEvents events_in_;
  Settings settings_;
  std::vector<SceneChoice> scenes_;
  std::string message_;
  Screen screen_ = Screen::start;
  bool tell_screen_ = true, picture_wanted_ = false, quit_ = false, have_picture_ = false;
  SceneSpec scene_;
  std::unique_ptr<Live> live_;
  int opened_ = 0;
  LiveResult result_;
  Snapshot seen_;
  BitePlaces places_;
  LessonRun lesson_;
  Steering steering_;
  MouseHand mouse_;
  GamepadHand pad_;
  Orbit orbit_;
  bool orbit_set_ = false;  // false: chosen anew with the next snapshot
  std::deque<LogLine> log_;
  uint32_t epoch_ = 0;
  uint64_t moved_ns_ = 0;
  Latency latency_;
  double picture_s_ = 0, picture_count_ = 0;  // lately
  float coarse_ = 1;                          // of the window's pixels each way
  int pictures_so_ = 0;                       // since that was last changed
  int pictures_ = 0;
  std::FILE* events_ = nullptr;
};

}  // namespace

int play(const PlayOptions& options) { return Window(options).loop(); }

}  // namespace catgut
