// SPDX-License-Identifier: Apache-2.0
// app/window: the main loop: events, hands, one frame; and the execution of choices. Physics has its own
// thread (runtime/live, runtime/playback) and never waits for this one.
#include "window/window.h"

#include <SDL.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "commands/commands.h"
#include "core/check.h"
#include "core/data.h"
#include "device/tray.h"
#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "render/orbit.h"
#include "render/quality.h"
#include "render/window.h"
#include "runtime/assessment.h"
#include "runtime/guide.h"
#include "runtime/report.h"
#include "runtime/session_log.h"
#include "sim/simulation.h"
#include "technique/technique.h"
#include "window/data_folder.h"
#include "window/guide_overlay.h"
#include "window/hands.h"
#include "window/input.h"
#include "window/language.h"
#include "window/latency.h"
#include "window/panels.h"
#include "window/sdl_window.h"
#include "window/sound.h"
#include "window/stitch_labels.h"
#include "window/visit.h"
#include "window/widgets.h"
#include "window/work_text.h"
#include "xr/wearer.h"

namespace catgut {
namespace {

constexpr const char* kFont = "fonts/truetype/dejavu/DejaVuSansMono.ttf";  // in a share folder
constexpr double kMostPictures = 150;                                      // [1/s]
constexpr double kSlowPicture = 0.08;                                      // [s] a slower frame reduces the resolution
constexpr double kQuickPicture = 0.045;  // [s] a faster one raises it: a step costs less than 1.6 times
constexpr std::array<float, 5> kResolutions{1, 0.6f, 0.45f, 0.35f,
                                            0.25f};  // 0.7 would need post-processing, so it costs as much as 1
constexpr double kFarTooSlow = 0.25;                 // [s] reduces it by half, without a long look
constexpr double kMirrorEvery = 1.0 / 20;            // [s] of the window's picture beside a headset
constexpr double kSlowMirror = 0.5;                  // [s] where the headset's frames take their whole period
constexpr double kStallEvery = 2;                    // [s] of --stall-ms
constexpr double kBeforeMoment = 3;                  // [s] that are played before the moment of a lost point

bool has_procedure(const std::string& name) {
  const std::vector<std::string> names = procedure_names();
  return std::find(names.begin(), names.end(), name) != names.end();
}

// The procedure of a scene in the list: the one of its name, or the first lesson; empty: none.
std::string procedure_for(const std::string& scene) {
  for (const std::string& name : {scene, std::string(kFirstLesson)})
    if (has_procedure(name) && read_procedure(name).scene == scene) return name;
  return "";
}

std::vector<SceneChoice> scene_choices() {
  // The first lesson's; the scene of each technique, simplest first; then all others.
  std::vector<std::string> names = scene_names();
  const std::string first = has_procedure(kFirstLesson) ? read_procedure(kFirstLesson).scene : "";
  const auto rank = [&](const std::string& name) {
    const auto all = techniques();
    return name == first ? -1 : std::find(all.begin(), all.end(), find_technique(name)) - all.begin();
  };
  std::stable_sort(names.begin(), names.end(), [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  std::vector<SceneChoice> out;
  for (const std::string& name : names) {
    const SceneSpec scene = read_scene(name);
    const TechniqueRow* technique = find_technique(scene.technique.name);
    std::string body;
    for (const BodySpec& b : scene.body) body += (body.empty() ? "" : " and ") + b.name;
    out.push_back({name, scene.title, technique ? technique->title : "", body});
  }
  return out;
}

// NAME.EXT, NAME_visit2.EXT, ...: every session has its own files.
std::string of_visit(const std::string& path, int visit) {
  if (path.empty() || visit < 2) return path;
  const std::filesystem::path p(path);
  return (p.parent_path() / (p.stem().string() + fmt::format("_visit{}", visit) + p.extension().string())).string();
}

// Unused file name in the data folder, or in the working directory if there is none.
std::string free_name(const Settings& settings, const char* pattern) {
  const std::string folder = data_folder(settings);
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  std::string name;
  for (int i = 1; name.empty() || std::filesystem::exists(name, error); ++i)
    name = (folder.empty() ? "" : folder + "/") + fmt::format(fmt::runtime(pattern), i);
  return name;
}

// Expands a path from the user.
std::string short_name(const std::string& path) {
  const char* home = std::getenv("HOME");
  const std::string start = home && home[0] ? std::string(home) + "/" : "";
  return !start.empty() && path.rfind(start, 0) == 0 ? "~/" + path.substr(start.size()) : path;
}

// Measures rendering speed on the default scene.
Quality measured_quality(int width, int height) {
  std::fprintf(stderr, "catgut: first start: measuring graphics speed, a few seconds\n");
  const auto model = build_model(read_scene("purse_string"));
  Snapshot seen;
  publish(*model, *initial_state(*model), seen);
  return choose_quality(picture_model(*model), seen, width, height).quality;
}

class Window {
 public:
  explicit Window(const PlayOptions& options)
      : options_(options), sdl_(options.width, options.height, options.kiosk), width_(options.width), height_(options.height) {
    LoadedSettings loaded = load_settings(settings_path());
    if (loaded.first && !options.quality_given && options.scene.empty() && options.view.empty() && options.screenshot.empty()) {
      loaded.settings.quality = measured_quality(width_, height_);
      try {
        if (!settings_path().empty()) save_settings(loaded.settings, settings_path());
      } catch (const InputError& error) { loaded.fault = error.what(); }
    }
    try {
      renderer_ = make_window_renderer(sdl_.number, width_, height_, shared_path(kFont));
    } catch (const std::runtime_error& error) { throw InputError("window", error.what(), kHeadless); }
    if (!loaded.fault.empty()) std::fprintf(stderr, "catgut: %s\n", loaded.fault.c_str());
    message_ = loaded.fault;
    kept_ = settings_ = loaded.settings;
    if (options.quality_given) settings_.quality = options.quality;
    if (options.left_handed) settings_.left_handed = true;
    if (options.exam) settings_.guidance = Guidance::exam;
    if (!options.trainee.empty()) settings_.trainee = options.trainee;
    if (!options.survey.empty()) settings_.survey = options.survey;
    for (const FeedbackLevel level : {FeedbackLevel::silent, FeedbackLevel::stitch, FeedbackLevel::live})
      if (options.feedback == feedback_name(level)) settings_.feedback = level;
    at_start_ = settings_;
    scenes_ = scene_choices();
    use_language(settings_.language);
    list_recordings();
    if (!options.events.empty()) {
      events_ = options.events == "-" ? stdout : std::fopen(options.events.c_str(), "w");
      if (!events_) throw InputError(options.events, "cannot be written", "choose another place");
    }
    resized();
    headset_offered_ = xr::headset_offered();
    if (options.headset) wear();
  }
  ~Window() {
    if (events_ && events_ != stdout) std::fclose(events_);
  }
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  int loop() {
    if (!options_.procedure.empty()) open(options_.scene, options_.procedure, options_.stage, options_.tutorial);
    else if (!options_.scene.empty()) open(options_.scene);
    if (!options_.view.empty()) view(options_.view);
    const double start = wall_seconds();
    double last = start, drawn_at = start, stalled = start;
    const std::atomic<bool>& stop = stop_on_interrupt();
    while (!quit_ && !stop) {
      const double now = wall_seconds();
      const float dt = static_cast<float>(std::clamp(now - last, 1e-3, 0.25));
      last = now;
      if (options_.seconds > 0 && now - start > options_.seconds) break;
      if (options_.stall_ms > 0 && now - stalled > kStallEvery) {
        SDL_Delay(static_cast<uint32_t>(options_.stall_ms));
        stalled = wall_seconds();
      }
      if (frame(dt)) {
        ++pictures_;
        if (options_.on_frame && !options_.on_frame(screen_name(screen_))) break;
        const double drawn = wall_seconds(), keep = std::exp(-(drawn - drawn_at));
        picture_s_ = picture_s_ * keep + (drawn - drawn_at);
        picture_count_ = picture_count_ * keep + 1;
        drawn_at = drawn;
        fit_resolution();
        // Without vertical synchronization a limit is needed, or rendering would take the processor from the physics.
        const double left = 1.0 / kMostPictures - (drawn - now);
        if (left > 0 && !worn_) SDL_Delay(static_cast<uint32_t>(1000 * left));
      } else if (!worn_) {  // a headset's runtime sets the pace
        SDL_Delay(1);       // the driver is behind: hands continue, and the processor is free for it
      }
      if (photographed_) break;
    }
    LiveResult result;
    if (visit_) result = finish();
    keep_settings();
    if (options_.seconds > 0 || !options_.screenshot.empty()) latency_.report(pictures_, wall_seconds() - start);
    if (wearer_ && options_.seconds > 0) wearer_->report_budget();
    if (!json_fault_.empty()) throw InputError(options_.json, json_fault_, "choose another place");
    if (!result.fault.empty()) throw InputError("simulation", result.fault, "the recording holds what went before");
    return stop ? 130 : 0;
  }

 private:
  // Connects to a headset. What it reports is printed, and shown on the start screen.
  void wear() {
    xr::WearerOptions wear;
    wear.font = shared_path(kFont);
    wear.hands = space_hands();
    if (const std::string path = settings_path(); !path.empty())
      wear.room_file = (std::filesystem::path(path).parent_path() / "rooms.toml").string();
    wear.whole_resolution = options_.eye_pictures;
    wear.room = options_.room;
    wear.register_arms = options_.register_arms;
    wear.report = [this](const std::string& line) {
      std::fprintf(stderr, "catgut: %s\n", line.c_str());
      headset_line_ = line;
    };
    headset_line_.clear();
    board_styled_ = false;
    wearer_.reset();
    wearer_ = std::make_unique<xr::Wearer>(wear);
  }

  // --- scenes and recordings
  // -----------------------------------------------------------------------------------------------------------------
  void open(const std::string& name, const std::string& procedure = "", const std::string& stage = "", bool tutorial = false) {
    LiveOptions live = options_.live;
    std::shared_ptr<const Procedure> wanted;
    if (!procedure.empty()) wanted = std::make_shared<const Procedure>(read_procedure(procedure));
    const SceneSpec scene = wanted ? scene_of(*wanted) : read_scene(name);
    live.procedure = wanted;
    if (!stage.empty()) live.stage = find_stage(*wanted, stage, "--stage");
    if (settings_.left_handed) live.arm_hand = {1, 0};
    live.arm_strength = {settings_.force_right, settings_.force_left};
    live.record = of_visit(live.record, ++opened_);
    kept_session_.clear();
    const bool watched = !live.surgeon.empty() || (watch_ && !tutorial);
    if (live.record.empty() && options_.keep_sessions && !watched) try {
        live.record = kept_session_ = session_file(data_folder(settings_), scene.name);
        live.record_at_once = settings_.record, live.record_or_stop = false;
      } catch (const InputError& error) { message_ = error.what(); }
    if (live.surgeon.empty() && watch_ && !tutorial) live.surgeon = "scripted";
    live.tutorial = tutorial && live.surgeon.empty();
    live.rubric = rubrics_for("", scene);
    live.remarks = true;  // they are shown as far as the settings want them
    leave();
    live.hands = hands_.begin(scene, settings_);
    visit_ = std::make_unique<Visit>(scene, live, events_, [this](const Event& e) {
      if (options_.on_event) options_.on_event(e);
      if (wearer_) wearer_->feel(e);
    });
    procedure_ = wanted;
    tutorial_ = live.tutorial;
    source_ = {name, procedure, stage, tutorial};
    places_ = bite_places(scene, visit_->live.picture());
    line_ = PlannedLine(scene, visit_->live.picture());
    hands_.steering = start_steering(visit_->live.picture(), settings_.left_handed);
    cue_source_ = assess::cue_source(visit_->live.picture(), assess_setup(scene).wall);
    rubric_ = live.rubric;
    asked_ = false;
    shown_stage_ = 0;
    used_keys_ = {};
    stage_picture(visit_->live.picture());
    go(Screen::practice);
  }

  void view(const std::string& path) {
    auto next = std::make_unique<Viewing>(path);
    leave();
    viewing_ = std::move(next);
    viewing_->playback.play(options_.screen.empty());
    stage_picture(viewing_->playback.picture());
    go(Screen::view);
  }

  void stage_picture(const PictureModel& picture) {
    renderer_->stage(&picture, settings_.quality);
    if (wearer_) wearer_->stage(&picture, settings_.quality);
    rest_ = rest_tissue(picture);
    staged_ = settings_.quality;
    if (coarse_ < 1 && staged_ == Quality::low) renderer_->set_resolution_scale(coarse_);
    orbit_set_ = false;
    have_last_ = false;
  }

  // Another quality shows with the next frame, behind the settings; the camera stays.
  void restage_if_changed() {
    if (!(visit_ || viewing_) || staged_ == settings_.quality) return;
    const bool set = orbit_set_;
    stage_picture(picture());
    orbit_set_ = set;
    pictures_so_ = 0;
    picture_s_ = picture_count_ = 0;
  }

  // Closes the open scene or recording.
  void leave() {
    if (visit_) finish();
    if (results_.from_recording) results_ = {};
    viewing_.reset();
  }

  LiveResult finish() {
    const bool have = visit_->have;
    LiveResult result = visit_->finish();
    made_.insert(made_.end(), result.recorded.begin(), result.recorded.end());
    // A look round is not a session: without a stitch it counts only when the user asks for the results.
    const bool counts = !visit_->watching && (asked_for_results_ || !result.assessment.bite.empty());
    KeepOptions keep{counts ? settings_.trainee : "", options_.store,
                     source_.procedure.empty() ? visit_->scene.name : source_.procedure, settings_json()};
    const KeptSession kept = keep_session(result, keep);
    if (kept.bad) std::fprintf(stderr, "catgut: %s\n", kept.line.c_str());
    if (!options_.json.empty()) try {
        const std::string json = session_json(visit_->scene, result);
        write_output(of_visit(options_.json, opened_), procedure_ ? with_procedure(json, *procedure_, result.procedure) : json);
      } catch (const InputError& error) { message_ = json_fault_ = error.what(); }
    if (!options_.csv.empty()) try {
        write_output(of_visit(options_.csv, opened_), session_csv(result));
      } catch (const InputError& error) { message_ = json_fault_ = error.what(); }
    if (!kept_session_.empty() && !result.recorded.empty()) try {
        const std::string json = session_json(visit_->scene, result);
        keep_session(kept_session_, result, procedure_ ? with_procedure(json, *procedure_, result.procedure) : json);
      } catch (const InputError& error) { message_ = error.what(); }
    scene_ = visit_->scene;
    result_ = result;
    results_ = {&scene_,
                &result_,
                event_log(result.map),
                procedure_.get(),
                "",
                false,
                1,
                kept,
                can_keep() && !settings_.survey.empty()};
    std::swap(last_, visit_->seen);
    have_last_ = have;
    visit_.reset();
    pen_sound_.set(PenMode::off);
    pedal_ = PenMode::off;
    return result;
  }

  // How the session was done, for the store.
  std::string settings_json() const {
    const bool exam = settings_.guidance == Guidance::exam;
    return fmt::format(R"({{"guidance":"{}","feedback":"{}","hands":"{}","assist":{},"left_handed":{}}})",
                       guidance_name(settings_.guidance), exam ? "silent" : feedback_name(settings_.feedback),
                       options_.headset                ? "headset"
                       : options_.live.haptics.empty() ? "mouse"
                                                       : options_.live.haptics,
                       settings_.assist, settings_.left_handed);
  }

  // Of a recording of the session just finished.
  uint64_t first_tick_of(const std::string& file) const {
    for (size_t k = 0; k < result_.recorded.size() && k < result_.recorded_from.size(); ++k)
      if (result_.recorded[k] == file) return result_.recorded_from[k];
    return 0;
  }

  void go(Screen screen) {
    // During a session the mouse is a hand, not a pointer; motion before the change is discarded.
    SDL_SetRelativeMouseMode(screen == Screen::practice && visit_ && !visit_->watching ? SDL_TRUE : SDL_FALSE);
    if (visit_) visit_->live.command(screen == Screen::practice ? LiveCommand::resume : LiveCommand::pause);
    SDL_PumpEvents();
    SDL_FlushEvent(SDL_MOUSEMOTION);
    if (screen == Screen::start) list_recordings();
    keep_settings();
    screen_ = screen;
    tell_screen_ = true;
  }

  void list_recordings() {
    recordings_ = recordings_in(".", made_);
    if (options_.keep_sessions) recordings_ = recordings_in(data_folder(settings_), recordings_);
  }

  void show_start() {
    leave();
    renderer_->stage(nullptr, settings_.quality);
    if (wearer_) wearer_->stage(nullptr, settings_.quality);
    have_last_ = false;
    go(Screen::start);
  }

  void keep_settings() {
    if (settings_ == at_start_) return;
    at_start_ = settings_;
    use_language(settings_.language);
    Settings s = settings_;  // options of the command line apply only to this run
    if (options_.quality_given && s.quality == options_.quality) s.quality = kept_.quality;
    if (options_.left_handed && s.left_handed) s.left_handed = kept_.left_handed;
    if (options_.exam && s.guidance == Guidance::exam) s.guidance = kept_.guidance;
    if (!options_.trainee.empty() && s.trainee == options_.trainee) s.trainee = kept_.trainee;
    if (!options_.survey.empty() && s.survey == options_.survey) s.survey = kept_.survey;
    if (options_.feedback == feedback_name(s.feedback)) s.feedback = kept_.feedback;
    try {
      save_settings(s, settings_path());
      message_.clear();
    } catch (const InputError& error) { message_ = error.what(); }
  }

  void carry_out(const Choice& choice) {
    try {
      do_it(choice);
    } catch (const InputError& error) {  // shown on the next screen
      message_ = error.what();
      if (!visit_ && !viewing_) show_start();
    }
  }

  void do_it(const Choice& choice) {
    Live* live = visit_ ? &visit_->live : nullptr;
    switch (choice.what) {
      case Chosen::nothing:
        break;
      case Chosen::scene:
        open(scenes_[choice.which].name, procedure_for(scenes_[choice.which].name));
        message_.clear();
        break;
      case Chosen::teach:
        open("", kLessons[choice.which], "", true);
        message_.clear();
        break;
      case Chosen::show_me:
        if (live && tutorial_)
          live->command(live->status().demonstrating ? LiveCommand::end_demonstration : LiveCommand::show_stage);
        break;
      case Chosen::begin_stage:
        if (live) live->command(LiveCommand::begin_stage);
        break;
      case Chosen::recording:
        view(choice.text);
        message_.clear();
        break;
      case Chosen::settings:
        if (options_.kiosk) break;
        settings_from_ = screen_;
        go(Screen::settings);
        break;
      case Chosen::leave_settings:
        go(settings_from_);
        break;
      case Chosen::resume:
        go(Screen::practice);
        break;
      case Chosen::pause:
        go(Screen::pause);
        break;
      case Chosen::single_step:
        if (live) live->command(LiveCommand::single_step);
        break;
      case Chosen::take_back:
        if (live) live->command(LiveCommand::take_back);
        break;
      case Chosen::restart:
        if (live) {
          live->command(LiveCommand::restart);
          go(Screen::practice);
        } else {
          open(source_.scene, source_.procedure, source_.stage, source_.tutorial);
        }
        break;
      case Chosen::finish:
        asked_for_results_ = true;
        finish();  // the field stays visible as it was left
        asked_for_results_ = false;
        go(Screen::results);
        break;
      case Chosen::slower:
      case Chosen::faster:
        if (live) live->command(choice.what == Chosen::slower ? LiveCommand::slower : LiveCommand::faster);
        else if (viewing_) viewing_->change_speed(choice.what == Chosen::faster);
        break;
      case Chosen::start_screen:
        if (viewing_ && std::exchange(back_to_results_, false)) {  // from a lost point's moment
          leave();
          renderer_->stage(nullptr, settings_.quality);
          if (wearer_) wearer_->stage(nullptr, settings_.quality);
          go(Screen::results);
          break;
        }
        show_start();
        break;
      case Chosen::save_json:
        if (results_.known < 1) {  // a file with partial results would look complete
          results_.saved = "Not saved: analysis not finished";
          break;
        }
        try {
          const std::string name = free_name(settings_, "catgut_result_{}.json");
          write_output(name, session_json(scene_, *results_.result));
          results_.saved = "Saved: " + short_name(name);
        } catch (const InputError& error) { results_.saved = error.what(); }
        break;
      case Chosen::change:
        if (!live) break;
        set_value(visit_->scene, choice.text, "change");
        live->change(choice.text);
        break;
      case Chosen::play_or_hold:
        if (!viewing_) break;
        if (viewing_->playback.status().at == viewing_->playback.status().ticks) viewing_->playback.go_to(0);
        viewing_->playback.play(!viewing_->playback.status().playing);
        break;
      case Chosen::go_to:
        if (viewing_) viewing_->playback.go_to(choice.which);
        break;
      case Chosen::go_by:
        if (viewing_) viewing_->go_by(choice.by);
        break;
      case Chosen::speed:
        if (viewing_) viewing_->playback.speed(choice.of);
        break;
      case Chosen::sewn:
        if (!viewing_) break;
        viewing_->playback.play(false);
        back_to_results_ = false;
        scene_ = viewing_->playback.scene();
        results_ = {&scene_, &viewing_->result, event_log(viewing_->result.map), nullptr, "", true, 0};
        go(Screen::results);
        break;
      case Chosen::moment: {
        view(choice.text);
        const PlaybackStatus& s = viewing_->playback.status();
        const auto before = static_cast<uint64_t>(std::llround(kBeforeMoment / s.tick_s));
        const uint64_t from = first_tick_of(choice.text);
        viewing_->playback.go_to(choice.which > from + before ? choice.which - from - before : 0);
        viewing_->playback.play(true);
        back_to_results_ = true;
        break;
      }
      case Chosen::survey:
        form_ = open_survey(settings_.survey);
        message_.clear();
        go(Screen::survey);
        break;
      case Chosen::keep_answers:
        keep_answers(form_, settings_.trainee, options_.store);
        asked_ = true;
        results_.can_answer = false;
        results_.saved = "The answers are stored";
        go(Screen::results);
        break;
      case Chosen::leave_survey:
        asked_ = true;
        go(Screen::results);
        break;
      case Chosen::leave_results:
        if (results_.can_answer && !std::exchange(asked_, true)) {  // once, before the results are left
          do_it({Chosen::survey});
          break;
        }
        if (results_.from_recording) go(Screen::view);
        else show_start();
        break;
      case Chosen::points:
        settings_.suture_points = !settings_.suture_points;
        break;
      case Chosen::hints:
        settings_.hints = !settings_.hints;
        break;
      case Chosen::help_at_needle:
        settings_.assist = !settings_.assist;
        break;
      case Chosen::next_instrument:
        instrument(next_from_tray(visit_->seen, hand_meant(choice.which)));
        break;
      case Chosen::park:
        instrument(park_or_take_up(visit_->seen, hand_meant(choice.which)));
        break;
      case Chosen::record:
        if (live) live->command(LiveCommand::record);
        break;
      case Chosen::arms_off:
        if (live) live->command(LiveCommand::arms_off);
        break;
      case Chosen::developer:
        developer_ = !developer_;
        break;
      case Chosen::headset:
        if (!wearer_ || wearer_->failed()) {
          wear();
        } else {
          wearer_.reset();
          worn_ = false;
          headset_line_.clear();
        }
        break;
      case Chosen::picture:
        picture_wanted_ = true;
        break;
      case Chosen::quit:
        if (options_.kiosk) show_start();
        else quit_ = true;
        break;
    }
  }

  // --- a picture
  // ----------------------------------------------------------------------------------------------------------------
  bool frame(float dt) {
    worn_ = wearer_ && wearer_->begin();
    const bool working = screen_ == Screen::practice;
    const WindowInput in = events_in_.read(working, dt, screen_ == Screen::view || (working && visit_ && visit_->watching));
    quit_ = quit_ || (options_.kiosk ? leaves_kiosk() : in.quit);
    if (in.any) active_s_ = wall_seconds();
    if (options_.kiosk && screen_ != Screen::start && wall_seconds() - active_s_ > options_.idle_s) show_start();
    if (in.resized) resized();
    ScreenFacts facts;
    facts.screen = screen_;
    facts.fault = visit_ && !visit_->live.status().fault.empty();
    facts.reading = reading();
    facts.scenes = scenes_.size();
    facts.from_recording = results_.from_recording;
    if (viewing_) facts.second = std::max<int64_t>(1, std::llround(1 / viewing_->playback.status().tick_s));
    carry_out(choice_of_key(in, facts));
    if (wearer_) wishes();
    // The wearer of a headset does not need the window's focus, also while the session starts.
    if (((in.left && !(wearer_ && wearer_->state() != xr::HeadsetState::off)) || in.pad_gone) && screen_ == Screen::practice &&
        visit_ && !visit_->watching)
      go(Screen::pause);
    if (visit_) field(in, dt);
    if (viewing_) {
      const uint64_t known = viewing_->gathered;
      viewing_->look();
      if (results_.from_recording && known != viewing_->gathered) results_.log = event_log(viewing_->result.map);
      const PlaybackStatus& s = viewing_->playback.status();
      const bool whole = s.known >= s.ticks || !s.fault.empty();
      results_.known = whole ? 1 : static_cast<float>(s.known) / static_cast<float>(s.ticks);
    }
    const Snapshot* seen = shown();
    if (seen && !std::exchange(orbit_set_, true)) orbit_ = start_orbit(picture(), seen->active().needle.pose.p);
    pose_for_picture();
    seen = shown();  // a screen that has just been left took its snapshot along
    tell_screen();
    turn_orbit(orbit_, screen_ == Screen::view && in.arrow_presses ? 0 : in.orbit_right, in.orbit_up, in.closer);
    if (in.camera_home && (visit_ || viewing_)) orbit_set_ = false;

    restage_if_changed();
    Choice choice;
    Image copy;
    WindowRenderer::Frame frame;
    frame.snapshot = seen;
    frame.camera = camera_of(orbit_);
    frame.suture_points = settings_.suture_points || (visit_ && settings_.guidance == Guidance::learn);
    frame.dt = dt;
    frame.panels = [&] { choice = panels(); };
    inset_drawn_ = inset_ && seen && visit_ && screen_ == Screen::practice;
    if (inset_drawn_) magnify(*seen, frame);
    const bool last = !options_.screenshot.empty() && posed_ && posed_for_ + 1 >= options_.after;
    if (last || picture_wanted_) frame.copy = &copy;
    if (worn_) {
      Choice pointed;
      draw_eyes(seen, pointed);
      if (pointed.what != Chosen::nothing) choice = pointed;
    }
    // The window mirrors what the wearer sees, at a lower rate: its picture must not delay the headset's.
    const double now = wall_seconds();
    const double every = worn_ && wearer_->busy() ? kSlowMirror : kMirrorEvery;
    const bool skip = worn_ && !frame.copy && now - mirrored_ < every;
    if (worn_ && !skip) {
      mirrored_ = now;
      if (const auto camera = wearer_->mirror(); camera && seen) frame.camera = *camera;
    }
    const Choice by_ray = choice;
    const bool drawn = skip ? false : renderer_->draw(frame);
    if (choice.what == Chosen::nothing) choice = by_ray;
    if (drawn) events_in_.panels_drawn(), posed_for_ += posed_;
    if (drawn && last) write_png(copy, options_.screenshot), photographed_ = true;
    if (drawn && std::exchange(picture_wanted_, false)) save_picture(copy);
    if (drawn && seen && visit_) latency_.picture(visit_->live.status());
    const float text_size = settings_.text_size;
    carry_out(choice);
    if (text_size != style_text_) resized();
    return drawn;
  }

  static bool leaves_kiosk() {
    const SDL_Keymod held = SDL_GetModState();
    return (held & KMOD_CTRL) && (held & KMOD_SHIFT) && SDL_GetKeyboardState(nullptr)[SDL_SCANCODE_Q];
  }

  // Buttons of the headset's wearer.
  void wishes() {
    const xr::WearerWish wish = wearer_->wish();
    const bool fault = visit_ && !visit_->live.status().fault.empty();
    if (wish.pause && screen_ == Screen::practice && reading()) visit_->live.command(LiveCommand::begin_stage);
    else if (wish.pause && screen_ == Screen::practice) go(Screen::pause);
    else if (wish.pause && screen_ == Screen::pause && !fault) go(Screen::practice);
    for (size_t k = 0; k < 2 && screen_ == Screen::practice && visit_ && visit_->have; ++k)
      if (wish.swap[k]) instrument(next_from_tray(visit_->seen, k));
  }

  xr::SpaceHandOptions space_hands() const { return {settings_.left_handed, settings_.steady_hands, settings_.hand_scale}; }

  void draw_eyes(const Snapshot* seen, Choice& pointed) {
    xr::Wearer::Picture eyes;
    eyes.snapshot = seen;
    eyes.working = screen_ == Screen::practice;
    eyes.walk = screen_ == Screen::results || screen_ == Screen::view;
    eyes.suture_points = settings_.suture_points || (visit_ && settings_.guidance == Guidance::learn) || eyes.walk;
    for (const PlacedPanel& p : board_placed_)  // as drawn last
      if (eyes.working && p.name == "procedure") eyes.caption = {p.rect.x, p.rect.y, p.rect.x + p.rect.w, p.rect.y + p.rect.h};
    std::vector<xr::StitchMark> stitch;
    const LiveResult* result = screen_ == Screen::results ? results_.result : viewing_ ? &viewing_->result : nullptr;
    if (eyes.walk && seen && result) stitch = stitch_marks(result->map, rest_, *seen, colored_by_);
    eyes.stitch = stitch;
    eyes.panels = [&] {
      if (!std::exchange(board_styled_, true)) style_panels(1.4f);
      on_board_ = true;
      pointed = panels();
      on_board_ = false;
    };
    eyes.status = visit_ ? &visit_->live.status() : nullptr;
    eyes.copy = options_.eye_pictures;
    wearer_->draw(eyes);
    if (options_.watch_eyes) options_.watch_eyes(wearer_->look());
  }

  const Snapshot* shown() const {
    if (visit_) return visit_->have ? &visit_->seen : nullptr;
    if (viewing_) return viewing_->have ? &viewing_->seen : nullptr;
    return have_last_ && screen_ == Screen::results ? &last_ : nullptr;
  }
  const PictureModel& picture() const { return visit_ ? visit_->live.picture() : viewing_->playback.picture(); }

  void save_picture(const Image& image) {
    const std::string name = free_name(settings_, "catgut_{}.png");
    LogLine line{visit_ ? visit_->seen.time_s : 0, "screenshot: " + short_name(name), false};
    try {
      write_png(image, name);
    } catch (const std::runtime_error& error) { line.text = error.what(), line.bad = true; }
    if (visit_) visit_->log.push_back(line);
    else std::fprintf(stderr, "catgut: %s\n", line.text.c_str());
  }

  // Of a key that is reported once: the hand of the mouse. Of a gamepad's button: the second hand with the shoulder above its
  // stick, else the first.
  size_t hand_meant(size_t digit) const {
    if (!(digit & kFromPad)) return hands_.mouse.active;
    return digit & (settings_.left_handed ? kRightShoulder : kLeftShoulder) ? 1 : 0;
  }

  // A pedal switches the pen, in whichever hand it is.
  void use_pedal(PenMode wanted) {
    if (std::exchange(pedal_, wanted) == wanted) return;
    for (size_t k = 0; k < 2; ++k) {
      const int i = visit_->seen.tool[k].instrument;
      if (i >= 0 && visit_->live.picture().instrument[static_cast<size_t>(i)].can(kCauterize))
        instrument({CommandKind::set_pen, static_cast<uint8_t>(k), static_cast<uint16_t>(wanted)});
    }
  }

  // An assistant's hands on the clamps of the fixed ends, for one tick.
  void move_clamps(int way) {
    if (way == 0 || !joins_clamped_ends(visit_->scene)) return;
    for (uint16_t body = 0; body < visit_->scene.body.size(); ++body)
      instrument({way > 0 ? CommandKind::advance_clamp : CommandKind::pull_clamp, kMaxHands - 1, body});
  }

  // Silent while time stands still.
  void sound_pen() {
    PenMode mode = PenMode::off;
    if (screen_ == Screen::practice && !reading())
      for (const InstrumentView& i : visit_->seen.instrument) mode = std::max(mode, i.pen);
    if (mode != PenMode::off && options_.sound && settings_.sound) pen_sound_.open();
    pen_sound_.set(options_.sound && settings_.sound ? mode : PenMode::off);
  }

  void instrument(const Command& command) {
    if (command.kind != CommandKind::none) visit_->live.instrument(command);
  }

  // Publishes the hands, fetches the picture.
  void field(const WindowInput& in, float dt) {
    Visit& v = *visit_;
    v.live.watch(developer_);
    if (worn_) v.look(wearer_->moment());
    else v.look();
    const LiveStatus& status = v.live.status();
    if (status.epoch != v.epoch) {
      v.epoch = status.epoch;
      hands_.jumped();
      if (wearer_) wearer_->jumped(v.seen);
    }
    if (!status.fault.empty() && screen_ == Screen::practice) go(Screen::pause);
    report_stage(status);
    sound_pen();
    if (v.have && !v.watching) use_pedal(screen_ == Screen::practice && !reading() ? in.pedal : PenMode::off);
    if (v.have && !v.watching && screen_ == Screen::practice && !reading()) move_clamps(in.clamps);
    if (screen_ != Screen::practice || status.settling || !v.have || v.watching) return;
    const Camera camera = camera_of(orbit_);
    const ViewFrame view = view_frame(camera.eye, camera.target, camera.up, camera.fov_deg, static_cast<float>(height_));
    v.live.arm_strength(0, settings_.force_right), v.live.arm_strength(1, settings_.force_left);
    if (reading()) {  // nothing moves while the user reads; a click begins
      if (in.mouse.jaw_presses > 0 || (in.has_pad && in.pad.both)) v.live.command(LiveCommand::begin_stage);
      if (options_.watch &&
          !options_.watch({v.seen, view, hands_.steering, hands_.mouse, status, placed_, worn_look(), board_placed_}))
        quit_ = true;
      return;
    }
    used_keys_.note(in);
    std::optional<std::array<ToolInput, 2>> worn;
    if (wearer_) {
      worn = wearer_->hands(v.seen, space_hands(), {status.arm[0], status.arm[1]});
      if (Pose head; wearer_->head(head)) v.live.head(head);
    }
    std::array<bool, 2> elsewhere{};  // a hand without a controller stays with the mouse
    for (size_t k = 0; worn && k < 2; ++k)
      if ((elsewhere[k] = (*worn)[k].connected)) v.live.hand(k, (*worn)[k]);
    hands_.move(in, settings_, view, v.seen, elsewhere, dt, status.epoch);
    if (options_.watch &&
        !options_.watch({v.seen, view, hands_.steering, hands_.mouse, status, placed_, worn_look(), board_placed_}))
      quit_ = true;
  }

  const xr::WearerLook* worn_look() const { return wearer_ ? &wearer_->look() : nullptr; }
  bool reading() const { return visit_ && visit_->live.status().reading && !visit_->live.status().demonstrating; }

  // Event listeners: every new stage, and every demonstration.
  void report_stage(const LiveStatus& status) {
    if (!procedure_ || !status.procedure.begun || !events_) return;
    const auto name = [&](size_t k) { return k < procedure_->stage.size() ? procedure_->stage[k].name : std::string("done"); };
    if (std::exchange(shown_stage_, status.procedure.stage + 1) != status.procedure.stage + 1)
      std::fprintf(events_, "{\"stage\":\"%s\"}\n", name(status.procedure.stage).c_str());
    if (status.demonstrating && !std::exchange(demonstrating_, true))
      std::fprintf(events_, "{\"shows\":\"%s\"}\n", name(status.procedure.stage).c_str());
    demonstrating_ = status.demonstrating;
  }

  ViewFrame view() const {
    const Camera c = camera_of(orbit_);
    return view_frame(c.eye, c.target, c.up, c.fov_deg, static_cast<float>(height_));
  }

  // The planned bite, as far as the user wants guidance.
  std::optional<BiteGuide> guide() const {
    const Guidance level = settings_.guidance;
    if ((level != Guidance::learn && !tutorial_) || (level == Guidance::exam && !tutorial_) || visit_->watching) return {};
    return next_bite(places_, visit_->live.picture(), visit_->seen);
  }

  // Event listeners are also notified when the hands connect.
  void tell_screen() {
    if (!events_ || !tell_screen_) return;
    if (screen_ == Screen::practice && (!visit_->have || visit_->live.status().settling)) return;
    tell_screen_ = false;
    std::fprintf(events_, "{\"screen\":\"%s\"}\n", screen_name(screen_));
    std::fflush(events_);
  }

  // For --screenshot: goes to the requested screen and moment. Frames are counted from there.
  void pose_for_picture() {
    if (options_.screenshot.empty() || posed_) return;
    const std::string& wanted = options_.screen;
    if (visit_) {
      const LiveStatus& s = visit_->live.status();
      if (!visit_->have || s.settling || (!s.reading && s.metrics.time_s < options_.at)) return;
      if (wanted == "pause") go(Screen::pause);
      if (wanted == "results") carry_out({Chosen::finish});
      developer_ = wanted == "developer";
    } else if (viewing_) {
      const PlaybackStatus& s = viewing_->playback.status();
      const uint64_t to = ticks_to(s, options_.at);
      if (s.known < s.ticks) return;
      if (s.at != to) return viewing_->playback.go_to(to);
      if (wanted == "results") carry_out({Chosen::sewn});
    }
    if (wanted == "settings") carry_out({Chosen::settings});
    if (wanted == "survey") {
      carry_out({Chosen::finish});
      if (!settings_.survey.empty()) carry_out({Chosen::survey});
    }
    posed_ = true;
  }

  Choice panels() {
    if (screen_ == Screen::start)
      return start_panel({&scenes_, &recordings_, message_, events_in_.pad_name(), !options_.live.surgeon.empty(),
                          headset_offered_, wearer_ && !wearer_->failed(), headset_line_, can_keep()},
                         settings_, watch_);
    if (screen_ == Screen::survey) return survey_panel(form_, message_);
    if (screen_ == Screen::settings)
      return settings_panel(settings_, short_name(settings_path()), short_name(data_folder(settings_)), message_,
                            visit_ != nullptr);
    if (screen_ == Screen::results) { return result_panel(results_, colored_by_); }
    Settings shown = settings_;
    if (height_ < 480) shown.hints = false;
    if (viewing_ && viewing_->have) {
      const Viewing& v = *viewing_;
      PlayedView played{&v.playback.scene(), &v.playback.status(), &v.result, &v.seen, v.file, v.version, v.cut, {}};
      ScreenPoint at;
      if (const Pose* head = v.playback.head(); head && !on_board_ &&
                                                on_screen(gaze_point(*head, v.playback.picture(), v.seen), this->view(),
                                                          static_cast<float>(width_), static_cast<float>(height_), at))
        played.gaze = at;
      return view_panel(played, shown);
    }
    if (!visit_ || !visit_->have) return {};
    WorkView view;
    view.scene = &visit_->scene;
    view.status = &visit_->live.status();
    view.seen = &visit_->seen;
    view.picture = &visit_->live.picture();
    view.steering = &hands_.steering;
    view.mouse = &hands_.mouse;
    view.log = &visit_->log;
    const FeedbackLevel level = settings_.guidance == Guidance::exam ? FeedbackLevel::silent : settings_.feedback;
    if (level != FeedbackLevel::silent) view.remarks = &visit_->remarks;
    cues_.clear();
    if (level == FeedbackLevel::live && !visit_->watching && !rubric_.empty() && !visit_->live.status().settling)
      cues_ = assess::cues_now(rubric_[0], cue_source_, *view.picture, visit_->seen);
    view.cues = &cues_;
    view.speed = hands_.speed;
    view.pad = events_in_.pad_name();
    view.watching = visit_->watching;
    view.inside = developer_;
    view.pictures_per_s = picture_count_ / std::max(picture_s_, 1e-3);
    if (wearer_ && !wearer_->failed()) view.headset = wearer_->status_line();
    WorkText work{&view, procedure_.get(), tutorial_, {}, used_keys_};
    if (!visit_->live.status().settling) work.guide = guide();
    if (on_board_) {  // beside the field: nothing to keep clear of
      board_placed_ = place_panels(work_panels(work, shown), EyeRenderer::kBoardWidth, EyeRenderer::kBoardHeight,
                                   panel_text_size(), {}, board_placed_);
      draw_panels(board_placed_);
      return screen_ == Screen::pause ? pause_panel(view) : Choice{};
    }
    const float w = static_cast<float>(width_), h = static_cast<float>(height_);
    const ViewFrame frame = this->view();
    if (work.guide) guide_overlay(*work.guide, frame, *view.picture, *view.seen, {0, 0, w, h});
    std::span<const LinePiece> line;
    if ((settings_.guidance != Guidance::exam || tutorial_) && !view.watching && !view.status->settling)
      line = line_.on(*view.picture, *view.seen);
    line_overlay(line, frame, {0, 0, w, h});
    const BiteGuide* planned = work.guide ? &*work.guide : nullptr;
    std::vector<ScreenPoint> points = work_points(*view.seen, *view.picture, frame, w, h, planned);
    for (size_t i = 0; i < line.size(); i += 8)
      if (ScreenPoint at; dot(line[i].out, line[i].a - frame.eye) < 0 && on_screen(line[i].a, frame, w, h, at))
        points.push_back(at);
    placed_ = place_panels(work_panels(work, shown), w, h, panel_text_size(), points, placed_);
    draw_panels(placed_);
    if (inset_drawn_) {
      if (planned) guide_overlay(*planned, inset_frame_, *view.picture, *view.seen, *inset_);
      const ImVec2 corner{inset_->x, inset_->y}, far{inset_->x + inset_->w, inset_->y + inset_->h};
      ImGui::GetBackgroundDrawList()->AddRect(corner, far, IM_COL32(230, 236, 238, 200), 0, 0, 2);
    }
    place_magnifier(*view.seen, frame, points);
    Choice choice;
    if (developer_) choice = developer_panel(view, screen_ == Screen::pause);
    if (screen_ == Screen::pause)
      if (const Choice more = pause_panel(view); more.what != Chosen::nothing) choice = more;
    return choice;
  }

  // The magnifier's place in the next frame. Only where the picture is coarse.
  void place_magnifier(const Snapshot& seen, const ViewFrame& frame, std::span<const ScreenPoint> points) {
    const std::optional<PanelRect> before = std::exchange(inset_, std::nullopt);
    if (!settings_.inset || coarse_ >= 1 || staged_ != Quality::low || screen_ != Screen::practice) return;
    const float w = static_cast<float>(width_), h = static_cast<float>(height_);
    ScreenPoint tip;
    if (!on_screen(tip_of(seen), frame, w, h, tip)) return;
    inset_ = place_inset(static_cast<float>(inset_side(width_, height_)), w, h, tip, points, placed_, before);
  }

  Vec3 tip_of(const Snapshot& seen) const { return on_needle(picture(), seen.active().needle.pose, 1, seen.active_suture); }

  void magnify(const Snapshot& seen, WindowRenderer::Frame& frame) {
    const Camera c = magnified(frame.camera, tip_of(seen), kInsetHalf);
    inset_frame_ = view_frame(c.eye, c.target, c.up, c.fov_deg, inset_->h);
    frame.inset = Inset{c, static_cast<int>(inset_->x), static_cast<int>(inset_->y), static_cast<int>(inset_->w)};
  }

  void resized() {
    inset_.reset();
    SDL_GetWindowSize(sdl_.window, &width_, &height_);
    renderer_->resize(width_, height_);
    const float fits = std::min(static_cast<float>(height_) / 720, static_cast<float>(width_) / 1280);
    style_text_ = settings_.text_size;
    const float scale = std::clamp(fits, 0.7f, 4.0f) * style_text_;
    renderer_->text_height(16 * scale);
    style_panels(scale);
  }

  // Without a graphics card: lower resolution instead of a lower frame rate, if the low quality was selected; back up when
  // the processor is free again. A saved screenshot may take longer.
  void fit_resolution() {
    const float least = std::clamp(180.0f / static_cast<float>(height_), 0.25f, 1.0f);
    if (!(visit_ || viewing_) || settings_.quality != Quality::low || !options_.screenshot.empty()) return;
    // The first pictures were drawn before the last change took effect, or compiled the materials.
    const double took = picture_s_ / std::max(picture_count_, 1e-3);
    if (++pictures_so_ < 3 || (pictures_so_ < 12 && took < kFarTooSlow)) return;
    const auto at = std::find_if(kResolutions.begin(), kResolutions.end(), [&](float part) { return part <= coarse_ + 0.01f; });
    float part = coarse_;
    if (took > kFarTooSlow) part *= 0.5f;
    else if (took > kSlowPicture && at + 1 != kResolutions.end()) part = at[1];
    else if (took < kQuickPicture && pictures_so_ > 40 && at != kResolutions.begin()) part = at[-1];
    part = std::max(least, part);
    if (part == coarse_) return;
    coarse_ = part;
    renderer_->set_resolution_scale(coarse_);
    pictures_so_ = 0;
    picture_s_ = picture_count_ = 0;
  }

  const PlayOptions& options_;
  SdlWindow sdl_;
  int width_, height_;
  std::unique_ptr<WindowRenderer> renderer_;
  std::unique_ptr<xr::Wearer> wearer_;  // null: no headset was requested
  bool worn_ = false;                   // the headset wants this frame
  bool headset_offered_ = false;
  std::string headset_line_;       // its last report
  Quality staged_ = Quality::low;  // of the displayed scene
  bool board_styled_ = false, on_board_ = false;
  double mirrored_ = 0;  // [s]
  WindowEvents events_in_;
  Settings settings_, kept_, at_start_;  // current; stored in the file; at the last check
  float style_text_ = 1;
  std::vector<SceneChoice> scenes_;
  std::vector<std::string> recordings_, made_;  // listed; made since the start of the program
  std::string message_, json_fault_;
  std::string kept_session_;  // recorded by default; empty: none
  Screen screen_ = Screen::start, settings_from_ = Screen::start;
  bool tell_screen_ = true, picture_wanted_ = false, quit_ = false, developer_ = false, watch_ = false;
  bool posed_ = false, photographed_ = false;
  int posed_for_ = 0;  // frames
  std::unique_ptr<Visit> visit_;
  std::unique_ptr<Viewing> viewing_;
  struct {
    std::string scene, procedure, stage;
    bool tutorial = false;
  } source_;                                    // of the session
  std::shared_ptr<const Procedure> procedure_;  // null: none
  bool tutorial_ = false, demonstrating_ = false;
  uint32_t shown_stage_ = 0;  // reported last, from 1
  UsedKeys used_keys_;
  PenSound pen_sound_;
  PenMode pedal_ = PenMode::off;  // that is pressed
  std::vector<PlacedPanel> placed_, board_placed_;
  std::optional<PanelRect> inset_;  // of the magnifier; none: it is not shown
  ViewFrame inset_frame_;
  bool inset_drawn_ = false;  // in this frame
  int opened_ = 0;
  SceneSpec scene_;  // of the results
  LiveResult result_;
  ResultView results_;
  BiteColor colored_by_ = BiteColor::spacing;
  Snapshot last_;  // behind the results
  RestTissue rest_;
  bool have_last_ = false;
  WindowHands hands_;
  BitePlaces places_;
  PlannedLine line_;
  std::vector<assess::Rubric> rubric_;  // of the session; the first one judges
  assess::CueSource cue_source_;
  std::vector<assess::Cue> cues_;
  SurveyForm form_;
  bool asked_ = false;              // the questionnaire was answered or left out
  bool asked_for_results_ = false;  // the user has finished the session
  bool back_to_results_ = false;    // the viewer shows a moment of the session just finished
  Orbit orbit_;
  bool orbit_set_ = false;  // false: set again with the next snapshot
  Latency latency_;
  double picture_s_ = 0, picture_count_ = 0;  // recent
  float coarse_ = 1;                          // fraction of the window's resolution in each direction
  int pictures_so_ = 0;                       // since the last change
  int pictures_ = 0;
  double active_s_ = wall_seconds();  // last input
  std::FILE* events_ = nullptr;
};

}  // namespace

int play(const PlayOptions& options) { return Window(options).loop(); }

}  // namespace catgut
