# SPDX-License-Identifier: BSD-3-Clause
# cmake -D BUILD=... -D WORK=... [-D FLAGS=...] -P run.cmake: installs BUILD below WORK, builds the project beside
# this file against it and runs it; the installed program is tried, too.
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/out)
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK}/build -G Ninja
    -DCMAKE_PREFIX_PATH=${WORK}/prefix -DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_FLAGS=${FLAGS}")
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer ${WORK}/out)
run(${WORK}/prefix/bin/plumbline pipelines check rgbd)
# The examples, built against the same installation: they map, and a plugin is loaded by its program.
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/../../examples -B ${WORK}/examples -G Ninja
    -DCMAKE_PREFIX_PATH=${WORK}/prefix -DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_FLAGS=${FLAGS}")
run(${CMAKE_COMMAND} --build ${WORK}/examples)
run(${CMAKE_CTEST_COMMAND} --test-dir ${WORK}/examples --output-on-failure --no-tests=error)
# The installed program draws wherever the whole is put, and tells when one of its parts is missing.
file(RENAME ${WORK}/prefix ${WORK}/moved)
set(draw ${WORK}/moved/bin/plumbline render ${WORK}/out/thin.ply -o ${WORK}/out/moved.png --size 320x240)
run(${draw})
file(GLOB_RECURSE part ${WORK}/moved/plumbline_viz.so)
file(REMOVE ${part})
execute_process(COMMAND ${draw} RESULT_VARIABLE code ERROR_VARIABLE told)
if(code EQUAL 0 OR NOT told MATCHES "plumbline_viz.so: this part .* is missing; .*${WORK}/moved/lib")
  message(FATAL_ERROR "exit code ${code} without the part ${part}:\n${told}")
endif()
file(REMOVE_RECURSE ${WORK}/moved)
