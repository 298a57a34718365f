# Installs into an empty prefix; builds and runs two programs that know nothing but find_package(housemartin):
# one that touches every room, and the one in the README; and runs the installed hm.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output
                  WORKING_DIRECTORY ${WORK})
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGV}\nfailed with ${status}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

function(expect PATTERN)
  if(NOT output MATCHES "${PATTERN}")
    message(FATAL_ERROR "expected '${PATTERN}', got: ${output}")
  endif()
endfunction()

function(build_against_prefix FOLDER)
  run(${CMAKE_COMMAND} -S ${FOLDER} -B ${FOLDER}/build -G Ninja -DCMAKE_BUILD_TYPE=Release
      -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${WORK}/prefix)
  run(${CMAKE_COMMAND} --build ${FOLDER}/build)
endfunction()

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})
file(COPY ${CONSUMER} DESTINATION ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${WORK}/prefix/bin/hm --version)
expect("housemartin [0-9]+\\.[0-9]+")

build_against_prefix(${WORK}/consumer)
run(${WORK}/consumer/build/consumer)
expect("[0-9]+ triangles")

run(${PYTHON} ${SOURCE}/tests/packaging/extract_program.py ${SOURCE}/README.md ${WORK}/mine)
build_against_prefix(${WORK}/mine)
run(${WORK}/prefix/bin/hm simulate room -o recording --frames 3 --quiet)
run(${WORK}/mine/build/mine recording)
run(${WORK}/prefix/bin/hm info mesh.ply)
expect("triangles")
