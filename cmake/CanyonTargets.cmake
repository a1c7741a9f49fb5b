# Targets of the pipeline's folders. Each folder canyon/NAME becomes
#   canyon_NAME        object library: its sources for canyon::canyon
#   canyon_NAME_io     object library: the sources named under IO (or ALL), for canyon::io
#   test_NAME          its *_test.cpp, linked with this folder and those above it
#   bench_NAME_FILE    one program for each *_bench.cpp

# Here and not in a function: its variables must reach tests/ as well.
include(GoogleTest)

set(CANYON_FOLDERS "" CACHE INTERNAL "")
add_library(canyon_options INTERFACE)
target_compile_features(canyon_options INTERFACE cxx_std_20)
target_include_directories(canyon_options INTERFACE $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}>)

# For Canyon's own sources only: never seen by users of the installed package.
add_library(canyon_warnings INTERFACE)
target_compile_options(canyon_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                       -Woverloaded-virtual -Wcast-qual)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # GCC 12 finds overlaps in std::string's own operator+ (GCC bug 105651).
  target_compile_options(canyon_warnings INTERFACE -Wno-restrict)
endif()
if(CANYON_WARNINGS_AS_ERRORS)
  target_compile_options(canyon_warnings INTERFACE -Werror)
endif()
if(CANYON_SANITIZE)
  add_compile_options(-fsanitize=${CANYON_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${CANYON_SANITIZE})
endif()

function(canyon_folder name)
  cmake_parse_arguments(arg "" "" "IO;LIBRARIES;PRIVATE" ${ARGN})
  set(dir ${CMAKE_CURRENT_SOURCE_DIR}/canyon/${name})
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
  target_link_libraries(canyon_${name}_usage INTERFACE canyon_options ${arg_LIBRARIES})
  foreach(above IN LISTS CANYON_FOLDERS)
    target_link_libraries(canyon_${name}_usage INTERFACE canyon_${above}_usage)
  endforeach()

  if(sources)
    add_library(canyon_${name} OBJECT ${sources})
    target_link_libraries(canyon_${name} PUBLIC canyon_${name}_usage PRIVATE canyon_warnings ${arg_PRIVATE})
  endif()
  set_property(GLOBAL APPEND PROPERTY CANYON_LIBRARIES ${arg_LIBRARIES})
  if(io_sources AND CANYON_BUILD_IO)
    add_library(canyon_${name}_io OBJECT ${io_sources})
    target_link_libraries(canyon_${name}_io PUBLIC canyon_${name}_usage PRIVATE canyon_warnings canyon_io_needs
                          ${arg_PRIVATE})
  endif()
  list(APPEND CANYON_FOLDERS ${name})
  set(CANYON_FOLDERS ${CANYON_FOLDERS} CACHE INTERNAL "")
endfunction()

function(canyon_library target)
  add_library(${target})
  foreach(name IN LISTS CANYON_FOLDERS)
    if(TARGET canyon_${name})
      target_sources(${target} PRIVATE $<TARGET_OBJECTS:canyon_${name}>)
    endif()
  endforeach()
  get_property(libraries GLOBAL PROPERTY CANYON_LIBRARIES)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}>
                             $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} PUBLIC ${libraries})
  set_target_properties(${target} PROPERTIES EXPORT_NAME canyon VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR})
  add_library(canyon::canyon ALIAS ${target})
endfunction()

function(canyon_io_library target)
  add_library(${target})
  foreach(name IN LISTS CANYON_FOLDERS)
    if(TARGET canyon_${name}_io)
      target_sources(${target} PRIVATE $<TARGET_OBJECTS:canyon_${name}_io>)
    endif()
  endforeach()
  target_link_libraries(${target} PUBLIC canyon::canyon PRIVATE ${CANYON_IO_LIBRARIES})
  set_target_properties(${target} PROPERTIES EXPORT_NAME io VERSION ${PROJECT_VERSION}
                        SOVERSION ${PROJECT_VERSION_MAJOR})
  add_library(canyon::io ALIAS ${target})
endfunction()

function(canyon_tests)
  set(objects "")
  set(above "")
  foreach(name IN LISTS CANYON_FOLDERS)
    if(TARGET canyon_${name})
      list(APPEND objects canyon_${name})
    endif()
    if(TARGET canyon_${name}_io)
      list(APPEND objects canyon_${name}_io)
    endif()
    list(APPEND above ${name})
    set(dir ${CMAKE_CURRENT_SOURCE_DIR}/canyon/${name})
    file(GLOB tests CONFIGURE_DEPENDS ${dir}/*_test.cpp)
    set(judged_by_rtklib ${tests})
    list(FILTER judged_by_rtklib INCLUDE REGEX "_rtklib_test\\.cpp$")
    if(NOT CANYON_RTKLIB)
      list(FILTER tests EXCLUDE REGEX "_rtklib_test\\.cpp$")
      set(judged_by_rtklib "")
    endif()
    # Objects are linked by name so that a folder that reaches below itself does not link.
    set(linked "")
    foreach(object IN LISTS objects)
      list(APPEND linked $<TARGET_OBJECTS:${object}>)
    endforeach()
    if(tests)
      add_executable(test_${name} ${tests} ${linked})
      target_link_libraries(test_${name} PRIVATE canyon_${name}_usage canyon_warnings canyon_io_needs
                            canyon_test_support GTest::gmock GTest::gtest_main)
      if(judged_by_rtklib)
        target_link_libraries(test_${name} PRIVATE ${CANYON_RTKLIB})
      endif()
      gtest_discover_tests(test_${name} TEST_PREFIX ${name}/ DISCOVERY_TIMEOUT 60
                           WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}
                           PROPERTIES SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\]" TIMEOUT 300)
    endif()
    if(CANYON_BUILD_BENCHMARKS)
      file(GLOB benches CONFIGURE_DEPENDS ${dir}/*_bench.cpp)
      foreach(bench IN LISTS benches)
        get_filename_component(stem ${bench} NAME_WE)
        add_executable(${name}_${stem} ${bench} ${linked})
        target_link_libraries(${name}_${stem} PRIVATE canyon_${name}_usage canyon_warnings canyon_io_needs
                              canyon_test_support benchmark::benchmark)
      endforeach()
    endif()
  endforeach()
endfunction()
