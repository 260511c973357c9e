# Headers are included as "wienertree/<folder>/<name>.hpp", in the source tree as after install.
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/include)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/src ${PROJECT_BINARY_DIR}/include/wienertree SYMBOLIC)
# The version stands in project() alone.
configure_file(src/version.hpp.in ${PROJECT_BINARY_DIR}/generated/wienertree/version.hpp @ONLY)

add_library(wienertree_build_settings INTERFACE)
target_compile_options(wienertree_build_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow $<$<BOOL:${WIENERTREE_WARNINGS_AS_ERRORS}>:-Werror>
  $<$<BOOL:${CMAKE_UNITY_BUILD}>:-Wno-shadow>)  # a name of one file may hide that of another
if(WIENERTREE_SANITIZE)
  target_compile_options(wienertree_build_settings INTERFACE
    -fsanitize=${WIENERTREE_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)  # which gcc 12 reports of its own std::regex once it is instrumented
  target_link_options(wienertree_build_settings INTERFACE -fsanitize=${WIENERTREE_SANITIZE})
endif()

# wienertree_layer(<name> <sources>...): one folder of src/ as a static library, which links only the layers below it
# (scripts/check-layers names them).
function(wienertree_layer name)
  add_library(wienertree_${name} STATIC ${ARGN})
  add_library(wienertree::${name} ALIAS wienertree_${name})
  set_target_properties(wienertree_${name} PROPERTIES EXPORT_NAME ${name} UNITY_BUILD_MODE GROUP)
  target_compile_features(wienertree_${name} PUBLIC cxx_std_20)
  target_include_directories(wienertree_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(wienertree_${name} PRIVATE $<BUILD_INTERFACE:wienertree_build_settings>)
endfunction()

# wienertree_compiled_as_one(<target> <name> <sources>...): the sources are one translation unit in a unity build. Sources of
# the target that are in no such group are compiled alone, as new ones are until they are added to a group: a group must not
# define a name twice in its unnamed namespaces.
function(wienertree_compiled_as_one target name)
  set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
  set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP ${name})
endfunction()

# wienertree_known_leaks(<test>): what libraries keep until the end, and only that, is no leak to the address sanitizer.
function(wienertree_known_leaks test)
  if(WIENERTREE_SANITIZE MATCHES address)
    set_tests_properties(${test} PROPERTIES ENVIRONMENT
      "LSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/leaks.supp:print_suppressions=0")
  endif()
endfunction()

# What takes time is in the library. gcc 12 takes sums of strings for writes out of bounds when it optimises little (GCC bug 105651).
set(level -O1)
if(WIENERTREE_SANITIZE)
  set(level -O0)  # instrumented code takes far longer to optimise than these tests to run
endif()
set(wienertree_test_options ${level} "$<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds;-Wno-stringop-overflow;-Wno-stringop-overread>")

# wienertree_test(<name> LIBS <targets>... SOURCES <files>... [LABELS <labels>...] [TIMEOUT <s>] [ENVIRONMENT <NAME=value>...]): one Catch2 program, one ctest entry.
# Labels: papers (statistics), slow (only when asked for), threads (has cases with the tag [threads]).
function(wienertree_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "LIBS;SOURCES;LABELS;ENVIRONMENT" ${ARGN})
  add_executable(test_${name} ${ARG_SOURCES})
  target_link_libraries(test_${name} PRIVATE ${ARG_LIBS} wienertree_catch_main wienertree_build_settings)
  target_compile_options(test_${name} PRIVATE ${wienertree_test_options})
  target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_compile_definitions(test_${name} PRIVATE WIENERTREE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_precompile_headers(test_${name} REUSE_FROM wienertree_test_prelude)
  # Sanitizers are slow: statistics of the papers run without, and under the thread sanitizer only cases tagged [threads].
  if((WIENERTREE_SANITIZE AND "papers" IN_LIST ARG_LABELS) OR
     (WIENERTREE_SANITIZE STREQUAL thread AND NOT "threads" IN_LIST ARG_LABELS))
    set_target_properties(test_${name} PROPERTIES EXCLUDE_FROM_ALL ON)
    return()
  endif()
  set(cases)
  if(WIENERTREE_SANITIZE STREQUAL thread)
    set(cases -w NoTests "[threads]")
  endif()
  add_test(NAME ${name} COMMAND test_${name} ${cases})
  wienertree_known_leaks(${name})
  if(ARG_LABELS)
    set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}")
  endif()
  if(ARG_TIMEOUT)
    set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
  endif()
  # What runs only when asked for is built only then, by the first of the slow tests.
  if("slow" IN_LIST ARG_LABELS)
    set_target_properties(test_${name} PROPERTIES EXCLUDE_FROM_ALL ON)
    add_dependencies(wienertree_slow_tests test_${name})
    set_tests_properties(${name} PROPERTIES FIXTURES_REQUIRED slow_tests)
  endif()
  if(ARG_ENVIRONMENT)
    set_property(TEST ${name} APPEND PROPERTY ENVIRONMENT "${ARG_ENVIRONMENT}")
  endif()
endfunction()
