// SPDX-License-Identifier: Apache-2.0
// tests/fuzz: every door through which bytes from outside come in. Each entry point takes any bytes and returns when they were
// read or refused with an InputError of one line; whatever else happens (another exception, a crash, no end) is a fault.
// Driven by libFuzzer (tests/fuzz/libfuzzer, -DCATGUT_FUZZ=ON with clang) and by fuzz_test.cpp in every build.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace catgut::fuzz {

// true: the bytes were good; false: they were refused as they should be. Aborts with a message on anything else.
using EntryPoint = bool (*)(const uint8_t* data, size_t size);

bool scene(const uint8_t* data, size_t size);      // scene text; what is accepted must survive writing and reading
bool setting(const uint8_t* data, size_t size);    // the text of one --set
bool recording(const uint8_t* data, size_t size);  // 'r': the file as it is; else: chunk kinds and payloads, hashed rightly
bool state(const uint8_t* data, size_t size);      // 'r': the bytes as they are; else: changes to a good state, 5 bytes each
bool mesh(const uint8_t* data, size_t size);       // 'o', 's', 'g' or 'j' (obj, stl, glb, gltf), then the file

struct Entry {
  const char* name;
  EntryPoint run;
};
std::span<const Entry> entries();

}  // namespace catgut::fuzz
