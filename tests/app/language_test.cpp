// SPDX-License-Identifier: Apache-2.0
// tests/app: the screens' words in another language: German names all that a learner reads, patterns match what varies, and
// mistakes in a language file are reported with their line.
#ifdef CATGUT_TESTS_WINDOW
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/check.h"
#include "procedure/procedure_file.h"
#include "procedure/scene_file.h"
#include "window/language.h"
#include "window/words.h"
#include "window/work_text.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

Language words_of(const std::string& text) {
  const fs::path path = fs::path(testing::TempDir()) / ("catgut_words_" + std::to_string(getpid()) + ".toml");
  std::ofstream(path) << text;
  const auto remove = [&] { fs::remove(path); };
  try {
    const Language out = read_language(path.string());
    remove();
    return out;
  } catch (...) {
    remove();
    throw;
  }
}

std::string refused(const std::string& text) {
  try {
    words_of(text);
  } catch (const InputError& error) { return error.what(); }
  return "";
}

TEST(Languages, a_pattern_keeps_what_varies) {
  const Language l = words_of(R"([words]
"needle" = "Nadel"
"{} slipped from {} at {} N" = "{1} verlor {0}, {2} N"
"{}: {}" = "{}: {}"
"Pull." = "Zieh."
"Stop." = "Halt."
)");
  EXPECT_EQ(translated(l, "needle slipped from forceps at 3.1 N"), "forceps verlor Nadel, 3.1 N");
  EXPECT_EQ(translated(l, "forceps: needle"), "forceps: Nadel");
  EXPECT_EQ(translated(l, "Pull. Stop."), "Zieh. Halt.");
  EXPECT_EQ(translated(l, "unknown words"), "unknown words");
}

TEST(Languages, mistakes_name_their_line) {
  EXPECT_NE(refused("[words]\n\"a {}\" = \"b\"\n").find(".toml:2: the translation of \"a {}\""), std::string::npos);
  EXPECT_NE(refused("[words]\n\"a {}\" = \"b {1}\"\n").find(".toml:2: there is no {1}"), std::string::npos);
  EXPECT_NE(refused("[words]\n\"a\" = 3\n").find(".toml:2:"), std::string::npos);
  EXPECT_NE(refused("title = \"x\"\n").find("no table [words]"), std::string::npos);
  EXPECT_NE(refused("[words\n").find(".toml:1:"), std::string::npos);
}

TEST(Languages, german_names_all_of_every_procedure) {
  const Language de = read_language("de");
  const auto expect = [&](const std::string& text) {
    if (!text.empty()) { EXPECT_NE(translated(de, text), text) << "not in languages/de.toml"; }
  };
  for (const std::string& name : procedure_names()) {
    const Procedure p = read_procedure(name);
    expect(p.title), expect(p.text);
    for (const ProcedureStage& s : p.stage) {
      expect(s.title), expect(s.text), expect(s.skip_text), expect(s.guard_text);
      for (const StageHint& h : s.hint) expect(h.text);
    }
    for (const StageError& e : p.error) expect(e.text), expect(e.why);
  }
  const Procedure lesson = read_procedure(kFirstLesson);
  // All panels at every stage.
  const SceneSpec scene = scene_of(lesson);
  const PictureModel picture;
  Snapshot seen;
  LiveStatus status;
  Steering steering;
  MouseHand mouse;
  std::deque<LogLine> log;
  WorkView view;
  view.scene = &scene, view.status = &status, view.seen = &seen, view.picture = &picture;
  view.steering = &steering, view.mouse = &mouse, view.log = &log;
  for (const bool settling : {true, false})
    for (size_t k = 0; k <= lesson.stage.size(); ++k) {
      status.settling = settling;
      status.reading = k % 2 == 0;
      begin_run(status.procedure, lesson, seen, 1.0 / 60, k);
      for (const bool tutorial : {true, false})
        for (const Panel& p : work_panels({&view, &lesson, tutorial, {}, {}}, {}))
          for (const PanelLine& line : p.line) expect(line.text);
    }
}

TEST(Languages, german_names_every_event_and_result) {
  const Language de = read_language("de");
  const auto expect = [&](const std::string& text) {
    if (!text.empty()) { EXPECT_NE(translated(de, text), text) << "not in languages/de.toml"; }
  };
  bool bad = false;
  for (size_t k = 0; k < static_cast<size_t>(EventKind::count_); ++k)
    for (const float value : {0.0f, 2.0f}) {
      Event e;
      e.kind = static_cast<EventKind>(k);
      e.value = value, e.which = static_cast<uint32_t>(value);
      if (e.kind == EventKind::technique_fault) e.fault = Fault::wrong_body;
      expect(words_for(e, bad));
    }
  const SceneSpec scene = read_scene("stay");
  SessionMetrics metrics;
  metrics.overloads = 1, metrics.thread_slips = 1;
  for (const ResultRow& row : result_rows(scene, metrics)) expect(row.name);
}

TEST(Languages, the_environment_chooses_one_that_exists) {
  const char* before = std::getenv("LC_ALL");
  const std::string kept = before ? before : "";
  setenv("LC_ALL", "de_DE.UTF-8", 1);
  EXPECT_EQ(language_of_environment(), "de");
  setenv("LC_ALL", "xx_XX.UTF-8", 1);
  EXPECT_EQ(language_of_environment(), "en");
  setenv("LC_ALL", "C", 1);
  EXPECT_EQ(language_of_environment(), "en");
  if (before) setenv("LC_ALL", kept.c_str(), 1);
  else unsetenv("LC_ALL");
}

}  // namespace
}  // namespace catgut
#endif
