# SPDX-License-Identifier: Apache-2.0
# The SIMD kernels use Highway: one source, every instruction set, chosen at run time.
find_library(HWY_LIBRARY hwy REQUIRED)
find_path(HWY_INCLUDE hwy/highway.h REQUIRED)
target_include_directories(catgut_solver SYSTEM PUBLIC ${HWY_INCLUDE})
target_link_libraries(catgut_solver PUBLIC ${HWY_LIBRARY})
target_compile_options(catgut_solver PRIVATE ${CATGUT_HIGHWAY_FLAGS})
