# The drives and the small estimator of `canyon bench` become a source, so that programs need no files at run time.
foreach(text drives.yaml drives-1.yaml ekf.py)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/examples/bench/${text})
  string(REGEX REPLACE "[.-]" "_" name ${text})
  file(READ examples/bench/${text} CANYON_BENCH_${name})
endforeach()
configure_file(${CMAKE_CURRENT_LIST_DIR}/bench_texts.cpp.in ${CMAKE_CURRENT_BINARY_DIR}/generated/bench_texts.cpp @ONLY)
target_sources(canyon_analysis_bench PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/generated/bench_texts.cpp)
