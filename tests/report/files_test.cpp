// SPDX-License-Identifier: Apache-2.0
// tests/report: files from outside. Tables, questionnaires, session files: right ones read exactly, wrong ones are one line,
// and random damage never gives anything else.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <regex.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include <nlohmann/json.hpp>

#include "core/check.h"
#include "report/csv.h"
#include "report/data.h"
#include "report/session_file.h"
#include "report/survey.h"

namespace catgut {
namespace {

struct Scratch {
  std::filesystem::path folder;
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "catgut-report-XXXXXX").string();
    folder = mkdtemp(name.data());
  }
  ~Scratch() { std::filesystem::remove_all(folder); }
  Store store() const {
    StoreOptions options;
    options.where = (folder / "sessions.db").string();
    return Store(options);
  }
};

template <class Body>
std::string fault_of(Body&& body) {
  try {
    body();
  } catch (const InputError& error) { return error.what(); }
  return "";
}

std::string read(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

TEST(Csv, reads_quotes_line_ends_and_separators) {
  const auto rows = read_csv(
      "\xef\xbb\xbf"
      "a,b\r\n\"x, \"\"y\"\"\nz\",2\r\n\r\n3,\n",
      "t.csv");
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[1][0], "x, \"y\"\nz");
  EXPECT_EQ(rows[2], (CsvRow{"3", ""}));
  EXPECT_EQ(read_csv("a;b;c\n1,5;2;3\n", "t.csv")[1], (CsvRow{"1,5", "2", "3"}));
  EXPECT_EQ(read_csv("a\tb\n1\t2", "t.csv")[1], (CsvRow{"1", "2"}));
}

TEST(Csv, faults_name_file_and_line) {
  EXPECT_NE(fault_of([] { read_csv("a,b\n1,2,3\n", "t.csv"); }).find("t.csv:2: 3 cells where the first row has 2"),
            std::string::npos);
  EXPECT_NE(fault_of([] { read_csv("a,b\n\"1,2\n", "t.csv"); }).find("t.csv:2: a quote is not closed"), std::string::npos);
  EXPECT_NE(fault_of([] { read_csv("\"a\"b,c\n", "t.csv"); }).find("t.csv:1"), std::string::npos);
}

TEST(Csv, cells_are_no_formulas) {
  EXPECT_EQ(csv_cell("=HYPERLINK(\"x\")"), "\"'=HYPERLINK(\"\"x\"\")\"");
  EXPECT_EQ(csv_cell("@a"), "'@a");
  EXPECT_EQ(csv_cell("plain"), "plain");
}

// A learning curve of 22 trainees and six sessions, of which P7 missed the last. The numbers are made up: no published table
// can be kept here. The same table in the two usual shapes: a row per trainee, and a row per session.
struct Curve {
  std::string csv, mapping;
};
Curve wide_curve() {
  std::string csv =
      "participant;group;time_1;time_2;time_3;time_4;time_5;time_6;errors_1;errors_2;errors_3;errors_4;errors_5;errors_6\n";
  for (int p = 1; p <= 22; ++p) {
    csv += std::to_string(p) + (p % 2 ? ";novice" : ";resident");
    for (int k = 1; k <= 6; ++k) csv += p == 7 && k == 6 ? ";NA" : ";" + std::to_string(400 - 30 * k + p) + ",5";
    for (int k = 1; k <= 6; ++k) csv += p == 7 && k == 6 ? ";" : ";" + std::to_string(7 - k);
    csv += "\n";
  }
  return {csv,
          "title = \"Learning curve\"\ntask = \"peg_transfer\"\ntrainee = { column = \"participant\", prefix = \"P\" }\n"
          "cohort = { column = \"group\" }\nsessions = 6\nstart = \"2020-02-26\"\nduration = { column = \"time_{n}\" }\n"
          "[[metric]]\ncolumn = \"time_{n}\"\nname = \"time\"\nunit = \"s\"\n[[metric]]\ncolumn = \"errors_{n}\"\nname = "
          "\"errors\"\n"};
}
Curve long_curve() {
  std::string csv = "ID,training_group,session_no,completion_time_s,n_errors\n";
  for (int k = 6; k >= 1; --k)
    for (int p = 22; p >= 1; --p)
      if (p != 7 || k != 6)
        csv += std::to_string(p) + (p % 2 ? ",novice," : ",resident,") + std::to_string(k) + "," +
               std::to_string(400 - 30 * k + p) + ".5," + std::to_string(7 - k) + "\n";
  return {csv,
          "title = \"Learning curve\"\ntask = \"peg_transfer\"\ntrainee = { column = \"ID\", prefix = \"P\" }\n"
          "cohort = { column = \"training_group\" }\nsession = { column = \"session_no\" }\nstart = \"2020-02-26\"\n"
          "duration = { column = \"completion_time_s\" }\n[[metric]]\ncolumn = \"completion_time_s\"\nname = \"time\"\nunit = "
          "\"s\"\n[[metric]]\ncolumn = \"n_errors\"\nname = \"errors\"\n"};
}

