// SPDX-License-Identifier: Apache-2.0
// validation: tools, needles and thread pushed, dragged, dropped and pulled at random against bodies of tissue and each other,
// from outside and through an opening, and hooked bights of thread pulled apart. Seen from outside: no axis of a capsule and no
// segment of thread crosses the middle of the wall, and nothing lies deeper in anything than the bound.
#include <algorithm>
#include <string>

#include "validation/checks.h"
#include "validation/contact_scenes.h"

namespace catgut::validation {

void check_contacts(Lines& out, bool nightly) {
  const int events = nightly ? 1500 : 5, bights = nightly ? 1000 : 10;
  const std::string what = " pushes, drags, drops and pulls to 8 N and 1 m/s, ";
  for (int b = 0; b < kContactBodies; ++b) {
    if (!nightly && b > 1) continue;
    ContactBench bench(11, static_cast<ContactBody>(b));
    float deepest[kContactPairs] = {};
    int passed[kContactPairs] = {}, deeper[kContactPairs] = {};
    for (int i = 0; i < events; ++i) {
      bench.event(8, 1);
      for (size_t p = 0; p < kContactPairs; ++p) {
        deepest[p] = std::max(deepest[p], bench.deepest[p]);
        passed[p] += bench.passed[p] > 0, deeper[p] += bench.deepest[p] > kMostOverlap;
      }
    }
    const std::string name =
        std::string("contact/") + name_of(static_cast<ContactBody>(b)) + ", " + std::to_string(events) + what;
    for (size_t p = 0; p < kContactPairs; ++p) {
      const std::string pair = name + name_of(static_cast<ContactPair>(p));
      out.add(pair + ": events in which one passed through the other", 0, passed[p], 0, "", "nothing passes");
      out.add(pair + ": overlap, above 0.3 mm in " + std::to_string(deeper[p]) + " events", 0, static_cast<double>(deepest[p]),
              double{kMostOverlap}, "m", "at most 0.3 mm");
    }
  }
  int passed = 0;
  float nearest = 1;
  for (int i = 0; i < bights; ++i) passed += pull_hooked_bights(static_cast<uint64_t>(i) + 1, 8, 1, nearest) > 0;
  const std::string name = "contact/" + std::to_string(bights) + " pairs of hooked bights pulled apart to 8 N and 1 m/s, ";
  out.add(name + "pairs in which a strand passed", 0, passed, 0, "", "nothing passes; motion of every pair in every substep");
  out.add(name + "strands nearer than a diameter by", 0, 1 - double{nearest}, 0.2, "diameters", "nothing passes");
}

}  // namespace catgut::validation
