# SPDX-License-Identifier: Apache-2.0
# Reference solutions (Newton in double precision) use Eigen; the simulation itself does not see it here.
target_link_libraries(catgut_validation PRIVATE Eigen3::Eigen)