// What a learning curve is made of, by trainee and start.
std::map<std::pair<std::string, std::string>, std::vector<double>> points_of(const std::vector<Session>& all) {
  std::map<std::pair<std::string, std::string>, std::vector<double>> points;
  for (const Session& s : all) {
    std::vector<double>& p = points[{s.trainee, s.started}];
    p.push_back(s.duration_s);
    for (const Metric& m : s.metric) p.push_back(m.value);
  }
  return points;
}

TEST(Table, a_row_per_trainee_and_a_row_per_session_give_the_same_curves) {
  const Curve wide = wide_curve(), long_one = long_curve();
  const auto a = points_of(sessions_of_table(wide.csv, "wide.csv", wide.mapping, "wide.toml", nullptr));
  const auto b = points_of(sessions_of_table(long_one.csv, "long.csv", long_one.mapping, "long.toml", nullptr));
  EXPECT_EQ(a.size(), 22u * 6 - 1);
  EXPECT_EQ(a, b);
}

TEST(Table, a_wide_table_of_a_learning_curve_is_imported_by_its_mapping_alone) {
  const auto [csv, mapping] = wide_curve();
  std::vector<Person> people;
  const std::vector<Session> all = sessions_of_table(csv, "curve.csv", mapping, "curve.toml", &people);
  EXPECT_EQ(people.size(), 22u);
  EXPECT_EQ(all.size(), 22u * 6 - 1) << "P7 missed the last one";
  const Scratch scratch;
  Store store = scratch.store();
  store.add_all(all);
  for (const Person& p : people) store.put_person(p);
  SessionFilter one;
  one.trainee = "P3";
  const auto time = store.values("time", one);
  ASSERT_EQ(time.size(), 6u);
  for (size_t k = 0; k < 6; ++k) EXPECT_DOUBLE_EQ(time[k].value, 400 - 30 * static_cast<double>(k + 1) + 3.5);
  EXPECT_EQ(store.sessions(one)[4].started, "2020-03-02T12:00:00Z") << "after 29 February";
  EXPECT_EQ(store.person("P3").cohort, "novice");
  EXPECT_EQ(store.add_all(all).size(), all.size());
  EXPECT_EQ(store.sessions().size(), all.size()) << "the same table again adds nothing";
}

// The columns of a published learning curve of suturing (Pavlidis et al. 2019, 10.1038/s41598-019-38727-z: fifteen students,
// five sessions, one row per student, times as minutes:seconds, a remark in the last column). The values are made up.
TEST(Table, the_columns_of_a_published_learning_curve_are_imported_by_a_mapping_alone) {
  std::string csv = "Subject,Age,MS-Year,Sex";
  for (int n = 1; n <= 5; ++n) csv += fmt::format(",Cutting Time {0},Suturing Time {0},Sutures {0},Score {0}", n);
  csv += ",Comments\n";
  for (int subject = 1; subject <= 15; ++subject) {
    csv += fmt::format("{},23,1,{}", subject, 1 + subject % 2);
    for (int n = 1; n <= 5; ++n)
      csv += fmt::format(",{}:{:02},{}:{:02},{},{}", 9 - n, subject, 20 - n, 2 * subject, 1.5 * n - 0.5, 10 + 2 * n);
    csv += subject == 3 ? ",\"left early, came back\"\n" : ",\n";
  }
  const std::string mapping =
      "title = \"Microsurgery\"\ntask = \"microsurgical_suturing\"\ntrainee = { column = \"Subject\", prefix = \"S\" }\n"
      "level = { column = \"MS-Year\", prefix = \"MS\" }\nsessions = 5\nscore = { column = \"Score {n}\" }\nscore_max = 30\n"
      "duration = { column = \"Suturing Time {n}\" }\n[[metric]]\ncolumn = \"Cutting Time {n}\"\nname = \"cutting_time\"\n"
      "unit = \"s\"\n[[metric]]\ncolumn = \"Sutures {n}\"\nname = \"sutures\"\n";
  std::vector<Person> people;
  const std::vector<Session> all = sessions_of_table(csv, "curve.csv", mapping, "curve.toml", &people);
  ASSERT_EQ(all.size(), 75u);
  ASSERT_EQ(people.size(), 15u);
  EXPECT_EQ(people[2].level, "MS1");
  const Scratch scratch;
  Store store = scratch.store();
  store.add_all(all);
  SessionFilter one;
  one.trainee = "S4";
  const auto cutting = store.values("cutting_time", one), sutures = store.values("sutures", one);
  const std::vector<Session> rows = store.sessions(one);
  ASSERT_EQ(rows.size(), 5u);
  for (size_t k = 0; k < 5; ++k) {
    const double n = static_cast<double>(k) + 1;
    EXPECT_EQ(cutting[k].value, (9 - n) * 60 + 4);
    EXPECT_EQ(rows[k].duration_s, (20 - n) * 60 + 8);
    EXPECT_EQ(rows[k].score, 10 + 2 * n);
    EXPECT_EQ(sutures[k].value, 1.5 * n - 0.5);
  }
}

