// SPDX-License-Identifier: Apache-2.0
// app: `catgut store`, `catgut report` and `catgut survey`: sessions in the store, and what people read of them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "commands/commands.h"
#include "commands/keep.h"
#include "core/check.h"
#include "core/file.h"
#include "procedure/scene_file.h"
#include "report/csv.h"
#include "report/data.h"
#include "report/session_file.h"
#include "report/survey.h"
#include "runtime/assessment.h"
#include "runtime/clips.h"
#include "runtime/report.h"
#include "store/store.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;

Store open_store(const std::string& where, bool read_only = false) {
  StoreOptions options;
  options.where = where;
  options.read_only = read_only;
  return Store(options);
}

std::string user_name() {
  const char* name = std::getenv("USER");
  return name ? name : "command line";
}

void add_store_option(CLI::App& command, std::string& where) {
  command
      .add_option("--store", where,
                  "file, or postgresql://USER@HOST/DATABASE; default: CATGUT_STORE, else the user's data folder")
      ->type_name("FILE|URL");
}

void add_filter_options(CLI::App& command, SessionFilter& filter) {
  command.add_option("--trainee", filter.trainee, "only this pseudonym")->type_name("NAME");
  command.add_option("--cohort", filter.cohort, "only this cohort")->type_name("NAME");
  command.add_option("--task", filter.task, "only this task")->type_name("NAME");
  command.add_option("--from", filter.from, "only sessions from this day on")->type_name("2026-11-22");
  command.add_option("--before", filter.before, "only sessions before this day")->type_name("2026-11-22");
}

struct StoreCommand {
  std::string store, trainee, task, started, recording, rubric, cohort, level, role, mapping, out, json, csv, xapi,
      home = "https://catgut.invalid";
  std::vector<std::string> file;
  std::string name;
  SessionFilter filter;
  bool yes = false;
};

// Replays and scores a recording; the tension of the thread is kept for the report.
Session assessed(const std::string& file, const std::string& rubric) {
  const Recording recording = read_recording(file);
  check_replayable(recording, file);
  const SceneSpec scene = parse_scene(recording.header.scene, file);
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  hooks.on_progress = progress_line();
  PictureModel picture;
  StitchMap map;
  hooks.on_start = [&](const PictureModel& model) {
    picture = model;
    map = start_map(picture, 1 / static_cast<double>(scene.solver.tick_rate));
  };
  hooks.on_tick = [&](const Snapshot& seen, const std::string&) { note(map, picture, seen); };
  const assess::Result result = assess_recording(recording, file, default_threads(), rubrics_for(rubric, scene), hooks);
  end_progress_line();
  if (stop_on_interrupt()) throw InputError(file, "the assessment was interrupted", "nothing was stored");
  return session_of(result, map, file);
}

int store_add(const StoreCommand& given) {
  StoreCommand o = given;
  Store store = open_store(o.store);
  std::vector<Session> all;
  if (o.file.size() == 1 && o.file[0].ends_with(".cgrec")) {
    if (o.trainee.empty()) throw InputError("--trainee", "is missing", "give the pseudonym of the trainee");
    all.push_back(assessed(o.file[0], o.rubric));
    if (o.recording.empty()) o.recording = o.file[0];
  } else if (o.file.size() == 1 && o.recording.empty()) {
    all = read_sessions_json(read_file(o.file[0]), o.file[0]);
  } else {  // several files of one session
    Session one;
    for (const std::string& file : o.file) read_session_json(read_file(file), file, one);
    all.push_back(one);
  }
  for (Session& s : all) {
    s.recording.clear();  // a path from a file is not trusted: recordings are served and deleted
    if (!o.trainee.empty()) s.trainee = o.trainee;
    if (s.trainee.empty()) throw InputError("--trainee", "is missing", "give the pseudonym of the trainee");
    if (!o.task.empty()) s.task = o.task;
    if (!o.started.empty()) s.started = o.started;
    if (s.started.empty()) s.started = utc_now();
  }
  if (!o.recording.empty()) {
    if (all[0].uid.empty()) all[0].uid = session_uid(all[0].trainee, all[0].task);
    std::erase(all[0].uid, ':');
    all[0].recording = keep_recording(store, o.recording, all[0].uid);
  }
  std::vector<std::string> notes;
  const std::vector<int64_t> ids = store.add_all(all, &notes);
  if (!o.cohort.empty() && !o.trainee.empty()) {
    Person p = store.person(o.trainee);
    p.cohort = o.cohort;
    store.put_person(p);
  }
  for (const std::string& note : notes) std::fprintf(stderr, "catgut: %s\n", note.c_str());
  if (ids.size() == 1)
    std::printf("session %lld of %s stored in %s\n", static_cast<long long>(ids[0]), all[0].trainee.c_str(),
                store.name().c_str());
  else std::printf("%zu sessions stored in %s\n", ids.size() - notes.size(), store.name().c_str());
  return 0;
}

