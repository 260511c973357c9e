# cpack -G DEB: wienertree (the program), libwienertree-dev, python3-wienertree. What they depend on is found by
# dpkg-shlibdeps; what is named here is no shared library.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME wienertree)
set(CPACK_PACKAGE_VENDOR wienertree)
set(CPACK_PACKAGE_CONTACT "The wienertree authors <wienertree@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME wienertree)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "cubature on Wiener space: nonlinear filtering and weak approximation
 The law of a nonlinear signal given its observations, and averages of stochastic differential equations, by a
 tree of nodes that is thinned as it grows.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "gnuplot-nox, fonts-dejavu-core")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libwienertree-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "cubature on Wiener space: C++ headers and static libraries
 find_package(wienertree) and pkg-config find them.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "libeigen3-dev, libfmt-dev, libsundials-dev, libboost-graph-dev, nlohmann-json3-dev, libtomlplusplus-dev, libginac-dev")

if(WIENERTREE_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
  math(EXPR next "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-wienertree)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION "cubature on Wiener space: Python module
 Filters and weak approximation on NumPy arrays.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= 3.${Python_VERSION_MINOR}), python3 (<< 3.${next}), python3-numpy, wienertree (= ${PROJECT_VERSION})")
endif()
include(CPack)