TEST(Table, times_are_seconds_or_have_colons) {
  const std::string mapping =
      "task = \"t\"\ntrainee = { column = \"who\" }\nsession = { column = \"n\" }\nscore = { column = \"s\" }\n"
      "duration = { column = \"t\" }\n";
  const auto duration = [&](const std::string& cell) {
    return sessions_of_table("who,n,s,t\nA,1,5," + cell + "\n", "t.csv", mapping, "t.toml", nullptr)[0].duration_s;
  };
  EXPECT_EQ(duration("95.5"), 95.5);
  EXPECT_EQ(duration("9:55"), 595);
  EXPECT_EQ(duration("0:09.5"), 9.5);
  EXPECT_EQ(duration("1:02:03"), 3723);
  for (const char* bad : {"9:75", "9:", ":30", "1:2:3:4", "9:-5", "a:30", "1:60:00"})
    EXPECT_NE(fault_of([&] { duration(bad); }).find("is not a time"), std::string::npos) << bad;
}

TEST(Table, a_long_table_is_in_the_order_of_its_sessions) {
  const std::string csv = "who,n,score\nA,2,20\nA,1,10\nB,1,5\n";
  const std::string mapping =
      "task = \"t\"\ntrainee = { column = \"who\" }\nsession = { column = \"n\" }\nscore = { column = \"score\" }\npass_at = "
      "15\n";
  const auto all = sessions_of_table(csv, "t.csv", mapping, "t.toml", nullptr);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].score, 10);
  EXPECT_EQ(all[2].score, 20);
  EXPECT_EQ(all[2].passed, 1);
  EXPECT_EQ(all[0].passed, 0);
}

TEST(Table, faults_say_which_column_and_row) {
  const std::string base = "task = \"t\"\ntrainee = { column = \"who\" }\nsession = { column = \"n\" }\n";
  const auto fault = [&](const std::string& csv, const std::string& mapping) {
    return fault_of([&] { sessions_of_table(csv, "t.csv", mapping, "t.toml", nullptr); });
  };
  EXPECT_NE(fault("who,n,s\nA,1,x\n", base + "score = { column = \"s\" }\n")
                .find("t.csv: row 2: \"x\" in column score is not a number"),
            std::string::npos);
  EXPECT_NE(
      fault("who,n\nA,1\n", base + "score = { column = \"s\" }\n").find("there is no column \"s\"; the columns are n, who"),
      std::string::npos);
  EXPECT_NE(fault("who,n\nA,1\n", base + "colour = 1\n").find("key \"colour\" is unknown"), std::string::npos);
  EXPECT_NE(fault("who,n\nA,1\n", "task = [\n").find("t.toml:"), std::string::npos);
}

