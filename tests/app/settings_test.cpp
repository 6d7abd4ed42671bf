// SPDX-License-Identifier: Apache-2.0
// tests/app: the settings file: values survive writing and reading, errors are one line, and no file is lost. And the meaning
// of keys on each screen.
#ifdef CATGUT_TESTS_WINDOW
#include "window/settings.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "core/check.h"
#include "window/screens.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

class SettingsFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("catgut_settings_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    path_ = (folder_ / "catgut" / "settings.toml").string();
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const std::string& text) const {
    fs::create_directories(fs::path(path_).parent_path());
    std::ofstream(path_, std::ios::binary) << text;
  }
  static std::string read(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }
  fs::path folder_;
  std::string path_;
};

Settings all_changed() {
  Settings s;
  s.quality = Quality::high;
  s.guidance = Guidance::exam;
  s.left_handed = s.hold_to_close = s.suture_points = true;
  s.assist = s.hints = s.inset = false;
  s.record = false;
  s.data_folder = "~/my \"sessions\\";
  s.language = "de";
  s.mouse_speed = 0.37f;
  s.text_size = 1.5f;
  s.force_right = 0.5f, s.force_left = 1.25f;
  s.feedback = FeedbackLevel::live;
  s.trainee = "T-07.a", s.survey = "rectal_prolapse";
  return s;
}

TEST_F(SettingsFile, what_is_written_is_read) {
  EXPECT_EQ(parse_settings(settings_text(all_changed()), "x"), all_changed());
  EXPECT_EQ(parse_settings(settings_text(Settings{}), "x"), Settings{});
  EXPECT_EQ(parse_settings("", "x"), Settings{});
  for (const char* bad : {"trainee = \"a b\"", "trainee = 7", "feedback = \"loud\"", "survey = \"a\\nb\""})
    EXPECT_THROW(parse_settings(bad, "x"), InputError) << bad;
  EXPECT_EQ(parse_settings("mouse_speed = 2", "x").mouse_speed, 2) << "a whole number will do";
  save_settings(all_changed(), path_);
  EXPECT_EQ(load_settings(path_).settings, all_changed());
  EXPECT_TRUE(load_settings(path_).fault.empty());
  for (const auto& entry : fs::directory_iterator(fs::path(path_).parent_path()))
    EXPECT_EQ(entry.path().filename(), "settings.toml") << "nothing is left lying about";
}

TEST_F(SettingsFile, no_file_is_no_fault) {
  EXPECT_EQ(load_settings(path_).settings, Settings{});
  EXPECT_TRUE(load_settings(path_).fault.empty());
}

TEST_F(SettingsFile, what_is_wrong_is_one_line_that_names_the_file) {
  const std::pair<const char*, const char*> kWrong[] = {
      {"qualty = \"low\"\n", "settings.toml:1: there is no setting \"qualty\"; did you mean \"quality\"?"},
      {"\nquality = \"best\"\n", "settings.toml:2: quality has an invalid value; write \"low\", \"medium\" or \"high\""},
      {"quality = 2\n", "quality has an invalid value"},
      {"hints = 1\n", "write true or false"},
      {"text_size = 20\n", "write a number from 0.7 to 2"},
      {"text_size = nan\n", "write a number"},
      {"force_left = 3\n", "write a number from 0.2 to 2"},
      {"mouse_speed = \"fast\"\n", "write a number from 0.2 to 4"},
      {"[window]\nsize = 3\n", "there is no setting \"window\""},
      {"quality = \"low\n", "settings.toml:1"},
      {"hints = true\nhints = true\n", "settings.toml:"},
  };
  for (const auto& [text, part] : kWrong) {
    write(text);
    const LoadedSettings l = load_settings(path_);
    EXPECT_EQ(l.settings, Settings{}) << text;
    EXPECT_NE(l.fault.find(part), std::string::npos) << text << l.fault;
    EXPECT_NE(l.fault.find(path_), std::string::npos) << l.fault;
    EXPECT_EQ(l.fault.find('\n'), std::string::npos) << l.fault;
    EXPECT_EQ(read(path_), text) << "it is still there";
  }
}

TEST_F(SettingsFile, a_file_that_was_not_understood_is_kept) {
  write("qualty = \"high\"\n");
  save_settings(all_changed(), path_);
  EXPECT_EQ(load_settings(path_).settings, all_changed());
  EXPECT_EQ(read(path_ + ".bad"), "qualty = \"high\"\n");
}

TEST_F(SettingsFile, a_place_that_cannot_be_written_says_so_and_the_old_file_stays) {
  save_settings(all_changed(), path_);
  fs::create_directory(path_ + ".new");  // where the new file would be written
  EXPECT_THROW(save_settings(Settings{}, path_), InputError);
  EXPECT_EQ(load_settings(path_).settings, all_changed());
  EXPECT_THROW(save_settings(Settings{}, "/proc/nowhere/settings.toml"), InputError);
  EXPECT_THROW(save_settings(Settings{}, ""), InputError);
  fs::create_directories(folder_ / "a_folder");
  EXPECT_NE(load_settings((folder_ / "a_folder").string()).fault.find("not a file"), std::string::npos);
}

