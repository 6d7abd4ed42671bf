// SPDX-License-Identifier: Apache-2.0
// tests/fuzz: one libFuzzer program per entry point; CATGUT_FUZZ_ENTRY names it.
#include "../entry_points.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  catgut::fuzz::CATGUT_FUZZ_ENTRY(data, size);
  return 0;
}
