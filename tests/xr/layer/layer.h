// SPDX-License-Identifier: Apache-2.0
// tests/xr: an OpenXR API layer between the program and the runtime. It records what passes and can take the headset away,
// which the test runtime cannot do on request. Program and test share this struct by the layer's symbol catgut_test_layer.
#pragma once
#include <atomic>
#include <cstdint>

namespace catgut {

struct XrLayerState {
  static constexpr uint32_t kPulses = 4096;
  struct Pulse {
    uint32_t side = 0;  // 0 left, 1 right
    float amplitude = 0, frequency = 0;
    int64_t duration = 0;  // [ns]
    int32_t result = 0;    // of the runtime
  };
  struct Eye {
    float position[3], orientation[4], fov[4];  // fov: left, right, up, down [rad]
    int32_t rect[4];
  };

  // Written by the test.
  std::atomic<int> lose{0};  // 1: announce the loss of the session; 2: calls of the session fail without an announcement;
                             // 3: the instance is lost
  std::atomic<bool> absent{false};     // the runtime finds no headset
  std::atomic<bool> dark{false};       // the runtime shows no pictures: hands alone, for long tests on slow machines
  std::atomic<bool> unfocused{false};  // another program takes the input focus (SYNCHRONIZED); false: it comes back
  // Written by the layer.
  std::atomic<uint32_t> sessions{0}, destroyed{0}, frames{0}, projections{0};
  std::atomic<uint32_t> pulses{0};
  Pulse pulse[kPulses];
  Eye eye[2];
  std::atomic<int> state{0};             // newest XrSessionState reported to the program
  std::atomic<uint32_t> states_seen{0};  // a bit per state
};

}  // namespace catgut

extern "C" catgut::XrLayerState* catgut_test_layer();