TEST_F(SettingsFile, any_bytes_are_settings_or_one_line) {
  std::mt19937 random(1);
  const std::string good = settings_text(all_changed());
  int understood = 0;
  for (int round = 0; round < 4000; ++round) {
    std::string text = good;
    if (round % 4 == 0) text.resize(random() % 400);
    for (unsigned k = 0, n = 1 + random() % 6; k < n && !text.empty(); ++k) {
      const size_t at = random() % text.size();
      if (random() % 3 == 0) text.erase(at, 1 + random() % 9);
      else if (random() % 2 == 0) text.insert(at, 1, static_cast<char>(random() % 256));
      else text[at] = static_cast<char>(random() % 256);
    }
    try {
      const Settings s = parse_settings(text, "fuzzed");
      EXPECT_EQ(parse_settings(settings_text(s), "again"), s);
      EXPECT_TRUE(s.text_size >= 0.7f && s.text_size <= 2 && s.mouse_speed >= 0.2f && s.mouse_speed <= 4);
      ++understood;
    } catch (const InputError& error) { EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos); }
  }
  EXPECT_GT(understood, 20) << "some mutations stay valid";
  write(std::string(200000, '#'));
  EXPECT_NE(load_settings(path_).fault.find("too long"), std::string::npos);
}

TEST_F(SettingsFile, it_is_where_the_desktop_wants_it) {
  const char* home = std::getenv("HOME");
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const std::string old_home = home ? home : "", old_config = config ? config : "";
  setenv("HOME", "/home/somebody", 1);
  setenv("XDG_CONFIG_HOME", "/elsewhere", 1);
  EXPECT_EQ(settings_path(), "/elsewhere/catgut/settings.toml");
  setenv("XDG_CONFIG_HOME", "not/whole", 1);
  EXPECT_EQ(settings_path(), "/home/somebody/.config/catgut/settings.toml");
  unsetenv("XDG_CONFIG_HOME");
  unsetenv("HOME");
  EXPECT_EQ(settings_path(), "");
  if (home) setenv("HOME", old_home.c_str(), 1);
  if (config) setenv("XDG_CONFIG_HOME", old_config.c_str(), 1);
}

Chosen pressed(Key key, ScreenFacts facts, int digit = 0) {
  WindowInput in;
  in.key = key;
  in.digit = digit;
  return choice_of_key(in, facts).what;
}

TEST(Screens, escape_always_leads_back) {
  ScreenFacts f;
  f.scenes = 3;
  EXPECT_EQ(pressed(Key::escape, f), Chosen::quit);
  f.screen = Screen::practice;
  EXPECT_EQ(pressed(Key::escape, f), Chosen::pause);
  f.screen = Screen::pause;
  EXPECT_EQ(pressed(Key::escape, f), Chosen::resume);
  f.fault = true;
  EXPECT_EQ(pressed(Key::escape, f), Chosen::nothing) << "what has stopped is not gone on with";
  EXPECT_EQ(pressed(Key::single_step, f), Chosen::nothing);
  EXPECT_EQ(pressed(Key::take_back, f), Chosen::take_back);
  f.screen = Screen::settings;
  EXPECT_EQ(pressed(Key::escape, f), Chosen::leave_settings);
  f.screen = Screen::results;
  EXPECT_EQ(pressed(Key::escape, f), Chosen::leave_results);
  f.screen = Screen::view;
  EXPECT_EQ(pressed(Key::escape, f), Chosen::start_screen);
}

TEST(Screens, keys_of_the_field_do_nothing_elsewhere) {
  for (const Screen screen : {Screen::start, Screen::settings, Screen::results, Screen::view}) {
    ScreenFacts f;
    f.screen = screen;
    for (const Key key : {Key::take_back, Key::finish, Key::help_at_needle, Key::developer})
      EXPECT_EQ(pressed(key, f), Chosen::nothing) << screen_name(screen) << " " << static_cast<int>(key);
    if (screen != Screen::start) { EXPECT_EQ(pressed(Key::digit, f, 1), Chosen::nothing) << screen_name(screen); }
  }
  ScreenFacts start;
  start.scenes = 2;
  EXPECT_EQ(pressed(Key::digit, start, 2), Chosen::scene);
  EXPECT_EQ(pressed(Key::digit, start, 3), Chosen::nothing);
  EXPECT_EQ(pressed(Key::enter, start), Chosen::scene);
  EXPECT_EQ(pressed(Key::enter, ScreenFacts{}), Chosen::nothing) << "there is none";
}

TEST(Screens, a_recording_is_gone_along_by_arrows) {
  WindowInput in;
  in.arrow_presses = -2;
  ScreenFacts f;
  f.screen = Screen::view;
  f.second = 60;
  Choice c = choice_of_key(in, f);
  EXPECT_EQ(c.what, Chosen::go_by);
  EXPECT_EQ(c.by, -120);
  f.screen = Screen::practice;
  EXPECT_EQ(choice_of_key(in, f).what, Chosen::nothing) << "there they look round";
  f.screen = Screen::view;
  EXPECT_EQ(pressed(Key::space, f), Chosen::play_or_hold);
}

}  // namespace
}  // namespace catgut
#endif
