include(CMakePackageConfigHelpers)

# wienertree::wienertree is the library (BSD-3). wienertree::text_model is apart, because it links GiNaC (GPL-2+).
add_library(wienertree INTERFACE)
add_library(wienertree::wienertree ALIAS wienertree)
target_link_libraries(wienertree INTERFACE wienertree_filter wienertree_tree wienertree_cubature wienertree_model)

set(installed wienertree wienertree_model wienertree_cubature wienertree_tree wienertree_filter)
if(WIENERTREE_TEXT_MODELS)
  list(APPEND installed wienertree_text_model)
endif()
install(TARGETS ${installed} EXPORT wienertree-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT wienertree-targets NAMESPACE wienertree:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/wienertree)
install(DIRECTORY src/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/wienertree FILES_MATCHING PATTERN "*.hpp")
install(FILES ${PROJECT_BINARY_DIR}/generated/wienertree/version.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/wienertree)
install(DIRECTORY data/ DESTINATION ${CMAKE_INSTALL_DATADIR}/wienertree)
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(cmake/wienertree-config.cmake.in ${PROJECT_BINARY_DIR}/wienertree-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/wienertree)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/wienertree-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/wienertree-config.cmake ${PROJECT_BINARY_DIR}/wienertree-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/wienertree)