TEST(Survey, table_5_is_the_default_and_its_percentages_are_those_of_the_paper) {
  const Questionnaire q =
      parse_questionnaire(read(CATGUT_SOURCE_DIR "/surveys/rectal_prolapse.toml"), "s.toml", "rectal_prolapse");
  ASSERT_EQ(q.question.size(), 5u);
  EXPECT_EQ(q.question[3].text, "Rate the realism of the force feedback in the simulator");
  // 24 respondents; 17, 17, 17, 12 and 13 of them rated moderate or higher (paper 3.6).
  const int favorable[] = {17, 17, 17, 12, 13};
  std::string csv = "respondent,group,Q1,Q2,Q3,Q4,Q5\r\n";
  for (int r = 0; r < 24; ++r) {
    csv += "R" + std::to_string(r) + (r < 12 ? ",novice" : ",expert");
    for (int n : favorable) csv += r < n ? "," + std::to_string(3 + r % 3) : "," + std::to_string(1 + r % 2);
    csv += "\r\n";
  }
  const auto answers = answers_of_csv(q, csv, "a.csv", "2026-11-22T21:05:00Z");
  ASSERT_EQ(answers.size(), 120u);
  const SurveyResult result = evaluate(q, answers);
  EXPECT_EQ(result.respondents, 24u);
  const int percent[] = {71, 71, 71, 50, 54};
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(result.row[i].favorable, static_cast<size_t>(favorable[i]));
    EXPECT_EQ(std::lround(100.0 * static_cast<double>(result.row[i].favorable) / static_cast<double>(result.row[i].box.n)),
              percent[i]);
  }
  EXPECT_LT(result.p.at("Q4"), 0.01);
  // Out and in again.
  const auto again = answers_of_csv(q, answers_csv(q, answers), "b.csv", "2026-11-22T21:05:00Z");
  ASSERT_EQ(again.size(), answers.size());
  for (size_t i = 0; i < answers.size(); ++i) EXPECT_EQ(again[i].value, answers[i].value);
}

TEST(Survey, faults_are_one_line) {
  const Questionnaire q =
      parse_questionnaire("version = \"1\"\ntitle = \"t\"\n[[question]]\nkey = \"Q1\"\ntext = \"?\"\n", "s.toml", "s");
  const auto import = [&](const std::string& csv) { return fault_of([&] { answers_of_csv(q, csv, "a.csv", ""); }); };
  EXPECT_NE(import("respondent,Q1\nA,6\n").find("the rating 6 is not 1 to 5"), std::string::npos);
  EXPECT_NE(import("respondent,Q1\nA,2.5\n").find("the rating 2.5"), std::string::npos);
  EXPECT_NE(import("respondent,Q1\nA,good\n").find("\"good\" is not a rating"), std::string::npos);
  EXPECT_NE(import("respondent,Q9\nA,1\n").find("column \"Q9\""), std::string::npos);
  const auto form = [&](const std::string& toml) { return fault_of([&] { parse_questionnaire(toml, "s.toml", "s"); }); };
  EXPECT_NE(form("version = \"1\"\ntitle = \"t\"\n").find("has no [[question]]"), std::string::npos);
  EXPECT_NE(form("version = \"1\"\ntitle = \"t\"\n[[question]]\nkey = \"a b\"\ntext = \"?\"\n").find("s.toml:"),
            std::string::npos);
  EXPECT_NE(form("version = \"1\"\ntitle = \"t\"\n[scale]\nlow = 5\nhigh = 1\n[[question]]\nkey = \"a\"\ntext = \"?\"\n")
                .find("scale"),
            std::string::npos);
}

const char* const kAssessment =
    R"({"assessment": 1, "catgut": "0.1.0", "scene": "stay", "tick_s": 0.01, "first_tick": 100, "time_s": 12.5,
 "bites": [{"tick": 600, "wall": 0, "along_in_mm": 10, "along_out_mm": 14, "edge_in_mm": 4, "edge_out_mm": null, "spacing_mm": null, "depth_fraction": 0.7}],
 "knots": [], "metrics": [{"key": "bites", "name": "completed bites", "unit": "", "value": 1, "samples": []}, {"key": "gap", "unit": "mm", "value": null}],
 "scores": [{"rubric": "stay", "title": "Stay suture", "version": "1", "points": 18, "of": 20, "passed": true,
   "items": [], "lost": [{"item": "edge_in", "why": "too far </script><script>alert(1)</script>", "of": "bite 1", "points": 2, "time_s": 5, "critical": false}]}]})";
