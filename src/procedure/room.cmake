# Scenes are found by name beside the sources; CATGUT_SCENES in the environment overrides it.
target_compile_definitions(catgut_procedure PRIVATE CATGUT_SCENES_DIR="${PROJECT_SOURCE_DIR}/scenes")
target_link_libraries(catgut_procedure PRIVATE fmt::fmt)
target_compile_options(catgut_procedure PRIVATE -O1)  # parsers and reports: quick to build matters more than quick to run
