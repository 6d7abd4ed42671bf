# The force kernel uses Highway: one source, every instruction set, chosen at run time. The factor is made with Eigen.
find_library(HWY_LIBRARY hwy REQUIRED)
find_path(HWY_INCLUDE hwy/highway.h REQUIRED)
target_include_directories(catgut_wall SYSTEM PUBLIC ${HWY_INCLUDE})
target_link_libraries(catgut_wall PUBLIC ${HWY_LIBRARY})
target_link_libraries(catgut_wall PRIVATE Eigen3::Eigen)