const char* const kInteractive =
    R"({"catgut": "0.1.0", "scene": "stay", "time_s": 12.5, "bites": 1, "edges": [{"length_mm": 126.5}], "stitches": [],
 "tension": {"time_s": [0, 0.1], "peak_n": [0.1, 0.2], "needle_n": [0, 0]}, "events": [{"tick": 1, "time_s": 0.5, "event": "bite_completed", "fault": "wrong_order"}]})";

TEST(SessionFile, an_assessment_and_an_interactive_session_make_one_session) {
  Session s;
  read_session_json(kAssessment, "a.json", s);
  read_session_json(kInteractive, "b.json", s);
  EXPECT_EQ(s.task, "stay");
  EXPECT_EQ(s.score, 18);
  EXPECT_EQ(s.score_max, 20);
  EXPECT_EQ(s.passed, 1);
  EXPECT_EQ(s.metric.size(), 1u) << "a metric that was not observed is left out";
  ASSERT_EQ(s.lost.size(), 1u);
  EXPECT_EQ(s.lost[0].at_s, 5);
  ASSERT_EQ(s.event.size(), 1u);
  EXPECT_EQ(s.event[0].text, "wrong_order");
  const auto details = nlohmann::json::parse(s.details);
  EXPECT_EQ(details["bites"][0]["time_s"], 5.0);
  EXPECT_EQ(details["lines"][0]["length_mm"], 126.5);
  EXPECT_EQ(details["tension"]["peak_n"][1], 0.2);
}

TEST(SessionFile, an_export_reads_back_as_the_same_session) {
  Session s;
  read_session_json(kAssessment, "a.json", s);
  s.trainee = "T01";
  s.started = "2026-11-22T21:05:00Z";
  s.uid = "abc";
  const std::string json = session_to_json(s);
  const Session back = read_sessions_json(json, "e.json").at(0);
  EXPECT_EQ(session_to_json(back), json);
}

TEST(SessionFile, hostile_files_are_one_line_or_a_session) {
  std::mt19937 random(7);
  const std::string starts[] = {kAssessment, kInteractive};
  int refused = 0;
  for (int n = 0; n < 4000; ++n) {
    std::string text = starts[n % 2];
    for (int k = 0; k < 1 + n % 6; ++k) {
      const size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, 1 + random() % 20);
          break;
        case 2:
          text.insert(at, std::string("[{\"null").substr(random() % 6));
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), 30));
          break;
      }
      if (text.empty()) text = "{";
    }
    Session s;
    const std::string fault = fault_of([&] { read_session_json(text, "x.json", s); });
    EXPECT_EQ(fault.find('\n'), std::string::npos);
    refused += !fault.empty();
  }
  EXPECT_GT(refused, 1000);
  const std::string deep(200000, '[');
  EXPECT_NE(fault_of([&] { read_sessions_json(deep, "deep.json"); }), "");
  EXPECT_NE(
      fault_of([&] { read_sessions_json("{\"assessment\": 1, \"metrics\": 5}", "x.json"); }).find("metrics is not a list"),
      std::string::npos);
}

TEST(Files, damaged_tables_and_questionnaires_are_one_line_or_read) {
  std::mt19937 random(11);
  const std::string survey = read(CATGUT_SOURCE_DIR "/surveys/rectal_prolapse.toml"),
                    table = "respondent,group,Q1\nA,novice,3\nB,\"x\ny\",4\n";
  for (int n = 0; n < 3000; ++n) {
    std::string text = n % 2 ? survey : table;
    for (int k = 0; k < 1 + n % 4; ++k)
      text[random() % text.size()] = static_cast<char>(n % 3 ? "\"[]{},=\n#'"[random() % 10] : random());
    const std::string fault = fault_of([&] {
      if (n % 2) parse_questionnaire(text, "s.toml", "s");
      else read_csv(text, "t.csv");
    });
    EXPECT_EQ(fault.find('\n'), std::string::npos);
  }
}

