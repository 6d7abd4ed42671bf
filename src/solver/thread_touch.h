// SPDX-License-Identifier: Apache-2.0
// solver/thread_touch: thread on tools inside the thread's direct solve. A taut thread round a jaw must not be straightened
// through it: a node that touches may not move into the tool, the tool takes the reaction, and friction acts along the tool.
#pragma once
#include <cstdint>
#include <vector>

#include "solver/rigid.h"

namespace catgut {

struct StrandModel;
struct ThreadScratch;

// A segment of thread near a capsule: what the contact stage hands to the thread's solve.
struct ThreadTouch {
  uint32_t pair, body, capsule;
};

// A node that touches a tool, in this substep.
struct NodeContact {
  uint32_t node = 0, body = 0;
  Vec3 n, at;                                 // unit, out of the tool; the place on the tool [m]
  float gap = 0;                              // [m] the smallest of its segments'
  bool active = false, released = false;      // released: the thread pulled it off
  bool fresh = false;                         // came to touch in this step
  float slides = 1;                           // of its freedom along the tool: what friction leaves
  float own_inv_mass = 0, tool_inv_mass = 0;  // [1/kg] along n: of the node on its own, of the tool under all that push it
  float pushed = 0;                           // [kg m] impulse so far
  Vec3 reply;                                 // W n of the node on its own
  Vec3 start;                                 // where its velocity carried it [m]
  Vec3 from;                                  // [m] before this step
};

// What the thread gave a tool in this substep [kg m], [kg m^2].
struct ToolPush {
  Vec3 linear, angular;
};

// Brings every segment of s.touch out of its tool and finds the nodes that touch. Returns whether that set has changed.
bool update_contacts(const StrandModel& model, ThreadScratch& s, const std::vector<RigidModel>& body_model,
                     const std::vector<RigidBody>& body, float h);
// Puts right what the pairs see of the nodes that touch: along the normal they move with the tool or not at all.
void compute_effective_masses(ThreadScratch& s, const std::vector<RigidModel>& body_model, const std::vector<RigidBody>& body);
// Gives the tool of a contact the positional impulse p [kg m].
void push_tool(ThreadScratch& s, const NodeContact& c, Vec3 p, const std::vector<RigidModel>& body_model,
               std::vector<RigidBody>& body);
// Before move_loose_nodes: remembers where nodes that touch are; after it: moves them as they may, gives tools the reaction.
void save_positions(ThreadScratch& s);
// Returns whether any was released.
bool move_contacts(ThreadScratch& s, float limit, const std::vector<RigidModel>& body_model, std::vector<RigidBody>& body);

}  // namespace catgut
