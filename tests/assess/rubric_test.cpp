// SPDX-License-Identifier: Apache-2.0
// tests/assess: rubrics: the shipped ones are valid, bad ones are one clear line, points and reasons are right.
#include "assess/rubric.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "assess/metrics.h"
#include "core/check.h"
#include "technique/technique.h"

namespace catgut::assess {
namespace {

std::string rubric(const std::string& items, const std::string& top = "version = \"1\"\n") { return top + items; }

std::string fault_of(const std::string& text) {
  try {
    parse_rubric(text, "my.toml");
  } catch (const InputError& e) { return e.what(); }
  return "";
}

Result with(const char* key, std::vector<Sample> samples, double value) {
  Result r;
  r.ticks = 600;
  r.metric.push_back({key, value, std::move(samples)});
  return r;
}

TEST(Rubric, every_technique_has_a_valid_one) {
  const std::vector<std::string> names = rubric_names();
  EXPECT_GE(names.size(), 6u);
  for (const std::string& name : names) {
    const Rubric r = read_rubric(name);
    EXPECT_FALSE(r.version.empty());
    for (const RubricItem& i : r.item) EXPECT_FALSE(i.validated) << name << ": no study with people has validated " << i.key;
  }
  for (const TechniqueRow* row : techniques()) EXPECT_EQ(rubric_for(row->name), row->name);
}

TEST(Rubric, bad_ones_are_one_line_with_place_and_remedy) {
  const std::string item = "[[item]]\nmetric = \"spacing\"\nfull = [3, 5]\n";
  EXPECT_EQ(fault_of(rubric(item)), "");
  EXPECT_EQ(fault_of(item), "my.toml: the rubric has no version; add version = \"1\", and raise it with every change");
  EXPECT_EQ(fault_of(rubric("[[item]]\nmetric = \"spaceing\"\nfull = [3, 5]\n")),
            "my.toml:3: there is no metric \"spaceing\"; did you mean \"spacing\"?");
  EXPECT_EQ(fault_of(rubric("[[item]]\nmetric = \"spacing\"\nful = [3, 5]\n")),
            "my.toml:4: an item has no key \"ful\"; did you mean \"full\"?");
  EXPECT_EQ(fault_of(rubric(item, "version = \"1\"\npas = 3\n")),
            "my.toml:2: a rubric has no key \"pas\"; did you mean \"pass\"?");
  EXPECT_NE(fault_of(rubric("[[item]]\nmetric = \"spacing\"\nfull = [5, 3]\n")).find("is empty"), std::string::npos);
  EXPECT_NE(fault_of(rubric("[[item]]\nmetric = \"spacing\"\nfull = [3, 5, 7]\n")).find("write it as [low, high]"),
            std::string::npos);
  EXPECT_NE(fault_of(rubric(item + "half = [3.5, 6]\n")).find("half does not contain full"), std::string::npos);
  EXPECT_NE(fault_of(rubric(item + "weight = -1\n")).find("out of range"), std::string::npos);
  EXPECT_NE(fault_of(rubric(item + "validated = true\n")).find("has no source"), std::string::npos);
  EXPECT_NE(fault_of(rubric(item + item)).find("two items"), std::string::npos);
  EXPECT_NE(fault_of(rubric("")).find("no items"), std::string::npos);
  EXPECT_NE(fault_of("version = \n").find("my.toml:1"), std::string::npos);
  EXPECT_NE(fault_of(rubric("[[item]]\nmetric = \"overloads\"\nfull = [0, 0]\neach = true\n")).find("one by one"),
            std::string::npos);
  for (const std::string& text : {rubric("[[item]]\nfull = [1, 2]\n"), rubric("[[item]]\nmetric = \"spacing\"\n"),
                                  rubric("item = 3\n"), rubric("item = [3]\n"), rubric(item + "full = 1\n")})
    EXPECT_NE(fault_of(text), "") << text;
  EXPECT_EQ(fault_of(rubric(item, "version = \"1\"\nwhole = {bite = 2}\n")),
            "my.toml:2: whole has no key \"bite\"; did you mean \"bites\"?");
  EXPECT_NE(fault_of(rubric(item, "version = \"1\"\nwhole = 2\n")).find("write whole = {bites"), std::string::npos);
  try {
    read_rubric("purse_strng");
    ADD_FAILURE();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "purse_strng: there is no such rubric; did you mean \"purse_string\"?");
  }
}

TEST(Rubric, points_bands_and_reasons) {
  const Rubric r = parse_rubric(
      rubric("[[item]]\nmetric = \"spacing\"\nweight = 10\nfull = [3, 5]\nhalf = [2, 7]\nwhy = \"leaks\"\n"), "my.toml");
  const Score s =
      mark(r, with("spacing",
                   {{4, 10, {}, "bite 1"}, {6, 70, {1, 2, 3}, "bite 2"}, {9, 130, {}, "bite 3"}, {3, 190, {}, "bite 4"}}, 5.5));
  EXPECT_DOUBLE_EQ(s.points, 2.5 + 1.25 + 0 + 2.5);
  ASSERT_EQ(s.lost.size(), 2u);
  EXPECT_EQ(s.lost[0].of, "bite 2");
  EXPECT_EQ(s.lost[0].tick, 70u);
  EXPECT_DOUBLE_EQ(s.lost[0].points, 1.25);
  EXPECT_EQ(s.lost[0].where, (Vec3{1, 2, 3}));
  EXPECT_EQ(s.lost[1].why, "bite 3: spacing: 9 mm, required 3 to 5 mm; leaks (band not validated)");
  EXPECT_NEAR(s.lost[1].time_s, 130.0 / 60, 1e-9);
  EXPECT_FALSE(s.passed);
  EXPECT_NE(s.verdict.find("no study with people"), std::string::npos);
}

TEST(Rubric, a_critical_error_fails_whatever_the_points) {
  const Rubric r = parse_rubric(
      rubric("[[item]]\nmetric = \"square\"\nfull = [0, 1]\ncritical = [0.5, 1]\n", "version = \"1\"\npass = 0\n"), "my.toml");
  EXPECT_TRUE(mark(r, with("square", {{1, 5, {}, {}}}, 1)).passed);
  const Score s = mark(r, with("square", {{0, 5, {}, {}}}, 0));
  EXPECT_DOUBLE_EQ(s.percent, 100);
  EXPECT_FALSE(s.passed);
  ASSERT_EQ(s.lost.size(), 1u);
  EXPECT_TRUE(s.lost[0].critical);
}

TEST(Rubric, every_item_must_pass) {
  const std::string items =
      "[[item]]\nmetric = \"spacing\"\nweight = 99\nfull = [3, 5]\n[[item]]\nmetric = \"time\"\nfull = [0, 60]\n";
  Result r = with("spacing", {{4, 1, {}, {}}}, 4);
  r.metric.push_back({"time", 90, {{90, 1, {}, {}}}});
  EXPECT_TRUE(mark(parse_rubric(rubric(items), "my.toml"), r).passed);
  const Score s = mark(parse_rubric(rubric(items, "version = \"1\"\nevery_item = true\n"), "my.toml"), r);
  EXPECT_FALSE(s.passed);
  EXPECT_NE(s.verdict.find("1 of 2 items"), std::string::npos) << s.verdict;
}

TEST(Rubric, what_was_not_observed_is_lost_or_left_out) {
  const Result none = with("spacing", {}, kNotObserved);
  const std::string item = "[[item]]\nmetric = \"spacing\"\nfull = [3, 5]\n";
  const Score lost = mark(parse_rubric(rubric(item), "my.toml"), none);
  EXPECT_DOUBLE_EQ(lost.points, 0);
  EXPECT_EQ(lost.lost.size(), 1u);
  const Score out = mark(parse_rubric(rubric(item + "required = false\n"), "my.toml"), none);
  EXPECT_DOUBLE_EQ(out.of, 0);
  EXPECT_TRUE(out.lost.empty());
}

// The metrics of an idle session: counts are zero, nothing else was observed.
Result idle_session() {
  Result r;
  r.ticks = 600;
  for (const MetricRow& row : metric_rows())
    r.metric.push_back({row.key, row.summary == Summary::count ? 0.0 : kNotObserved, {}});
  return r;
}

TEST(Rubric, a_session_without_a_stitch_has_no_points_and_the_reason) {
  for (const std::string& name : rubric_names()) {
    const Score s = mark(read_rubric(name), idle_session());
    if (!read_rubric(name).needs_stitch) {  // something else must be done
      EXPECT_FALSE(s.passed) << name;
      continue;
    }
    EXPECT_EQ(s.percent, 0) << name;
    EXPECT_GT(s.of, 0) << name;
    EXPECT_FALSE(s.passed) << name;
    EXPECT_EQ(s.verdict, "failed: no stitch");
    ASSERT_EQ(s.lost.size(), 1u) << name;
    EXPECT_TRUE(s.lost[0].critical);
    EXPECT_DOUBLE_EQ(s.lost[0].points, s.of);
    EXPECT_NE(s.lost[0].why.find("no bite was completed"), std::string::npos);
    EXPECT_EQ(s.item.size(), read_rubric(name).item.size());
  }
  // An exercise without sewing says so, and is judged as usual.
  const std::string item = "[[item]]\nmetric = \"slips\"\nfull = [0, 0]\n";
  EXPECT_EQ(mark(parse_rubric(rubric(item), "my.toml"), idle_session()).percent, 0);
  EXPECT_EQ(mark(parse_rubric(rubric(item, "version = \"1\"\nneeds_stitch = false\n"), "my.toml"), idle_session()).percent,
            100);
}

TEST(Rubric, points_are_summed_by_the_stages_of_an_operation) {
  const Rubric r = read_rubric("altemeier");
  std::vector<std::string> stages;
  for (const RubricItem& i : r.item)
    if (stages.empty() || stages.back() != i.stage) stages.push_back(i.stage);
  // Each once: its items are together.
  EXPECT_EQ(stages, (std::vector<std::string>{"Field", "Excision", "Anastomosis", "Knots", "Hands"}));
  // Four sutures without a fault, then with a granny and with a clamp that tore off.
  Result run = idle_session();
  const auto put = [&](const std::string& key, double value) {
    for (Metric& m : run.metric)
      if (m.key == key)  // a knot of each suture, and both of its ends
        m.value = value, m.sample.assign(key == "throws" ? 4 : key == "tail" ? 8 : 1, Sample{value, 60, {}, {}});
  };
  for (const RubricItem& i : r.item) put(i.metric, i.full.low);
  const Score good = mark(r, run);
  EXPECT_TRUE(good.passed) << good.verdict;
  EXPECT_EQ(good.percent, 100);
  put("square", 0), put("tissue_slips", 1);
  const Score bad = mark(r, run);
  EXPECT_FALSE(bad.passed);
  ASSERT_EQ(bad.lost.size(), 2u);
  const std::string text = score_text(bad);
  EXPECT_NE(text.find(" Field: 7.0 of 10\n"), std::string::npos) << text;
  EXPECT_NE(text.find(" Excision: 22.0 of 22\n"), std::string::npos) << text;
  EXPECT_NE(text.find(" Anastomosis: 80.0 of 80\n"), std::string::npos) << text;
  EXPECT_NE(text.find(" Knots: 26.0 of 38\n"), std::string::npos) << text;
}

TEST(Rubric, a_knot_that_was_not_tied_is_a_critical_error) {
  const Rubric r = parse_rubric(rubric("[[item]]\nmetric = \"slips\"\nweight = 99\nfull = [0, 0]\n"
                                       "[[item]]\nmetric = \"throws\"\nfull = [2, 6]\ncritical = [2, 99]\n"),
                                "my.toml");
  Result one_bite = idle_session();
  for (Metric& m : one_bite.metric)
    if (m.key == "bites") m.value = 1;
  const Score s = mark(r, one_bite);
  EXPECT_EQ(s.percent, 99);
  EXPECT_FALSE(s.passed);
  ASSERT_EQ(s.lost.size(), 1u);
  EXPECT_TRUE(s.lost[0].critical);
}

TEST(Metrics, the_table_is_complete) {
  EXPECT_GE(metric_rows().size(), 30u);
  std::set<std::string> keys;
  for (const MetricRow& r : metric_rows()) {
    EXPECT_TRUE(keys.insert(r.key).second) << r.key;
    EXPECT_GT(std::string(r.definition).size(), 5u) << r.key;
    EXPECT_GT(std::string(r.source).size(), 3u) << r.key;
  }
  std::ifstream in(std::string(CATGUT_SOURCE_DIR) + "/docs/assessment.md");
  std::ostringstream page;
  page << in.rdbuf();
  EXPECT_NE(page.str().find("<!-- metrics -->\n" + metrics_markdown() + "<!-- end -->"), std::string::npos)
      << "update it: tools/update_docs.sh";
}

}  // namespace
}  // namespace catgut::assess