TEST(Page, no_text_of_the_store_becomes_markup) {
  const Scratch scratch;
  Store store = scratch.store();
  Session s;
  read_session_json(kAssessment, "a.json", s);
  s.trainee = "T01", s.started = "2026-11-22T21:05:00Z";
  s.station = "<img src=x onerror=alert(1)>";
  const int64_t id = store.add(s);
  store.put_person({"T01", Role::trainee, "</title><script>", "", 0});
  for (const std::string& page :
       {html_page("session", "a<b>&\"'", session_data(store, id)), html_page("trainee", "t", trainee_data(store, "T01")),
        html_page("educator", "t", overview_data(store))}) {
    size_t scripts = 0;
    for (size_t at = 0; (at = page.find("<script", at)) != std::string::npos; ++at) ++scripts;
    EXPECT_EQ(scripts, 4u) << "the data, D3, charts and the page's own";
    EXPECT_EQ(page.find("<img"), std::string::npos);
    EXPECT_EQ(page.find("alert(1)</script>"), std::string::npos);
    EXPECT_EQ(page.find("src=\"http"), std::string::npos) << "nothing is loaded";
  }
  EXPECT_NE(html_page("session", "a<b>&\"'", "{}").find("<title>a&lt;b&gt;&amp;&quot;&#39;</title>"), std::string::npos);
}

TEST(Data, numbers_of_a_trainee_against_the_cohort) {
  const Scratch scratch;
  Store store = scratch.store();
  std::vector<Session> all;
  for (int p = 0; p < 5; ++p)
    for (int k = 0; k < 3; ++k) {
      Session s;
      s.uid = "p" + std::to_string(p) + "k" + std::to_string(k);
      s.trainee = "T" + std::to_string(p), s.task = "stay", s.started = "2026-11-0" + std::to_string(k + 1) + "T08:00:00Z";
      s.score = 10 * p + k, s.score_max = 50, s.passed = k > 0;
      s.metric = {{"gap", 5.0 - p, "mm", kUnknown, kUnknown}};
      all.push_back(s);
    }
  const std::vector<int64_t> ids = store.add_all(all);
  for (int p = 0; p < 5; ++p) store.put_person({"T" + std::to_string(p), Role::trainee, "autumn", "", 0});
  store.add_assignment({0, "autumn", "stay", 20, 2, ""});
  const auto trainee = nlohmann::json::parse(trainee_data(store, "T3"));
  EXPECT_EQ(trainee["tasks"][0]["percentile"], 75.0) << "three of four others have a smaller newest score";
  EXPECT_EQ(trainee["tasks"][0]["curve"][1]["median"], 21.0);
  EXPECT_EQ(trainee["tasks"][0]["cusum"]["line"].size(), 3u);
  EXPECT_EQ(trainee["assignments"][0]["done"], 3);
  const auto session = nlohmann::json::parse(session_data(store, ids[14]));
  EXPECT_EQ(session["metrics"][0]["rank"], 0.0);
  EXPECT_EQ(session["metrics"][0]["others"], 4u);
  const auto overview = nlohmann::json::parse(overview_data(store));
  EXPECT_EQ(overview["sessions"]["id"].size(), 15u);
  EXPECT_EQ(overview["assignments"][0]["finished"], 3u);
  EXPECT_EQ(overview["assignments"][0]["behind"].size(), 2u);
}

// A store with what is awkward to write: quotes, line ends, formulas, numbers without a short form, and missing values.
void fill(Store& store) {
  store.put_person({"T01", Role::trainee, "=1+1", "PGY2; \"night\"", 0});
  store.put_person({"T02", Role::trainee, "autumn, \xc3\xa9", "", 0});
  for (int n = 0; n < 6; ++n) {
    Session s;
    s.trainee = n % 2 ? "T02" : "T01", s.task = n < 4 ? "stay" : "purse_string";
    if (n > 0) s.uid = "s" + std::to_string(n);  // the first one gets a UUID
    s.started = "2026-11-22T21:05:0" + std::to_string(n) + "Z";
    s.duration_s = 61.0 + n / 3.0;
    s.score = n == 3 ? kUnknown : 100.0 / (n + 3), s.score_max = n == 3 ? kUnknown : 100, s.passed = n == 3 ? -1 : n % 2;
    s.rubric = "stay, version \"2\"", s.program = "0.1.0";
    s.settings = "{\"feedback\":\"live\"}", s.details = "{\"text\":\"a\\nb\"}";
    s.metric = {{"gap", 0.1 * n, "mm", kUnknown, 2}, {"bites", 12.0, "1", 10, kUnknown}};
    if (n == 2) s.metric.push_back({"lumen", 1.0 / 3, "1", kUnknown, kUnknown});
    s.event = {{1.5, "bite_completed", "line\r\nend"}};
    s.lost = {{"gap", "the edges are apart, \"a leak\"", "pair 1", 5.5, kUnknown, n == 1}};
    store.add(s);
  }
}

