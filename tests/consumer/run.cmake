# After install, projects that know nothing but the prefix find, link and run the library: by find_package, and by pkg-config.
# The installed program runs too.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${ARGN}\n${output}")
  endif()
  set(output ${output} PARENT_SCOPE)
endfunction()

set(prefix ${WORK}/prefix)
set(model ${prefix}/share/wienertree/models/benes.toml)
file(REMOVE_RECURSE ${prefix} ${WORK}/build)
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})

run(${CMAKE_COMMAND} -S ${SOURCE} -B ${WORK}/build -G ${GENERATOR} -D CMAKE_PREFIX_PATH=${prefix}
    -D CMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer ${VERSION})

set(pkgconfig ${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${prefix}/${LIBDIR}/pkgconfig pkg-config)
run(${pkgconfig} --modversion wienertree)
if(NOT output MATCHES "^${VERSION}")
  message(FATAL_ERROR "pkg-config says version ${output}")
endif()
run(${pkgconfig} --cflags --libs wienertree)
string(STRIP "${output}" flags)
separate_arguments(flags UNIX_COMMAND "${flags}")
run(${CXX} -std=c++20 -O1 ${SOURCE}/main.cpp -o ${WORK}/build/pkgconfig_consumer ${flags})
run(${WORK}/build/pkgconfig_consumer ${VERSION})

if(PROGRAM)
  run(${WORK}/build/text_consumer ${model})
  run(${pkgconfig} --cflags --libs wienertree-text-model)
  string(STRIP "${output}" flags)
  separate_arguments(flags UNIX_COMMAND "${flags}")
  run(${CXX} -std=c++20 -O1 ${SOURCE}/text_main.cpp -o ${WORK}/build/pkgconfig_text_consumer ${flags})
  run(${WORK}/build/pkgconfig_text_consumer ${model})
  # Bare names are found in the installed data.
  run(${prefix}/bin/wienertree model show benes)
  run(${CMAKE_COMMAND} -E env LC_ALL=C ${prefix}/bin/wienertree formulas verify lyons-victoir-5-1)
  if(NOT output MATCHES "^${prefix}/share/wienertree/")
    message(FATAL_ERROR "the installed program took its data from ${output}")
  endif()
endif()
if(PYTHON)
  run(${CMAKE_COMMAND} -E env PYTHONPATH=${prefix}/lib/python3/dist-packages ${PYTHON} -c
    "import wienertree as w; assert str(w.data_directory()).startswith('${prefix}'), w.data_directory(); w.Model('benes')")
endif()
