# Writes the ctest entries of a GoogleTest program, one per suite: starting a program that links GDAL takes 70 to 80 ms,
# and the setup of a suite is done once.
# PROGRAM; PREFIX: of their names; FOLDER: the working directory; PROPERTIES: of all entries; FILE: included by ctest.
cmake_policy(VERSION 3.18)
include(${CMAKE_CURRENT_LIST_DIR}/set_label.cmake)
execute_process(COMMAND ${PROGRAM} --gtest_list_tests WORKING_DIRECTORY ${FOLDER} TIMEOUT 60
                OUTPUT_VARIABLE list RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ${result}\n${list}")
endif()
string(REGEX MATCHALL "[^\n]+" lines "${list}")
set(text "")
foreach(line IN LISTS lines)
  # "Suite." or "Suite/0.  # TypeParam = double"; lines of tests begin with spaces, other output of a program does not end with a point.
  if(line MATCHES "^([A-Za-z_0-9/]+)\\.( *#.*)?$")
    set(suite ${CMAKE_MATCH_1})
    set(name "${PREFIX}/${suite}")
    canyon_set_label(${name} label)
    if(label)
      set(label "LABELS ${label}")
    endif()
    string(APPEND text "add_test([==[${name}]==] [==[${PROGRAM}]==] [==[--gtest_filter=${suite}.*]==])\n"
           "set_tests_properties([==[${name}]==] PROPERTIES WORKING_DIRECTORY [==[${FOLDER}]==] SKIP_RETURN_CODE 77 ${PROPERTIES} ${label})\n")
  endif()
endforeach()
file(WRITE ${FILE} "${text}")
