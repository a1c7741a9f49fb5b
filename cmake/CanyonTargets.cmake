# Targets of the pipeline's folders. Each folder canyon/NAME (for a nested folder A/B, NAME is A_B) becomes
#   canyon_NAME        object library: its sources for canyon::canyon
#   canyon_NAME_io     object library: the sources named under IO (or ALL), for canyon::io
#   test_NAME          its *_test.cpp, linked with this folder and those above it, including canyon::io's if it has
#                      sources for canyon::io or IO_TESTS
#   NAME_FILE_bench    one program for each *_bench.cpp, built by the target `benchmarks`
# With CANYON_UNITY_BUILD, files of a folder are compiled several at a time (canyon_units).
# The target `unit_tests` builds all test_NAME; `ctest -L unit` runs only them.

include(CanyonUnits)
include(${CMAKE_CURRENT_LIST_DIR}/set_label.cmake)
set(CANYON_FOLDERS "" CACHE INTERNAL "")
add_library(canyon_cxx INTERFACE)
target_compile_features(canyon_cxx INTERFACE cxx_std_20)
target_include_directories(canyon_cxx INTERFACE $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}>)

# For Canyon's own sources only: not used by users of the installed package.
add_library(canyon_warnings INTERFACE)
target_compile_options(canyon_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                       -Woverloaded-virtual -Wcast-qual)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC repeatedly frees the memory of a unit during compilation, which takes some 8 % of the time: without it, units need
  # at most a sixth more memory.
  target_compile_options(canyon_warnings INTERFACE --param=ggc-min-expand=1000 --param=ggc-min-heapsize=1500000)
  # False alarms: overlaps and bounds in std::string's own operators (GCC bugs 105651 and 105329, GCC 12; GCC 10 builds
  # the engine with these warnings on), and from GCC 13 on members of empty std::optionals.
  if(CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(canyon_warnings INTERFACE -Wno-restrict)
    if(CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 12)
      target_compile_options(canyon_warnings INTERFACE -Wno-stringop-overflow -Wno-stringop-overread -Wno-array-bounds)
    endif()
  else()
    target_compile_options(canyon_warnings INTERFACE -Wno-maybe-uninitialized)
  endif()
endif()
if(CANYON_UNITY_BUILD)
  # A type of an unnamed namespace in an included file is not a type in a header here.
  target_compile_options(canyon_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()
if(CANYON_WARNINGS_AS_ERRORS)
  target_compile_options(canyon_warnings INTERFACE -Werror)
endif()
if(CANYON_SANITIZE)
  add_compile_options(-fsanitize=${CANYON_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${CANYON_SANITIZE})
endif()
if(CANYON_BUILD_FUZZERS)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    message(FATAL_ERROR "CANYON_BUILD_FUZZERS needs clang: libFuzzer is part of it (-DCMAKE_CXX_COMPILER=clang++)")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

# How sources are compiled: `hot` with all optimisations, for the time-critical parts; `plain` and `test` with fewer in a
# release, in three quarters of the time. External headers included by nearly every file are parsed once for each kind; GCC
# takes the level of optimisation from that header. No header of Canyon is in it, so that a change rebuilds only files that
# include it.
set(canyon_plain_options $<$<CONFIG:Release>:-O1>)
set(canyon_test_options ${canyon_plain_options})
if(NOT CANYON_SANITIZE AND NOT CANYON_BUILD_FUZZERS)
  # Readers of files and sockets are `plain`: a write past an array ends the program.
  list(APPEND canyon_plain_options -fstack-protector-strong
       $<$<OR:$<CONFIG:Release>,$<CONFIG:RelWithDebInfo>>:-U_FORTIFY_SOURCE>
       $<$<OR:$<CONFIG:Release>,$<CONFIG:RelWithDebInfo>>:-D_FORTIFY_SOURCE=2>)
endif()
if(CANYON_PRECOMPILED_HEADERS)
  set(canyon_empty ${CMAKE_BINARY_DIR}/generated/empty.cpp)
  file(GENERATE OUTPUT ${canyon_empty} CONTENT "")
  foreach(kind hot plain test)
    if(kind STREQUAL "test" AND NOT CANYON_BUILD_TESTS)
      continue()
    endif()
    add_library(canyon_${kind}_pch OBJECT EXCLUDE_FROM_ALL ${canyon_empty})
    target_link_libraries(canyon_${kind}_pch PRIVATE canyon_cxx canyon_warnings Eigen3::Eigen fmt::fmt)
    target_compile_options(canyon_${kind}_pch PRIVATE ${canyon_${kind}_options})
    target_precompile_headers(canyon_${kind}_pch PRIVATE <Eigen/Core> <Eigen/Dense> <fmt/format.h> <algorithm> <array> <cmath>
        <cstdint> <filesystem> <functional> <map> <memory> <optional> <span> <string> <string_view> <vector>)
  endforeach()
  if(CANYON_BUILD_TESTS)
    target_link_libraries(canyon_test_pch PRIVATE GTest::gmock)
    target_precompile_headers(canyon_test_pch PRIVATE <gtest/gtest.h> <gmock/gmock.h>)
  endif()
endif()
# canyon_compiled(TARGET KIND): hot, plain or test.
function(canyon_compiled target kind)
  target_compile_options(${target} PRIVATE ${canyon_${kind}_options})
  if(CANYON_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} REUSE_FROM canyon_${kind}_pch)
    target_compile_options(${target} PRIVATE -fPIC)    # also for programs: GCC requires the flags of the header
  endif()
endfunction()

function(canyon_folder folder)
  cmake_parse_arguments(arg "HOT;IO_TESTS" "" "IO;LIBRARIES;PRIVATE" ${ARGN})
  set(kind plain)
  if(arg_HOT)
    set(kind hot)
  endif()
  string(REPLACE "/" "_" name ${folder})
  set(dir ${CMAKE_CURRENT_SOURCE_DIR}/canyon/${folder})
  file(GLOB sources CONFIGURE_DEPENDS ${dir}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "_(test|bench)\\.cpp$")
  set(io_sources "")
  if(arg_IO STREQUAL "ALL")
    set(io_sources ${sources})
    set(sources "")
    set(arg_IO "")
  endif()
  foreach(file IN LISTS arg_IO)
    list(REMOVE_ITEM sources ${dir}/${file})
    list(APPEND io_sources ${dir}/${file})
  endforeach()

  # Libraries of this folder and all above it, as usage requirements.
  add_library(canyon_${name}_usage INTERFACE)
  target_link_libraries(canyon_${name}_usage INTERFACE canyon_cxx ${arg_LIBRARIES})
  foreach(above IN LISTS CANYON_FOLDERS)
    string(REPLACE "/" "_" above ${above})
    target_link_libraries(canyon_${name}_usage INTERFACE canyon_${above}_usage)
  endforeach()

  if(sources)
    canyon_units(units canyon_${name} ${sources})
    add_library(canyon_${name} OBJECT ${units})
    target_link_libraries(canyon_${name} PUBLIC canyon_${name}_usage PRIVATE canyon_warnings ${arg_PRIVATE})
    canyon_compiled(canyon_${name} ${kind})
  endif()
  set_property(GLOBAL APPEND PROPERTY CANYON_LIBRARIES ${arg_LIBRARIES})
  if(io_sources OR arg_IO_TESTS)
    set_property(GLOBAL APPEND PROPERTY CANYON_IO_TESTS ${name})
  endif()
  if(io_sources AND CANYON_BUILD_IO)
    canyon_units(units canyon_${name}_io ${io_sources})
    add_library(canyon_${name}_io OBJECT ${units})
    target_link_libraries(canyon_${name}_io PUBLIC canyon_${name}_usage PRIVATE canyon_warnings canyon_io_needs
                          ${arg_PRIVATE})
    canyon_compiled(canyon_${name}_io ${kind})
  endif()
  list(APPEND CANYON_FOLDERS ${folder})
  set(CANYON_FOLDERS ${CANYON_FOLDERS} CACHE INTERNAL "")
endfunction()

# canyon_library(TARGET [KIND]): all folders; with LAST FOLDER that folder and those above it.
function(canyon_library target)
  cmake_parse_arguments(arg "" "LAST" "" ${ARGN})
  add_library(${target} ${arg_UNPARSED_ARGUMENTS})
  foreach(folder IN LISTS CANYON_FOLDERS)
    string(REPLACE "/" "_" name ${folder})
    if(TARGET canyon_${name})
      target_sources(${target} PRIVATE $<TARGET_OBJECTS:canyon_${name}>)
    endif()
    if(folder STREQUAL arg_LAST)
      break()
    endif()
  endforeach()
  get_property(libraries GLOBAL PROPERTY CANYON_LIBRARIES)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}>
                             $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} PUBLIC ${libraries})
