// SPDX-License-Identifier: Apache-2.0
// app/window: see input.h.
#include "window/input.h"

#include <imgui.h>

#include "runtime/live.h"

namespace catgut {
namespace {

constexpr float kOrbitPerPixel = 0.006f, kOrbitRate = 1.2f, kZoomRate = 0.8f;  // [rad], [rad/s], [1/s]

float axis(SDL_GameController* pad, SDL_GameControllerAxis which) {
  return static_cast<float>(SDL_GameControllerGetAxis(pad, which)) / 32767.0f;
}

}  // namespace

WindowEvents::~WindowEvents() {
  if (pad_) SDL_GameControllerClose(pad_);
}

void WindowEvents::key(const SDL_KeyboardEvent& e, WindowInput& in) {
  const bool down = e.type == SDL_KEYDOWN;
  // By position on the keyboard where hands rest on keys, by letter where the letter abbreviates a word.
  switch (e.keysym.scancode) {
    case SDL_SCANCODE_Q:
      roll_left_ = down;
      return;
    case SDL_SCANCODE_E:
      roll_right_ = down;
      return;
    case SDL_SCANCODE_W:
      both_ = down;
      return;
    case SDL_SCANCODE_LEFT:
      in.arrow_presses -= down;
      arrow_x_ = down ? -1 : 0;
      return;
    case SDL_SCANCODE_RIGHT:
      in.arrow_presses += down;
      arrow_x_ = down ? 1 : 0;
      return;
    case SDL_SCANCODE_UP:
      arrow_y_ = down ? 1 : 0;
      return;
    case SDL_SCANCODE_DOWN:
      arrow_y_ = down ? -1 : 0;
      return;
    case SDL_SCANCODE_PAGEUP:
      zoom_ = down ? 1 : 0;
      return;
    case SDL_SCANCODE_PAGEDOWN:
      zoom_ = down ? -1 : 0;
      return;
    default:
      break;
  }
  const SDL_Keycode code = e.keysym.sym;
  if (code == SDLK_SPACE) {
    in.mouse.jaw_presses += down && !e.repeat;
    space_ = down;
  }
  if (code == SDLK_c) cut_ = down, in.mouse.cut = in.mouse.cut || down;
  if (code == SDLK_F7) cut_pedal_ = down;
  if (code == SDLK_F8) coagulate_pedal_ = down;
  if (code == SDLK_F4) together_ = down;
  if (code == SDLK_F6) apart_ = down;
  if (code == SDLK_n) fresh_ = down, in.mouse.fresh = in.mouse.fresh || down;
  if (!down || e.repeat) return;
  if (code == SDLK_TAB) ++in.mouse.hand_changes;
  if (code == SDLK_HOME) in.camera_home = true;
  if (code >= SDLK_1 && code <= SDLK_9) {
    const int digit = static_cast<int>(code - SDLK_0);
    keys_.push_back({Key::digit, digit});
    if (digit <= static_cast<int>(kMouseSpeeds.size())) in.speed = digit - 1;
  }
  constexpr struct {
    SDL_Keycode code;
    Key key;
  } kKeys[] = {{SDLK_ESCAPE, Key::escape},
               {SDLK_RETURN, Key::enter},
               {SDLK_p, Key::pause},
               {SDLK_PERIOD, Key::single_step},
               {SDLK_BACKSPACE, Key::take_back},
               {SDLK_F5, Key::restart},
               {SDLK_MINUS, Key::slower},
               {SDLK_PLUS, Key::faster},
               {SDLK_EQUALS, Key::faster},
               {SDLK_m, Key::points},
               {SDLK_F1, Key::hints},
               {SDLK_h, Key::help_at_needle},
               {SDLK_i, Key::next_instrument},
               {SDLK_k, Key::park},
               {SDLK_F9, Key::arms_off},
               {SDLK_F10, Key::finish},
               {SDLK_F12, Key::picture},
               {SDLK_F2, Key::settings},
               {SDLK_F3, Key::developer},
               {SDLK_j, Key::save},
               {SDLK_SPACE, Key::space},
               {SDLK_COMMA, Key::step_back},
               {SDLK_s, Key::show_me},
               {SDLK_t, Key::teach},
               {SDLK_r, Key::record}};
  for (const auto& k : kKeys)
    if (k.code == code) keys_.push_back({k.key, 0});
}

void WindowEvents::read_pad(GamepadInput& pad) const {
  for (const bool right : {false, true}) {
    GamepadSide& side = right ? pad.right : pad.left;
    side.x = axis(pad_, right ? SDL_CONTROLLER_AXIS_RIGHTX : SDL_CONTROLLER_AXIS_LEFTX);
    side.y = axis(pad_, right ? SDL_CONTROLLER_AXIS_RIGHTY : SDL_CONTROLLER_AXIS_LEFTY);
    side.trigger = axis(pad_, right ? SDL_CONTROLLER_AXIS_TRIGGERRIGHT : SDL_CONTROLLER_AXIS_TRIGGERLEFT);
    side.shoulder =
        SDL_GameControllerGetButton(pad_, right ? SDL_CONTROLLER_BUTTON_RIGHTSHOULDER : SDL_CONTROLLER_BUTTON_LEFTSHOULDER);
    side.press = SDL_GameControllerGetButton(pad_, right ? SDL_CONTROLLER_BUTTON_RIGHTSTICK : SDL_CONTROLLER_BUTTON_LEFTSTICK);
  }
  pad.cut = SDL_GameControllerGetButton(pad_, SDL_CONTROLLER_BUTTON_A);
  pad.fresh = SDL_GameControllerGetButton(pad_, SDL_CONTROLLER_BUTTON_Y);
  pad.both = SDL_GameControllerGetButton(pad_, SDL_CONTROLLER_BUTTON_B);
  pad.slow = SDL_GameControllerGetButton(pad_, SDL_CONTROLLER_BUTTON_X);
}

int WindowEvents::shoulders() const {
  const auto down = [&](SDL_GameControllerButton which) { return SDL_GameControllerGetButton(pad_, which) != 0; };
  return kFromPad + (down(SDL_CONTROLLER_BUTTON_LEFTSHOULDER) ? kLeftShoulder : 0) +
         (down(SDL_CONTROLLER_BUTTON_RIGHTSHOULDER) ? kRightShoulder : 0);
}

// Keys that edit a text field. True: one of them, and a field has them.
bool WindowEvents::edit_text(const SDL_KeyboardEvent& e) {
  constexpr std::pair<SDL_Keycode, ImGuiKey_> kEditing[] = {
      {SDLK_BACKSPACE, ImGuiKey_Backspace}, {SDLK_DELETE, ImGuiKey_Delete}, {SDLK_LEFT, ImGuiKey_LeftArrow},
      {SDLK_RIGHT, ImGuiKey_RightArrow},    {SDLK_HOME, ImGuiKey_Home},     {SDLK_END, ImGuiKey_End},
      {SDLK_RETURN, ImGuiKey_Enter},        {SDLK_ESCAPE, ImGuiKey_Escape}};
  ImGuiIO& io = ImGui::GetIO();
  for (const auto& [code, name] : kEditing) {
    io.KeyMap[name] = name;
    if (code != e.keysym.sym) continue;
    const bool down = e.type == SDL_KEYDOWN && io.WantTextInput;
    io.KeysDown[name] = down;
    return down;
  }
  return false;
}

WindowInput WindowEvents::read(bool working, float dt, bool look_round) {
  WindowInput in;
  in.mouse.cut = cut_, in.mouse.fresh = fresh_;
  ImGuiIO& io = ImGui::GetIO();
  look_round = look_round && !working && !io.WantCaptureMouse;
  for (SDL_Event e; SDL_PollEvent(&e);) {
    in.any = in.any || e.type == SDL_KEYDOWN || e.type == SDL_MOUSEMOTION || e.type == SDL_MOUSEBUTTONDOWN ||
             e.type == SDL_MOUSEWHEEL || e.type == SDL_CONTROLLERBUTTONDOWN;
    switch (e.type) {
      case SDL_QUIT:
        in.quit = true;
        break;
      case SDL_WINDOWEVENT:
        in.resized = in.resized || e.window.event == SDL_WINDOWEVENT_SIZE_CHANGED;
        // Keys that were pressed when the window lost the focus get no release event.
        if (e.window.event == SDL_WINDOWEVENT_FOCUS_LOST || e.window.event == SDL_WINDOWEVENT_MINIMIZED ||
            e.window.event == SDL_WINDOWEVENT_HIDDEN) {
          in.left = true;
          left_ = right_ = middle_ = space_ = cut_ = fresh_ = roll_left_ = roll_right_ = both_ = false;
          cut_pedal_ = coagulate_pedal_ = together_ = apart_ = false;
          arrow_x_ = arrow_y_ = zoom_ = 0;
        }
        break;
      case SDL_MOUSEMOTION:
        in.moved_ns = wall_ns();
        if (!working && !look_round) break;
        if (middle_ || look_round) {
          if (!middle_ && !left_) break;
          in.orbit_right -= static_cast<float>(e.motion.xrel) * kOrbitPerPixel;
          in.orbit_up += static_cast<float>(e.motion.yrel) * kOrbitPerPixel;
        } else {
          in.mouse.right += static_cast<float>(e.motion.xrel);
          in.mouse.down += static_cast<float>(e.motion.yrel);
        }
        break;
      case SDL_MOUSEBUTTONDOWN:
      case SDL_MOUSEBUTTONUP: {
        const bool down = e.type == SDL_MOUSEBUTTONDOWN;
        in.moved_ns = wall_ns();
        if (e.button.button == SDL_BUTTON_LEFT) left_ = down, in.mouse.jaw_presses += down && working;
        if (e.button.button == SDL_BUTTON_RIGHT) right_ = down;
        if (e.button.button == SDL_BUTTON_MIDDLE) middle_ = down;
        clicked_ = clicked_ || (down && e.button.button == SDL_BUTTON_LEFT);
        break;
      }
      case SDL_MOUSEWHEEL:
        in.moved_ns = wall_ns();
        if (look_round) in.closer += 0.1f * e.wheel.preciseY;
        else if (!working) io.MouseWheel += e.wheel.preciseY;
        else if (SDL_GetModState() & KMOD_CTRL) in.closer += 0.1f * e.wheel.preciseY;
        else in.mouse.wheel += e.wheel.preciseY;
        break;
      case SDL_TEXTINPUT:
        if (io.WantTextInput) io.AddInputCharactersUTF8(e.text.text);
        break;
      case SDL_KEYDOWN:
      case SDL_KEYUP:
        in.moved_ns = wall_ns();
        if (edit_text(e.key) || io.WantTextInput) break;  // in a text field, letters are not commands
        key(e.key, in);
        break;
      case SDL_CONTROLLERDEVICEADDED:
        if (!pad_ && (pad_ = SDL_GameControllerOpen(e.cdevice.which))) {
          const char* name = SDL_GameControllerName(pad_);
          pad_name_ = name ? name : "gamepad";
        }
        break;
      case SDL_CONTROLLERDEVICEREMOVED:
        if (pad_ && SDL_JoystickInstanceID(SDL_GameControllerGetJoystick(pad_)) == e.cdevice.which) {
          SDL_GameControllerClose(pad_);
          pad_ = nullptr;
          pad_name_.clear();
          in.pad_gone = true;
        }
        break;
      case SDL_CONTROLLERBUTTONDOWN:
        if (e.cbutton.button == SDL_CONTROLLER_BUTTON_START) keys_.push_back({Key::escape, 0});
        if (e.cbutton.button == SDL_CONTROLLER_BUTTON_DPAD_UP) keys_.push_back({Key::next_instrument, shoulders()});
        if (e.cbutton.button == SDL_CONTROLLER_BUTTON_DPAD_DOWN) keys_.push_back({Key::park, shoulders()});
        if (e.cbutton.button == SDL_CONTROLLER_BUTTON_BACK) keys_.push_back({Key::take_back, 0});
        break;
      default:
        break;
    }
  }
  if (!keys_.empty()) {
    in.key = keys_.front().first, in.digit = keys_.front().second;
    keys_.pop_front();
  }
  const SDL_Keymod mod = SDL_GetModState();
  in.pedal = cut_pedal_ ? PenMode::cut : coagulate_pedal_ ? PenMode::coagulate : PenMode::off;
  in.clamps = int{together_} - int{apart_};
  in.mouse.turn = right_;
  in.mouse.both = both_;
  in.mouse.free_turn = mod & KMOD_CTRL;
  in.mouse.depth = mod & KMOD_SHIFT;
  in.mouse.jaw_down = left_ || space_;
  in.mouse.roll = static_cast<float>(roll_right_) - static_cast<float>(roll_left_);
  in.orbit_right += static_cast<float>(arrow_x_) * kOrbitRate * dt;
  in.orbit_up += static_cast<float>(arrow_y_) * kOrbitRate * dt;
  in.closer += static_cast<float>(zoom_) * kZoomRate * dt;
  in.has_pad = pad_ != nullptr;
  if (pad_) {
    read_pad(in.pad);
    in.orbit_right += static_cast<float>(SDL_GameControllerGetButton(pad_, SDL_CONTROLLER_BUTTON_DPAD_RIGHT) -
                                         SDL_GameControllerGetButton(pad_, SDL_CONTROLLER_BUTTON_DPAD_LEFT)) *
                      kOrbitRate * dt;
  }
  int x = 0, y = 0;
  SDL_GetMouseState(&x, &y);
  io.MousePos = working ? ImVec2(-1, -1) : ImVec2(static_cast<float>(x), static_cast<float>(y));
  // A click that started and ended between two frames is still one for the panels.
  io.MouseDown[0] = !working && (left_ || clicked_);
  return in;
}

}  // namespace catgut