TEST(Export, json_makes_the_same_store_again) {
  const Scratch here, there;
  Store store = here.store(), other = there.store();
  fill(store);
  const std::string json = sessions_to_json(store, {});
  other.add_all(read_sessions_json(json, "e.json"));
  EXPECT_EQ(sessions_to_json(other, {}), json);
  ASSERT_EQ(other.sessions().size(), 6u);
  other.add_all(read_sessions_json(json, "e.json"));
  EXPECT_EQ(other.sessions().size(), 6u) << "twice adds nothing";
  // Of one person: that person's sessions and no others.
  const auto one = read_sessions_json(person_to_json(store, "T02"), "p.json");
  ASSERT_EQ(one.size(), 3u);
  for (const Session& s : one) EXPECT_EQ(s.trainee, "T02");
}

TEST(Export, csv_reads_back_to_the_bit) {
  const Scratch scratch;
  Store store = scratch.store();
  fill(store);
  const std::string csv = sessions_csv(store, {});
  const auto rows = read_csv(csv, "e.csv");
  ASSERT_EQ(rows.size(), 7u);
  const auto column = [&](const std::string& name) {
    const auto found = std::find(rows[0].begin(), rows[0].end(), name);
    EXPECT_NE(found, rows[0].end()) << name;
    return static_cast<size_t>(found - rows[0].begin());
  };
  const size_t gap = column("gap [mm]"), lumen = column("lumen"), score = column("score"), passed = column("passed");
  const std::vector<Session> all = store.sessions();
  for (size_t n = 0; n < 6; ++n) {
    const CsvRow& row = rows[n + 1];
    EXPECT_EQ(row[column("uid")], all[n].uid);
    EXPECT_EQ(row[column("started")], all[n].started);
    EXPECT_EQ(row[column("rubric")], all[n].rubric);
    EXPECT_EQ(std::stod(row[column("duration_s")]), all[n].duration_s);
    EXPECT_EQ(std::stod(row[gap]), 0.1 * static_cast<double>(n));
    EXPECT_EQ(row[passed], n == 3 ? "" : n % 2 ? "1" : "0");
    EXPECT_EQ(row[score].empty(), n == 3);
    EXPECT_EQ(row[lumen].empty(), n != 2) << "a missing value is empty, not 0";
    if (n != 3) { EXPECT_EQ(std::stod(row[score]), all[n].score); }
    if (n == 2) { EXPECT_EQ(std::stod(row[lumen]), 1.0 / 3); }
    EXPECT_EQ(row[column("cohort")], n % 2 ? "autumn, \xc3\xa9" : "'=1+1") << "a spreadsheet must not compute it";
  }
  // And as a table of a learning curve, without code.
  const auto again = sessions_of_table(csv, "e.csv",
                                       "task = { column = \"task\" }\ntrainee = { column = \"trainee\" }\n"
                                       "session = { column = \"id\" }\nscore = { column = \"score\" }\n"
                                       "[[metric]]\ncolumn = \"gap [mm]\"\nname = \"gap\"\nunit = \"mm\"\n",
                                       "m.toml", nullptr);
  ASSERT_EQ(again.size(), 6u);
  for (size_t n = 0; n < 6; ++n) {
    EXPECT_EQ(again[n].trainee, all[n].trainee);
    EXPECT_EQ(again[n].task, all[n].task);
    ASSERT_EQ(again[n].metric.size(), 1u);
    EXPECT_EQ(again[n].metric[0].value, 0.1 * static_cast<double>(n));
  }
}