int store_import(const StoreCommand& o) {
  Store store = open_store(o.store);
  std::vector<Person> people;
  const std::vector<Session> all = sessions_of_table(read_file(o.file[0]), o.file[0], read_file(o.mapping), o.mapping, &people);
  std::vector<std::string> notes;
  store.add_all(all, &notes);
  for (const Person& p : people) store.put_person(p);
  std::set<std::string> trainees;  // a table may have a row per session
  for (const Session& s : all) trainees.insert(s.trainee);
  std::printf("%zu trainees, %zu sessions, %zu of them new, in %s\n", trainees.size(), all.size(), all.size() - notes.size(),
              store.name().c_str());
  return 0;
}

int store_info(const StoreCommand& o) {
  const Store store = open_store(o.store);
  std::printf("%s\n  schema %d, %zu people, %zu cohorts, %zu sessions\n", store.name().c_str(), schema_version(),
              store.people().size(), store.cohorts().size(), store.sessions().size());
  const std::string fault = store.check();
  if (fault.empty()) return 0;
  std::printf("  FAULT: %s\n", fault.c_str());
  return 1;
}

int store_list(const StoreCommand& o) {
  const Store store = open_store(o.store);
  std::printf("%6s  %-20s  %-16s  %-16s  %8s  %10s  %s\n", "id", "start", "trainee", "task", "time s", "score", "verdict");
  for (const Session& s : store.sessions(o.filter)) {
    const std::string of = std::isfinite(s.score) && std::isfinite(s.score_max) ? "/" + csv_number(s.score_max) : "";
    std::printf("%6lld  %-20s  %-16s  %-16s  %8.1f  %10s  %s\n", static_cast<long long>(s.id), s.started.c_str(),
                s.trainee.c_str(), s.task.c_str(), s.duration_s, (csv_number(s.score) + of).c_str(),
                s.passed < 0 ? "-"
                : s.passed   ? "passed"
                             : "not passed");
  }
  return 0;
}

int store_people(const StoreCommand& o) {
  const Store store = open_store(o.store);
  for (const Person& p : store.people())
    std::printf("%-20s  %-8s  %-16s  %-8s  %lld sessions\n", p.pseudonym.c_str(), role_name(p.role), p.cohort.c_str(),
                p.level.c_str(), static_cast<long long>(p.sessions));
  return 0;
}

int store_person(const StoreCommand& o) {
  Store store = open_store(o.store);
  Person p;
  for (const Person& known : store.people())
    if (known.pseudonym == o.name) p = known;
  p.pseudonym = o.name;
  if (!o.role.empty()) p.role = role_of(o.role);
  if (!o.cohort.empty()) p.cohort = o.cohort;
  if (!o.level.empty()) p.level = o.level;
  store.put_person(p);
  store.log(user_name(), "person", o.name);
  std::printf("%s is %s%s%s\n", p.pseudonym.c_str(), role_name(p.role), p.cohort.empty() ? "" : " in ", p.cohort.c_str());
  return 0;
}

