include(CMakePackageConfigHelpers)

# wienertree::wienertree is the library (BSD-3). wienertree::text_model is apart, because it links GiNaC (GPL-2+).
add_library(wienertree INTERFACE)
add_library(wienertree::wienertree ALIAS wienertree)
target_link_libraries(wienertree INTERFACE wienertree_run wienertree_study wienertree_filter wienertree_weak
  wienertree_tree wienertree_thinning wienertree_cubature wienertree_model wienertree_numeric)

# Three components: program (with its data), development, python.
set(installed wienertree wienertree_numeric wienertree_model wienertree_cubature wienertree_thinning wienertree_tree wienertree_weak
  wienertree_filter wienertree_study wienertree_run)
if(WIENERTREE_TEXT_MODELS)
  list(APPEND installed wienertree_text_model)
endif()
install(TARGETS ${installed} EXPORT wienertree-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(EXPORT wienertree-targets NAMESPACE wienertree:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/wienertree COMPONENT development)
install(DIRECTORY src/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/wienertree COMPONENT development
  FILES_MATCHING PATTERN "*.hpp")
install(FILES ${PROJECT_BINARY_DIR}/generated/wienertree/version.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/wienertree COMPONENT development)
install(DIRECTORY data/ DESTINATION ${CMAKE_INSTALL_DATADIR}/wienertree COMPONENT program)
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)

configure_package_config_file(cmake/wienertree-config.cmake.in ${PROJECT_BINARY_DIR}/wienertree-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/wienertree)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/wienertree-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/wienertree-config.cmake ${PROJECT_BINARY_DIR}/wienertree-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/wienertree COMPONENT development)

# For builds without CMake. The prefix is where the files lie, so that the tree may be moved.
file(RELATIVE_PATH pkgconfig_to_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
set(pkgconfig_mvec "")
if(WIENERTREE_LIBMVEC)
  set(pkgconfig_mvec -lmvec)
endif()
set(pkgconfig_files wienertree)
if(WIENERTREE_TEXT_MODELS)
  list(APPEND pkgconfig_files wienertree-text-model)
endif()
foreach(name IN LISTS pkgconfig_files)
  configure_file(cmake/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endforeach()
