// SPDX-License-Identifier: Apache-2.0
// solver/thread_touch: thread on tools inside the thread's direct solve. A taut thread round a jaw must not be straightened
// through it. A node in contact may not move into the tool, the tool receives the reaction, and friction acts along it.
#pragma once
#include <cstdint>
#include <vector>

#include "solver/rigid.h"

namespace catgut {

struct StrandModel;
struct ThreadScratch;

// A segment of thread near a capsule: passed from the contact stage to the thread's solve.
struct ThreadTouch {
  uint32_t pair, body, capsule;
};

// A node in contact with a tool, in this substep.
struct NodeContact {
  uint32_t node = 0, body = 0;
  Vec3 n, at;                                 // unit, out of the tool; the contact point on the tool [m]
  float gap = 0;                              // [m] minimum over its segments
  bool active = false, released = false;      // released: the thread pulled it off
  bool fresh = false;                         // came into contact in this step
  float slides = 1;                           // mobility along the tool that friction leaves, 0..1
  float own_inv_mass = 0, tool_inv_mass = 0;  // [1/kg] along n: of the node alone, of the tool under all nodes that push it
  float pushed = 0;                           // [kg m] impulse so far
  Vec3 reply;                                 // W n of the node alone
  Vec3 start;                                 // position predicted by its velocity [m]
  Vec3 from;                                  // [m] before this step
};

// Impulse of the thread on a tool in this substep [kg m], [kg m^2].
struct ToolPush {
  Vec3 linear, angular;
};

// Moves every segment of s.touch out of its tool and finds the nodes in contact. Returns whether that set has changed.
bool update_contacts(const StrandModel& model, ThreadScratch& s, const std::vector<RigidModel>& body_model,
                     const std::vector<RigidBody>& body, float h);
// Corrects the coefficients of nodes in contact: along the normal they move with the tool or not at all.
void compute_effective_masses(ThreadScratch& s, const std::vector<RigidModel>& body_model, const std::vector<RigidBody>& body);
// Applies the positional impulse p [kg m] to the tool of a contact.
void push_tool(ThreadScratch& s, const NodeContact& c, Vec3 p, const std::vector<RigidModel>& body_model,
               std::vector<RigidBody>& body);
// Before move_loose_nodes: stores the positions of nodes in contact. After it: limits their motion and applies the reaction
void save_positions(ThreadScratch& s);
// Returns whether any was released.
bool move_contacts(ThreadScratch& s, float limit, const std::vector<RigidModel>& body_model, std::vector<RigidBody>& body);

}  // namespace catgut
