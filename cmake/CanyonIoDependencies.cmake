# The libraries of canyon::io, shared by the build and by the installed package.
# Sets CANYON_IO_LIBRARIES.
find_package(PkgConfig REQUIRED)
find_package(CURL REQUIRED)
find_package(EXPAT REQUIRED)
find_package(BZip2 REQUIRED)
foreach(package IN ITEMS cairo libpng libzmq netcdf tinyxml2)
  pkg_check_modules(${package} QUIET REQUIRED IMPORTED_TARGET GLOBAL ${package})
endforeach()
# Debian's geos.pc names only the C++ library; Canyon uses the C one, which has a stable ABI.
find_library(CANYON_GEOS_LIBRARY NAMES geos_c)
if(NOT CANYON_GEOS_LIBRARY)
  message(FATAL_ERROR "GEOS not found: install libgeos-dev")
endif()
set(CANYON_IO_LIBRARIES PkgConfig::cairo PkgConfig::libpng PkgConfig::libzmq PkgConfig::netcdf PkgConfig::tinyxml2
    CURL::libcurl EXPAT::EXPAT BZip2::BZip2 ${CANYON_GEOS_LIBRARY} ${CMAKE_DL_LIBS})

# Compressed glTF and 3D Tiles; files that need a missing library are rejected with the package's name.
set(CANYON_TILE_CODECS "")
find_path(CANYON_DRACO_INCLUDE draco/compression/decode.h)
find_library(CANYON_DRACO_LIBRARY NAMES draco)
if(CANYON_DRACO_INCLUDE AND CANYON_DRACO_LIBRARY)
  list(APPEND CANYON_IO_LIBRARIES ${CANYON_DRACO_LIBRARY})
  list(APPEND CANYON_TILE_CODECS draco)
endif()
find_path(CANYON_MESHOPTIMIZER_INCLUDE meshoptimizer.h)
find_library(CANYON_MESHOPTIMIZER_LIBRARY NAMES meshoptimizer)
if(CANYON_MESHOPTIMIZER_INCLUDE AND CANYON_MESHOPTIMIZER_LIBRARY)
  list(APPEND CANYON_IO_LIBRARIES ${CANYON_MESHOPTIMIZER_LIBRARY})
  list(APPEND CANYON_TILE_CODECS meshoptimizer)
endif()
set(CANYON_TILE_LIBS "")    # for pkg-config
foreach(codec IN LISTS CANYON_TILE_CODECS)
  string(APPEND CANYON_TILE_LIBS " -l${codec}")
endforeach()
