# SPDX-License-Identifier: Apache-2.0
# catgut_numerics: the compiler flags on which the bits of a run depend. Every room links it PUBLIC, and so does every program
# that compiles inline functions of our headers: the linker keeps one copy of each, from any of its compilations.
add_library(catgut_numerics INTERFACE)
add_library(catgut::numerics ALIAS catgut_numerics)
set_target_properties(catgut_numerics PROPERTIES EXPORT_NAME numerics)
# -ffp-contract=off: fusing a multiplication and an addition on only some machines changes the last bit.
set(CATGUT_NUMERIC_FLAGS_ALL -ffp-contract=off -fno-math-errno -fno-trapping-math)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # Baseline of all code (any x86-64 since 2009, with AES for Highway's SSE4 target); kernels select better sets at run time.
  set(CATGUT_NUMERIC_FLAGS_PROCESSOR -march=x86-64-v2 -mpclmul -maes)
endif()
set(CATGUT_NUMERIC_FLAGS ${CATGUT_NUMERIC_FLAGS_ALL} ${CATGUT_NUMERIC_FLAGS_PROCESSOR})
target_compile_options(catgut_numerics INTERFACE ${CATGUT_NUMERIC_FLAGS})
target_compile_features(catgut_numerics INTERFACE cxx_std_20)

# For rooms with Highway kernels. Arm: registers of unknown length (SVE) cannot be members of structs, so NEON is used; Highway's
# NEON needs AES, and structs of registers have constructors that only a flag for the whole file reaches.
set(CATGUT_HIGHWAY_FLAGS "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
  set(CATGUT_HIGHWAY_FLAGS -march=armv8-a+crypto "-DHWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
endif()
