# SPDX-License-Identifier: Apache-2.0
# The force kernel uses Highway: one source, every instruction set, chosen at run time. The factor is made with Eigen.
find_package(hwy CONFIG REQUIRED)
target_link_libraries(catgut_wall ${kind} hwy::hwy)
target_link_libraries(catgut_wall PRIVATE Eigen3::Eigen)
target_compile_options(catgut_wall PRIVATE ${CATGUT_HIGHWAY_FLAGS})
