// SPDX-License-Identifier: Apache-2.0
// tests/fuzz: all entry points for external bytes. Each takes any bytes and returns when they were
// read or refused with an InputError of one line. Any other outcome (another exception, a crash, a hang) is a fault.
// Driven by libFuzzer (tests/fuzz/libfuzzer, -DCATGUT_FUZZ=ON with clang) and by fuzz_test.cpp in every build.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace catgut::fuzz {

// true: accepted; false: refused properly. Aborts with a message on anything else.
using EntryPoint = bool (*)(const uint8_t* data, size_t size);

bool scene(const uint8_t* data, size_t size);      // scene text; accepted text must survive writing and reading
bool setting(const uint8_t* data, size_t size);    // the text of one --set
bool recording(const uint8_t* data, size_t size);  // 'r': the raw file; else: chunk kinds and payloads, with valid hashes
bool state(const uint8_t* data, size_t size);      // 'r': the raw bytes; else: changes to a valid state, 5 bytes each
bool mesh(const uint8_t* data, size_t size);       // 'o', 's', 'g' or 'j' (obj, stl, glb, gltf), then the file

struct Entry {
  const char* name;
  EntryPoint run;
};
std::span<const Entry> entries();

}  // namespace catgut::fuzz
