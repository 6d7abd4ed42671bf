// SPDX-License-Identifier: Apache-2.0
// tests/validation: every line of `catgut validate` holds.
#include "validation/validation.h"

#include <gtest/gtest.h>

#include "validation/contact_scenes.h"
#include "validation/swept.h"

namespace catgut {
namespace {

TEST(Validation, every_check_holds) {
  const std::vector<ValidationLine> lines = run_validation();
  EXPECT_GT(lines.size(), 40u);
  for (const ValidationLine& l : lines)
    EXPECT_TRUE(l.ok) << l.name << ": expected " << l.expected << " " << l.unit << ", got " << l.got << ", error " << l.error
                      << " above " << l.tolerance << " (" << l.source << ")";
}

// Random events of `contact` in which something sank in by 0.6 to 3.2 mm: needles that were slowed within a step, thread in a
// pit of four faces, walls in a crease. An event after another one that hooked the thread is not among them (docs/physical.md).
TEST(Contact, nothing_sinks_in_where_it_did_before) {
  using namespace validation;
  const std::pair<ContactBody, int> events[] = {{ContactBody::tube, 177}, {ContactBody::tube, 201}, {ContactBody::tube, 1381},
                                                {ContactBody::pads, 118}, {ContactBody::tubes, 43}, {ContactBody::tubes, 1395}};
  for (const auto& [body, number] : events) {
    ContactBench bench(11, body);
    bench.events = number / 5 * 5;  // where its group begins, at rest
    while (bench.events <= number) bench.event(8, 1);
    for (int p = 0; p < kContactPairs; ++p) {
      EXPECT_LE(bench.deepest[p], 0.3e-3f) << name_of(body) << " " << number << " " << name_of(static_cast<ContactPair>(p));
      EXPECT_EQ(bench.passed[p], 0) << name_of(body) << " " << number << " " << name_of(static_cast<ContactPair>(p));
    }
  }
}

// The judge of knot/names can say no: one strand moves through another, or past its end, or touches it and turns back.
TEST(Validation, a_strand_that_passes_through_another_is_counted) {
  using validation::Place;
  std::vector<Place> before(6), after;
  const std::vector<uint8_t> broken{0, 0, 1, 0, 0};
  for (size_t i = 0; i < 3; ++i) {
    const double x = 1e-3 * (static_cast<double>(i) - 0.7);
    before[i] = {x, 0, 0}, before[3 + i] = {0, x, 0.2e-3};
  }
  after = before;
  for (size_t i = 3; i < 6; ++i) after[i].z = -0.2e-3;
  EXPECT_EQ(validation::count_passes(before, after, broken), 1);
  EXPECT_EQ(validation::count_passes(after, before, broken), 1);
  for (size_t i = 3; i < 6; ++i) after[i].z = 0.01e-3;
  EXPECT_EQ(validation::count_passes(before, after, broken), 0);
  for (size_t i = 3; i < 6; ++i) before[i].x = after[i].x = 2e-3, after[i].z = -0.2e-3;
  EXPECT_EQ(validation::count_passes(before, after, broken), 0);
}

}  // namespace
}  // namespace catgut
