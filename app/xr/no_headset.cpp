// SPDX-License-Identifier: Apache-2.0
// app/xr: the headset of a build without OpenXR (CATGUT_XR=OFF): it reports that there is none.
#include "xr/headset.h"

namespace catgut::xr {

struct Headset::Work {
  HeadsetCounts counts;
};

const char* headset_state_name(HeadsetState) { return "off"; }
bool headset_offered() { return false; }
Headset::Headset(const HeadsetOptions& options) : work_(std::make_unique<Work>()) {
  if (options.report)
    options.report("headset: this build has none (CATGUT_XR=OFF); the session continues in the window (docs/headset.md)");
}
Headset::~Headset() = default;
bool Headset::poll() { return false; }
HeadsetState Headset::state() const { return HeadsetState::off; }
bool Headset::failed() const { return true; }
EyeRenderer* Headset::renderer() { return nullptr; }
bool Headset::wait(HeadsetFrame&) { return false; }
void Headset::submit(const HeadsetFrame&, EyeRenderer::Frame, const Place&, float) {}
void Headset::vibrate(size_t, const Vibration&) {}
void Headset::leave() {}
const HeadsetCounts& Headset::counts() const { return work_->counts; }

}  // namespace catgut::xr
