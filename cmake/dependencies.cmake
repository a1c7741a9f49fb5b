# Canyon's libraries. Each is a package of Debian 11, Debian 12 and Ubuntu 24.04; `./run` installs it.
find_package(Eigen3 3.3 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(TBB REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(ZLIB REQUIRED)
find_package(LibArchive REQUIRED)
find_package(Threads REQUIRED)
find_package(Boost 1.74 REQUIRED)    # headers only, and none in Canyon's own headers

# canyon_soname(RESULT LIBRARY): the name used by programs to load it.
function(canyon_soname result library)
  execute_process(COMMAND ${CMAKE_READELF} -d ${library} OUTPUT_VARIABLE text)
  if(NOT text MATCHES "SONAME[^[]*\\[(lib[^] ]*)\\]")
    message(FATAL_ERROR "${library} has no shared library name")
  endif()
  set(${result} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()
# MPI is not linked: canyon/analysis/heatmap/engine/mpi.cpp loads it in a process that mpirun started.
add_library(canyon_mpi_headers INTERFACE)
find_package(MPI QUIET COMPONENTS C)
list(FILTER MPI_C_LIBRARIES INCLUDE REGEX "/libmpi(ch)?\\.so")
if(MPI_C_FOUND AND MPI_C_LIBRARIES)
  canyon_soname(library ${MPI_C_LIBRARIES})
  target_include_directories(canyon_mpi_headers SYSTEM INTERFACE ${MPI_C_INCLUDE_DIRS})
  target_compile_definitions(canyon_mpi_headers INTERFACE CANYON_MPI_LIBRARY="${library}")
else()
  message(STATUS "SKIPPED: heat maps and studies on several machines (MPI not found; Debian: libopenmpi-dev)")
endif()

# Debian packages GeographicLib's find module, not its CMake package, and Embree's package does not define a
# target in every version; both are therefore plain targets defined here and in canyonConfig.cmake.
include(${CMAKE_CURRENT_LIST_DIR}/CanyonDependencies.cmake)

find_package(nlohmann_json 3.9 REQUIRED)

add_library(canyon_io_needs INTERFACE)
add_library(canyon_tile_codecs INTERFACE)    # the available libraries for compressed glTF
if(CANYON_BUILD_IO)
  include(${CMAKE_CURRENT_LIST_DIR}/CanyonIoDependencies.cmake)
  # GDAL is not linked: canyon/city/buildings/sources/gdal.hpp loads it on demand.
  pkg_check_modules(gdal QUIET REQUIRED IMPORTED_TARGET GLOBAL gdal)
  list(GET gdal_LINK_LIBRARIES 0 CANYON_GDAL_LIBRARY)
  canyon_soname(gdal_file ${CANYON_GDAL_LIBRARY})
  configure_file(cmake/gdal_library.cpp.in ${CMAKE_BINARY_DIR}/generated/gdal_library.cpp @ONLY)
  add_library(canyon_gdal_headers INTERFACE)
  target_include_directories(canyon_gdal_headers SYSTEM INTERFACE ${gdal_INCLUDE_DIRS})
  target_link_libraries(canyon_io_needs INTERFACE PkgConfig::cairo canyon_gdal_headers ${CANYON_IO_LIBRARIES})
  foreach(codec IN LISTS CANYON_TILE_CODECS)
    string(TOUPPER ${codec} codec)
    target_compile_definitions(canyon_tile_codecs INTERFACE CANYON_${codec})
    target_include_directories(canyon_tile_codecs SYSTEM INTERFACE ${CANYON_${codec}_INCLUDE})
  endforeach()
endif()
if(CANYON_BUILD_CLI)
  find_package(CLI11 REQUIRED)
endif()
if(CANYON_BUILD_TESTS)
  # CMake 3.18's own find module does not support gmock.
  find_package(GTest CONFIG REQUIRED)
  if(CANYON_BUILD_BENCHMARKS)
    find_package(benchmark REQUIRED)
  endif()
  # RTKLIB checks the orbits (*_rtklib_test.cpp). A missing program is reported.
  find_library(CANYON_RTKLIB NAMES RTKLib)
  if(NOT CANYON_RTKLIB)
    message(WARNING "libRTKLib is not installed (Debian: librtklib-dev): the tests that check orbits with RTKLIB "
                    "are LEFT OUT of this build")
  endif()
  # SDFormat checks the Gazebo worlds and models (*_sdformat_test.cpp). With pkg-config: its CMake package includes
  # Gazebo's complete build system.
  set(CANYON_SDFORMAT "")
  find_package(PkgConfig)
  if(PKG_CONFIG_FOUND)
    pkg_search_module(sdformat QUIET IMPORTED_TARGET sdformat14 sdformat13 sdformat12)
  endif()
  if(sdformat_FOUND)
    set(CANYON_SDFORMAT PkgConfig::sdformat)
  else()
    message(WARNING "libsdformat 12 to 14 is not installed (Debian 12: libsdformat-dev): the tests that check "
                    "Gazebo worlds with SDFormat are LEFT OUT of this build")
  endif()
  add_library(canyon_test_support INTERFACE)
  target_include_directories(canyon_test_support INTERFACE ${CMAKE_CURRENT_SOURCE_DIR})
  file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/generated/source_dir.cpp CONTENT
       "#include \"tests/support/source_dir.hpp\"\n
const char* const canyon_source_dir = \"${CMAKE_CURRENT_SOURCE_DIR}\";
const char* const canyon_build_dir = \"${CMAKE_BINARY_DIR}\";\n")
  add_library(canyon_source_dir STATIC ${CMAKE_BINARY_DIR}/generated/source_dir.cpp)
  target_include_directories(canyon_source_dir PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(canyon_test_support INTERFACE canyon_source_dir)
  add_library(canyon_test_main STATIC tests/support/main.cpp)
  target_link_libraries(canyon_test_main PUBLIC GTest::gtest)
  include(GoogleTest)    # for hosts, whose tests each need a separate process
endif()