int store_export(const StoreCommand& o) {
  Store store = open_store(o.store);
  SessionFilter filter = o.filter;
  if (o.json.empty() && o.csv.empty() && o.xapi.empty())
    throw InputError("store export", "no file is named", "use --json, --csv or --xapi");
  for (const auto& [path, suffix] : {std::pair{o.json, ".json"}, {o.csv, ".csv"}, {o.xapi, ".json"}}) {
    if (path != "-") check_suffix(path, suffix, "store export");
    prepare_output(path);
  }
  if (!o.name.empty()) filter.trainee = store.person(o.name).pseudonym;
  if (!o.json.empty()) write_output(o.json, o.name.empty() ? sessions_to_json(store, filter) : person_to_json(store, o.name));
  if (!o.csv.empty()) write_output(o.csv, sessions_csv(store, filter));
  if (!o.xapi.empty()) write_output(o.xapi, sessions_to_xapi(store, filter, o.home));
  store.log(user_name(), "export", o.name);
  return 0;
}

int store_delete(const StoreCommand& o) {
  Store store = open_store(o.store);
  const Person p = store.person(o.name);
  if (!o.yes)
    throw InputError("store delete", fmt::format("{} has {} sessions, which cannot be brought back", o.name, p.sessions),
                     "repeat with --yes; export first, if the data is wanted");
  size_t files = 0;
  const fs::path kept = fs::absolute(store.name()).parent_path() / "recordings";
  for (const std::string& recording : store.remove_person(o.name, user_name())) {
    std::error_code error;
    if (!store.is_file() || fs::path(recording).parent_path() != kept) {
      std::printf("delete this recording by hand: %s\n", recording.c_str());
      continue;
    }
    files += fs::remove(recording, error);
    fs::remove(fs::path(recording).replace_extension(".mp4"), error);
  }
  std::printf("%s deleted: %lld sessions, %zu recordings. Backups made before still hold them\n", o.name.c_str(),
              static_cast<long long>(p.sessions), files);
  return 0;
}

void add_store(CLI::App& app, int& exit_code) {
  CLI::App* store = app.add_subcommand("store", "sessions of trainees: add, list, export, delete, back up");
  store->require_subcommand(1);
  auto o = std::make_shared<StoreCommand>();
  const auto sub = [&](const char* name, const char* help, int (*action)(const StoreCommand&)) {
    CLI::App* command = store->add_subcommand(name, help);
    add_store_option(*command, o->store);
    command->callback([o, action, &exit_code] { exit_code = action(*o); });
    return command;
  };
  sub("info", "name, contents and integrity of the store; makes one when missing", store_info);
  CLI::App* add = sub("add", "store a session, or all sessions of an export", store_add);
  add->add_option("file", o->file,
                  "a recording, which is scored and kept; or what catgut assess --json, the window or an export wrote")
      ->required()
      ->type_name("FILE.cgrec|FILE.json");
  add->add_option("--rubric", o->rubric, "for a recording; default: that of the technique")->type_name("NAME|FILE");
  add->add_option("--trainee", o->trainee, "pseudonym; not a person's name")->type_name("NAME");
  add->add_option("--task", o->task, "default: the scene")->type_name("NAME");
  add->add_option("--started", o->started, "UTC; default: now")->type_name("2026-11-22T21:05:00Z");
  add->add_option("--recording", o->recording, "kept beside the store")->type_name("FILE.cgrec");
  add->add_option("--cohort", o->cohort, "puts the trainee into this cohort")->type_name("NAME");
  CLI::App* import = sub("import", "a table of a learning curve, with a mapping of its columns", store_import);
  import->add_option("file", o->file, "table")->required()->expected(1)->type_name("FILE.csv");
  import->add_option("--mapping", o->mapping, "which column is what; see docs/sessions.md")->required()->type_name("FILE.toml");
  add_filter_options(*sub("list", "sessions in the order of storing", store_list), o->filter);
  sub("people", "people with role and cohort", store_people);
  CLI::App* person = sub("person", "add a person, or change role, cohort, level", store_person);
  person->add_option("name", o->name, "pseudonym")->required();
  person->add_option("--role", o->role, "what the person may do on the page")->type_name("trainee|educator|staff");
  person->add_option("--cohort", o->cohort)->type_name("NAME");
  person->add_option("--level", o->level, "of training, for comparisons")->type_name("TEXT");
  CLI::App* exported = sub("export", "one person's data, or all sessions", store_export);
  exported->add_option("name", o->name, "pseudonym; default: everybody");
  add_filter_options(*exported, o->filter);
  exported->add_option("--json", o->json, "sessions with events and reasons; of one person everything stored")
      ->type_name("FILE|-");
  exported->add_option("--csv", o->csv, "one row per session")->type_name("FILE|-");
  exported->add_option("--xapi", o->xapi, "statements for a learning record store")->type_name("FILE|-");
  exported->add_option("--home", o->home, "IRI under which your institution names accounts and tasks in xAPI")
      ->type_name("IRI");
  CLI::App* removed = sub("delete", "a person with all sessions, answers and recordings", store_delete);
  removed->add_option("name", o->name, "pseudonym")->required();
  removed->add_flag("--yes", o->yes, "really");
  CLI::App* backup = sub("backup", "everything into one new file", [](const StoreCommand& c) {
    open_store(c.store).backup(c.out);
    std::printf("%s\n", c.out.c_str());
    return 0;
  });
  backup->add_option("file", o->out, "must not exist")->required()->type_name("FILE.db");
  CLI::App* restore = sub("restore", "a backup into an empty store", [](const StoreCommand& c) {
    Store target = open_store(c.store);
    target.restore(c.out);
    std::printf("%zu sessions restored in %s\n", target.sessions().size(), target.name().c_str());
    return 0;
  });
  restore->add_option("file", o->out, "a backup")->required()->type_name("FILE.db");
  sub("log", "who exported, deleted and changed what", [](const StoreCommand& c) {
    for (const LogEntry& e : open_store(c.store).log_entries())
      std::printf("%s  %-16s  %-10s  %s\n", e.at.c_str(), e.who.c_str(), e.action.c_str(), e.about.c_str());
    return 0;
  });
}