// The rules of xAPI 1.0.3, part two, for what a statement here contains.
void expect_valid(const nlohmann::json& s) {
  const auto only = [](const nlohmann::json& j, const std::set<std::string>& keys) {
    for (const auto& [key, value] : j.items()) EXPECT_TRUE(keys.count(key)) << key;
  };
  const auto matches = [](const nlohmann::json& j, const char* form) {
    regex_t compiled;  // POSIX: GCC 12 warns about its own std::regex under sanitizers
    if (!j.is_string() || regcomp(&compiled, ("^(" + std::string(form) + ")$").c_str(), REG_EXTENDED | REG_NOSUB) != 0)
      return false;
    const bool found = regexec(&compiled, j.get<std::string>().c_str(), 0, nullptr, 0) == 0;
    regfree(&compiled);
    return found;
  };
  constexpr const char* kIri = "[a-z]+://[^ <>\"]+";
  only(s, {"id", "actor", "verb", "object", "result", "context", "timestamp"});
  if (s.contains("id")) {
    EXPECT_TRUE(matches(s["id"], "[0-9a-f]{8}-[0-9a-f]{4}-[1-5][0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}")) << s["id"];
  }
  only(s["actor"], {"objectType", "account"});
  EXPECT_EQ(s["actor"]["objectType"], "Agent");
  EXPECT_TRUE(matches(s["actor"]["account"]["homePage"], kIri));
  EXPECT_TRUE(matches(s["actor"]["account"]["name"], ".+"));
  EXPECT_TRUE(matches(s["verb"]["id"], kIri));
  EXPECT_TRUE(s["verb"]["display"].is_object());
  EXPECT_EQ(s["object"]["objectType"], "Activity");
  EXPECT_TRUE(matches(s["object"]["id"], kIri));
  EXPECT_TRUE(matches(s["object"]["definition"]["type"], kIri));
  only(s["result"], {"completion", "duration", "success", "score"});
  EXPECT_TRUE(matches(s["result"]["duration"], "PT[0-9]+(\\.[0-9]{1,2})?S")) << s["result"]["duration"];
  if (s["result"].contains("score")) {
    const auto& score = s["result"]["score"];
    only(score, {"raw", "min", "max", "scaled"});
    if (score.contains("max")) {
      EXPECT_LT(score["min"].get<double>(), score["max"].get<double>());
      EXPECT_LE(score["min"].get<double>(), score["raw"].get<double>());
      EXPECT_LE(score["raw"].get<double>(), score["max"].get<double>());
    }
    if (score.contains("scaled")) { EXPECT_LE(std::abs(score["scaled"].get<double>()), 1); }
  }
  EXPECT_TRUE(matches(s["timestamp"], "[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}Z")) << s["timestamp"];
}

TEST(Export, xapi_statements_are_valid_and_say_what_the_store_says) {
  const Scratch scratch;
  Store store = scratch.store();
  fill(store);
  const auto statements = nlohmann::json::parse(sessions_to_xapi(store, {}, "https://example.org"));
  const std::vector<Session> all = store.sessions();
  ASSERT_EQ(statements.size(), all.size());
  for (size_t n = 0; n < all.size(); ++n) {
    const auto& s = statements[n];
    expect_valid(s);
    EXPECT_EQ(s.contains("id"), n == 0) << "a UUID, or the receiver gives one";
    EXPECT_EQ(s["actor"]["account"]["name"], all[n].trainee);
    EXPECT_EQ(s["timestamp"], all[n].started);
    EXPECT_EQ(s["object"]["id"], "https://example.org/tasks/" + all[n].task);
    EXPECT_EQ(s["result"].contains("success"), all[n].passed >= 0);
    EXPECT_EQ(s["result"].contains("score"), n != 3) << "no score was given";
    if (n == 3) continue;
    EXPECT_EQ(s["result"]["score"]["raw"].get<double>(), all[n].score);
    EXPECT_EQ(s["result"]["success"].get<bool>(), all[n].passed > 0);
  }
}

TEST(Export, xapi_statements_have_what_the_standard_requires) {
  const Scratch scratch;
  Store store = scratch.store();
  Session s;
  s.trainee = "T01", s.task = "stay", s.started = "2026-11-22T21:05:00Z", s.duration_s = 61.5, s.score = 60, s.score_max = 50,
  s.passed = 0;
  store.add(s);
  const auto all = nlohmann::json::parse(sessions_to_xapi(store, {}, "https://example.org"));
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0]["actor"]["account"]["name"], "T01");
  EXPECT_EQ(all[0]["verb"]["id"], "http://adlnet.gov/expapi/verbs/failed");
  EXPECT_EQ(all[0]["object"]["id"], "https://example.org/tasks/stay");
  EXPECT_EQ(all[0]["result"]["duration"], "PT61.50S");
  EXPECT_EQ(all[0]["result"]["score"]["scaled"], 1.0) << "at most 1";
  expect_valid(all[0]);  // more points than there are
  EXPECT_EQ(all[0]["id"].get<std::string>().size(), 36u);
  const std::string csv = sessions_csv(store, {});
  EXPECT_NE(csv.find("T01,,,stay,2026-11-22T21:05:00Z,61.5,60,50,0"), std::string::npos) << csv;
}

}  // namespace
}  // namespace catgut
