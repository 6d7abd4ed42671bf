// SPDX-License-Identifier: Apache-2.0
// instrument: the table of models, one row each. A new instrument is a new row; all other code reads it.
#include <algorithm>

#include "instrument/instrument.h"

namespace catgut {
namespace {

// A steel instrument `length` long: jaws of half width `jaw_radius`, then the shaft. The jaws' capsule starts 1.5 mm behind the
// grasp point, so that the jaws do not push out what they hold. The shaft starts 2 mm behind the
// jaws: their capsules have round ends.
RigidModel steel(float mass, float jaw_end, float jaw_radius, float shaft_from, float length, float shaft_radius) {
  RigidModel m;
  m.inv_mass = 1 / mass;
  // Chosen: principal moments of 5e-5 and 2.5e-5 kg m^2 for 50 g, a third of a uniform rod of 180 mm (m L^2 / 12). The
  // coupling to the hand (Weld) must rotate an instrument within a substep; a heavier one lags behind the wrist. Proportional
  // to the mass.
  const float light = 0.05f / mass;
  m.inv_inertia = {2e4f * light, 2e4f * light, 4e4f * light};
  m.capsule.push_back({{0, 0, 0.0015f}, {0, 0, jaw_end}, jaw_radius});
  m.capsule.push_back({{0, 0, shaft_from}, {0, 0, length}, shaft_radius});
  return m;
}

// Masses and lengths are chosen at the size of catalog instruments; none is measured. Grip limits are chosen as well:
//   needle 40 N: above the force of any hand. A locked needle holder does not let the needle turn.
//   thread 15 N: above the knot-pull strength of 3-0 braided silk (about 13 N, USP <881>). The thread fails before the jaws.
//   tissue  6 N for forceps; 12 N for an Allis, whose teeth interlock and whose ratchet keeps them shut.
std::vector<InstrumentModel> make_table() {
  std::vector<InstrumentModel> t;
  // Holding thread and tissue with it is poor technique, and possible. It cuts thread like an Olsen-Hegar, whose blades lie
  // behind its jaws: the paper's four techniques cut without a change of instrument.
  t.push_back({"needle_holder",
               "Needle holder",
               kHoldNeedle | kHoldThread | kHoldTissue | kClamp | kCutThread,
               steel(0.050f, 0.016f, 0.0012f, 0.018f, 0.120f, 0.0025f),
               {0.026f},
               40,
               15,
               6});
  // Toothed tissue forceps. cut_thread: replaces the assistant's scissors, which a scene of two hands does not have.
  t.push_back({"forceps",
               "Toothed forceps",
               kHoldNeedle | kHoldThread | kHoldTissue | kCutThread,
               steel(0.050f, 0.016f, 0.0012f, 0.018f, 0.120f, 0.0025f),
               {0.140f},
               40,
               15,
               6});
  // Atraumatic: wide, finely ridged jaws; it slips where teeth would hold.
  t.push_back({"debakey",
               "DeBakey forceps",
               kHoldNeedle | kHoldThread | kHoldTissue,
               steel(0.040f, 0.020f, 0.0012f, 0.022f, 0.120f, 0.0025f),
               {0.150f},
               10,
               10,
               4});
  t.push_back({"allis",
               "Allis clamp",
               kHoldThread | kHoldTissue | kClamp,
               steel(0.035f, 0.030f, 0.0015f, 0.032f, 0.120f, 0.0025f),
               {0.045f},
               0,
               15,
               12});
  t.push_back({"scissors",
               "Scissors",
               kCutThread | kCutTissue,
               steel(0.045f, 0.030f, 0.0014f, 0.032f, 0.120f, 0.0025f),
               {0.040f},
               0,
               0,
               0});
  t.push_back({"cautery",
               "Electrocautery pencil",
               kCutTissue | kCauterize,
               steel(0.030f, 0.025f, 0.0008f, 0.027f, 0.120f, 0.0050f),
               {},
               0,
               0,
               0});
  t.push_back({"retractor", "Retractor", kRetract, steel(0.060f, 0.025f, 0.0030f, 0.027f, 0.120f, 0.0030f), {}, 0, 0, 0});
  // A folded gauze in a ring forceps: a ball of 10 mm across.
  t.push_back({"swab", "Swab on a holder", kAbsorb, steel(0.040f, 0.004f, 0.0050f, 0.012f, 0.120f, 0.0025f), {}, 0, 0, 0});
  return t;
}

}  // namespace

const std::vector<InstrumentModel>& instrument_table() {
  static const std::vector<InstrumentModel> table = make_table();
  return table;
}

const InstrumentModel* find_instrument(const std::string& name, std::span<const InstrumentModel> own) {
  const auto named = [&](const InstrumentModel& m) { return m.name == name; };
  if (const auto mine = std::find_if(own.begin(), own.end(), named); mine != own.end()) return &*mine;
  const std::vector<InstrumentModel>& table = instrument_table();
  const auto row = std::find_if(table.begin(), table.end(), named);
  return row == table.end() ? nullptr : &*row;
}

}  // namespace catgut
