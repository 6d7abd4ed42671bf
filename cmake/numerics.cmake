# catgut_numerics: the compiler flags on which the bits of a run depend. Every room links it PUBLIC, and so does every program
# that compiles inline functions of our headers: the linker keeps one copy of each, whoever compiled it.
add_library(catgut_numerics INTERFACE)
add_library(catgut::numerics ALIAS catgut_numerics)
set_target_properties(catgut_numerics PROPERTIES EXPORT_NAME numerics)
# -ffp-contract=off: a multiplication and an addition that are fused on one machine and not on another differ in their last bit.
set(CATGUT_NUMERIC_FLAGS_ALL -ffp-contract=off -fno-math-errno -fno-trapping-math)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # Baseline for everything (any x86-64 since 2009, with AES for Highway's SSE4 target); kernels choose better at run time.
  set(CATGUT_NUMERIC_FLAGS_PROCESSOR -march=x86-64-v2 -mpclmul -maes)
endif()
set(CATGUT_NUMERIC_FLAGS ${CATGUT_NUMERIC_FLAGS_ALL} ${CATGUT_NUMERIC_FLAGS_PROCESSOR})
target_compile_options(catgut_numerics INTERFACE ${CATGUT_NUMERIC_FLAGS})
target_compile_features(catgut_numerics INTERFACE cxx_std_20)
