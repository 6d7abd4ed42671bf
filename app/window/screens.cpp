// SPDX-License-Identifier: Apache-2.0
// app/window: see screens.h.
#include "window/screens.h"

namespace catgut {

const char* screen_name(Screen screen) {
  static constexpr const char* kName[] = {"start", "settings", "practice", "pause", "results", "view", "survey"};
  return kName[static_cast<size_t>(screen)];
}

Choice choice_of_key(const WindowInput& in, const ScreenFacts& f) {
  const bool practice = f.screen == Screen::practice, pause = f.screen == Screen::pause, field = practice || pause;
  const bool start = f.screen == Screen::start, view = f.screen == Screen::view, results = f.screen == Screen::results;
  if (view && in.arrow_presses != 0) return {Chosen::go_by, 0, "", in.arrow_presses * f.second};
  const auto when = [](bool holds, Chosen what) { return Choice{holds ? what : Chosen::nothing}; };
  switch (in.key) {
    case Key::escape:
      if (start) return {Chosen::quit};
      if (practice) return {Chosen::pause};
      if (pause) return when(!f.fault, Chosen::resume);
      if (f.screen == Screen::settings) return {Chosen::leave_settings};
      if (results) return {Chosen::leave_results};
      if (f.screen == Screen::survey) return {Chosen::leave_survey};
      return {Chosen::start_screen};
    case Key::pause:
      if (view) return {Chosen::play_or_hold};
      return practice ? Choice{Chosen::pause} : when(pause && !f.fault, Chosen::resume);
    case Key::enter:
      if (practice) return when(f.reading, Chosen::begin_stage);
      if (results) return {f.from_recording ? Chosen::leave_results : Chosen::restart};
      if (view) return {Chosen::sewn};
      return when(start && f.scenes > 0, Chosen::scene);
    case Key::digit:
      if (start && in.digit >= 1 && static_cast<size_t>(in.digit) <= f.scenes)
        return {Chosen::scene, static_cast<size_t>(in.digit) - 1};
      return {};
    case Key::space:
      return when(view, Chosen::play_or_hold);
    case Key::single_step:
      return view ? Choice{Chosen::go_by, 0, "", 1} : when(pause && !f.fault, Chosen::single_step);
    case Key::step_back:
      return view ? Choice{Chosen::go_by, 0, "", -1} : Choice{};
    case Key::take_back:
      return when(field, Chosen::take_back);
    case Key::restart:
      return view ? Choice{Chosen::go_to, 0} : when(field, Chosen::restart);
    case Key::finish:
      return when(field, Chosen::finish);
    case Key::slower:
      return when(field || view, Chosen::slower);
    case Key::faster:
      return when(field || view, Chosen::faster);
    case Key::points:
      return {Chosen::points};
    case Key::hints:
      return {Chosen::hints};
    case Key::help_at_needle:
      return when(field, Chosen::help_at_needle);
    case Key::next_instrument:
      return practice ? Choice{Chosen::next_instrument, static_cast<size_t>(in.digit)} : Choice{};
    case Key::park:
      return practice ? Choice{Chosen::park, static_cast<size_t>(in.digit)} : Choice{};
    case Key::arms_off:
      return when(field, Chosen::arms_off);
    case Key::settings:
      if (f.screen == Screen::settings) return {Chosen::leave_settings};
      return when(start || field, Chosen::settings);
    case Key::developer:
      return when(field, Chosen::developer);
    case Key::save:
      return when(results, Chosen::save_json);
    case Key::show_me:
      return when(practice, Chosen::show_me);
    case Key::record:
      return when(field, Chosen::record);
    case Key::teach:
      return when(start, Chosen::teach);
    case Key::picture:
      return {Chosen::picture};
    case Key::none:
      return {};
  }
  return {};
}

}  // namespace catgut