struct ReportOptions {
  std::string what, html, store;
  bool clips = false;
};

std::string base64(const std::string& bytes) {
  constexpr char kLetter[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t three = 0;
    for (size_t k = 0; k < 3; ++k) three = three << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kLetter[three >> (18 - 6 * k) & 63];
  }
  return out;
}

constexpr size_t kMostClips = 12;
constexpr double kOneMoment = 0.5;  // [s] points lost so close together share a clip

// Pictures of the moments in which points were lost, the most important first, into the data of the page.
std::string with_clips(const Session& s, const std::string& data) {
  if (s.recording.empty()) throw InputError("--clips", "no recording is kept of this session", "leave out --clips");
  std::vector<LostPoints> lost = s.lost;
  std::stable_sort(lost.begin(), lost.end(), [](const LostPoints& a, const LostPoints& b) {
    return a.critical != b.critical ? a.critical : a.points > b.points;
  });
  std::vector<double> moments;
  for (const LostPoints& l : lost) {
    const bool new_moment =
        std::none_of(moments.begin(), moments.end(), [&](double m) { return std::abs(m - l.at_s) < kOneMoment; });
    if (std::isfinite(l.at_s) && new_moment && moments.size() < kMostClips) moments.push_back(l.at_s);
  }
  SessionHooks hooks;
  hooks.stop = &stop_on_interrupt();
  hooks.on_progress = progress_line();
  const auto clips = make_clips(read_recording(s.recording), s.recording, moments, {}, hooks);
  end_progress_line();
  nlohmann::ordered_json j = nlohmann::ordered_json::parse(data);
  j["clips"] = nlohmann::ordered_json::array();
  for (size_t k = 0; k < moments.size(); ++k) {
    std::vector<std::string> pictures;
    for (const std::string& jpeg : clips[k]) pictures.push_back("data:image/jpeg;base64," + base64(jpeg));
    if (!pictures.empty()) j["clips"].push_back({{"at_s", moments[k]}, {"pictures", pictures}});
  }
  return j.dump();
}