endfunction()

function(canyon_io_library target)
  add_library(${target})
  foreach(folder IN LISTS CANYON_FOLDERS)
    string(REPLACE "/" "_" name ${folder})
    if(TARGET canyon_${name}_io)
      target_sources(${target} PRIVATE $<TARGET_OBJECTS:canyon_${name}_io>)
    endif()
  endforeach()
  target_link_libraries(${target} PUBLIC canyon::canyon PRIVATE ${CANYON_IO_LIBRARIES})
  set_target_properties(${target} PROPERTIES EXPORT_NAME io VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR})
  add_library(canyon::io ALIAS ${target})
endfunction()

# canyon_discover_tests(TARGET PREFIX [PROPERTY VALUE]...): a ctest entry PREFIX/SUITE for each suite of a program.
function(canyon_discover_tests target prefix)
  set(file ${CMAKE_CURRENT_BINARY_DIR}/${target}_tests.cmake)
  list(JOIN ARGN " " properties)
  add_custom_command(TARGET ${target} POST_BUILD BYPRODUCTS ${file} VERBATIM
                     COMMAND ${CMAKE_COMMAND} -D PROGRAM=$<TARGET_FILE:${target}> -D PREFIX=${prefix} -D FILE=${file}
                             -D FOLDER=${canyon_SOURCE_DIR} "-DPROPERTIES=${properties}"
                             -P ${canyon_SOURCE_DIR}/cmake/discover_suites.cmake)
  set_property(TARGET ${target} APPEND PROPERTY LINK_DEPENDS ${canyon_SOURCE_DIR}/tests/sets.txt)    # labels of the suites
  # For a program that is not built yet: a failing test with a message.
  set(include_file ${CMAKE_CURRENT_BINARY_DIR}/${target}_include.cmake)
  file(WRITE ${include_file} "if(EXISTS \"${file}\")\n  include(\"${file}\")\nelse()\n"
       "  add_test(${prefix}/${target}_NOT_BUILT ${target}_NOT_BUILT)\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${include_file})
endfunction()

function(canyon_tests)
  set(objects "")
  set(io_objects "")
  get_property(io_tests GLOBAL PROPERTY CANYON_IO_TESTS)
  add_custom_target(unit_tests)
  if(CANYON_BUILD_BENCHMARKS)
    add_custom_target(benchmarks)
  endif()
  foreach(folder IN LISTS CANYON_FOLDERS)
    string(REPLACE "/" "_" name ${folder})
    if(TARGET canyon_${name})
      list(APPEND objects canyon_${name})
    endif()
    if(TARGET canyon_${name}_io)
      list(APPEND io_objects canyon_${name}_io)
    endif()
    set(dir ${CMAKE_CURRENT_SOURCE_DIR}/canyon/${folder})
    file(GLOB tests CONFIGURE_DEPENDS ${dir}/*_test.cpp)
    set(judged_by_rtklib ${tests})
    list(FILTER judged_by_rtklib INCLUDE REGEX "_rtklib_test\\.cpp$")
    if(NOT CANYON_RTKLIB)
      list(FILTER tests EXCLUDE REGEX "_rtklib_test\\.cpp$")
      set(judged_by_rtklib "")
    endif()
    set(judged_by_sdformat ${tests})
    list(FILTER judged_by_sdformat INCLUDE REGEX "_sdformat_test\\.cpp$")
    if(NOT CANYON_SDFORMAT)
      list(FILTER tests EXCLUDE REGEX "_sdformat_test\\.cpp$")
      set(judged_by_sdformat "")
    endif()
    # Objects are linked by name, so that a folder that uses folders below it does not link.
    set(linked "")
    set(above ${objects})
    if(name IN_LIST io_tests)
      list(APPEND above ${io_objects})
    endif()
    foreach(object IN LISTS above)
      list(APPEND linked $<TARGET_OBJECTS:${object}>)
    endforeach()
    if(tests)
      canyon_units(units test_${name} ${tests})
      add_executable(test_${name} ${units} ${linked})
      target_link_libraries(test_${name} PRIVATE canyon_${name}_usage canyon_warnings canyon_io_needs
                            canyon_test_support canyon_test_main GTest::gmock)
      canyon_compiled(test_${name} test)
      if(judged_by_rtklib)
        target_link_libraries(test_${name} PRIVATE ${CANYON_RTKLIB})
      endif()
      if(judged_by_sdformat)
        target_link_libraries(test_${name} PRIVATE ${CANYON_SDFORMAT})
      endif()
      canyon_discover_tests(test_${name} ${folder} TIMEOUT 300 LABELS unit)
      add_dependencies(unit_tests test_${name})
    endif()
    # Benchmarks are built only by the target `benchmarks`, and link the libraries like a user.
    if(CANYON_BUILD_BENCHMARKS)
      file(GLOB benches CONFIGURE_DEPENDS ${dir}/*_bench.cpp)
      foreach(bench IN LISTS benches)
        get_filename_component(stem ${bench} NAME_WE)
        add_executable(${name}_${stem} EXCLUDE_FROM_ALL ${bench})
        target_link_libraries(${name}_${stem} PRIVATE canyon::canyon $<TARGET_NAME_IF_EXISTS:canyon::io>
                              canyon_${name}_usage canyon_warnings canyon_io_needs canyon_test_support
                              benchmark::benchmark)
        canyon_compiled(${name}_${stem} plain)
        add_dependencies(benchmarks ${name}_${stem})
      endforeach()
    endif()
  endforeach()
endfunction()
