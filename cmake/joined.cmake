# SPDX-License-Identifier: Apache-2.0
# catgut_join(TARGET source...): the sources of a target are compiled eight at a time, because most of the time of a small one
# goes into headers. The listed ones are compiled alone: they use names that another file has, too.
# After a change of one file, CATGUT_JOIN=OFF compiles faster.
option(CATGUT_JOIN "compile sources of tests several at a time" ON)
function(catgut_join target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${CATGUT_JOIN} UNITY_BUILD_BATCH_SIZE 8)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()