int report_page(const ReportOptions& o) {
  check_suffix(o.html, ".html", "--html");
  Store store = open_store(o.store);
  const bool is_id = !o.what.empty() && o.what.find_first_not_of("0123456789") == std::string::npos && o.what.size() < 18;
  std::string page;
  if (is_id) {
    const Session s = store.session(std::stoll(o.what));
    const std::string data = session_data(store, s.id);
    page = html_page("session", s.task + ": " + s.trainee, o.clips ? with_clips(s, data) : data);
  } else {
    page = html_page("trainee", "Sessions of " + store.person(o.what).pseudonym, trainee_data(store, o.what));
  }
  prepare_output(o.html);
  write_output(o.html, page);
  return 0;
}

void add_report(CLI::App& app, int& exit_code) {
  auto o = std::make_shared<ReportOptions>();
  CLI::App* command = app.add_subcommand("report", "a session or a trainee as one HTML file");
  command->add_option("what", o->what, "id of a session (catgut store list), or the pseudonym of a trainee")
      ->required()
      ->type_name("SESSION|TRAINEE");
  command->add_option("--html", o->html, "the page; needs no network and no other file")->required()->type_name("FILE.html");
  command->add_flag("--clips", o->clips, "of a session: pictures of the moments in which points were lost");
  add_store_option(*command, o->store);
  command->callback([o, &exit_code] { exit_code = report_page(*o); });
}

struct SurveyOptions {
  std::string survey = "rectal_prolapse", store, file, html, csv;
};

void add_survey(CLI::App& app, int& exit_code) {
  CLI::App* survey = app.add_subcommand("survey", "questionnaires: show, import answers, results");
  survey->require_subcommand(1);
  auto o = std::make_shared<SurveyOptions>();
  const auto sub = [&](const char* name, const char* help, int (*action)(const SurveyOptions&)) {
    CLI::App* command = survey->add_subcommand(name, help);
    command->add_option("survey", o->survey, "name from surveys/ or path of a .toml file")
        ->capture_default_str()
        ->type_name("SURVEY");
    command->callback([o, action, &exit_code] { exit_code = action(*o); });
    return command;
  };
  sub("show", "questions and scale", [](const SurveyOptions& c) {
    const Questionnaire q = read_questionnaire(c.survey);
    std::printf("%s (version %s)\n%s\n", q.title.c_str(), q.version.c_str(), q.source.c_str());
    for (const Question& one : q.question)
      std::printf("%-6s %s%s\n", one.key.c_str(), one.text.c_str(),
                  one.free ? "  (free text)" : fmt::format("  ({} to {})", q.low, q.high).c_str());
    return 0;
  });
  CLI::App* import =
      sub("import", "answers from a table: respondent, group, one column per question", [](const SurveyOptions& c) {
        const Questionnaire q = read_questionnaire(c.survey);
        const std::vector<SurveyAnswer> answers = answers_of_csv(q, read_file(c.file), c.file, utc_now());
        Store store = open_store(c.store);
        store.add_answers(answers);
        std::printf("%zu answers stored in %s\n", answers.size(), store.name().c_str());
        return 0;
      });
  import->add_option("file", o->file, "table")->required()->type_name("FILE.csv");
  add_store_option(*import, o->store);
  CLI::App* results = sub("results", "medians, percentages, box plots", [](const SurveyOptions& c) {
    const Questionnaire q = read_questionnaire(c.survey);
    check_suffix(c.html, ".html", "--html");
    for (const std::string& path : {c.html, c.csv}) prepare_output(path);
    const Store store = open_store(c.store);
    const std::vector<SurveyAnswer> answers = store.answers(q.name);
    const SurveyResult result = evaluate(q, answers);
    std::fputs(survey_summary(q, result).c_str(), stdout);
    if (!c.html.empty()) write_output(c.html, html_page("survey", q.title, survey_data(q, result)));
    if (!c.csv.empty()) write_output(c.csv, answers_csv(q, answers));
    return 0;
  });
  results->add_option("--html", o->html, "page with box plots")->type_name("FILE.html");
  results->add_option("--csv", o->csv, "all answers")->type_name("FILE.csv");
  add_store_option(*results, o->store);
}

}  // namespace

void add_records(CLI::App& app, int& exit_code) {
  add_store(app, exit_code);
  add_report(app, exit_code);
  add_survey(app, exit_code);
}

}  // namespace catgut
