# Shared by the build and by the installed package: the two dependencies whose Debian packages have no usable
# CMake target with a common name.
if(NOT TARGET canyon_geographiclib)
  find_path(CANYON_GEOGRAPHICLIB_INCLUDE GeographicLib/Geocentric.hpp)
  find_library(CANYON_GEOGRAPHICLIB_LIBRARY NAMES GeographicLib Geographic)
  if(NOT CANYON_GEOGRAPHICLIB_INCLUDE OR NOT CANYON_GEOGRAPHICLIB_LIBRARY)
    message(FATAL_ERROR "GeographicLib not found: install libgeographiclib-dev (Debian 11: libgeographic-dev)")
  endif()
  add_library(canyon_geographiclib INTERFACE IMPORTED GLOBAL)
  set_target_properties(canyon_geographiclib PROPERTIES
                        INTERFACE_INCLUDE_DIRECTORIES "${CANYON_GEOGRAPHICLIB_INCLUDE}"
                        INTERFACE_LINK_LIBRARIES "${CANYON_GEOGRAPHICLIB_LIBRARY}")
endif()

# Without Embree rays use Canyon's own tree of boxes (canyon/city/raytrace/builtin_triangles.hpp).
if(NOT TARGET canyon_embree)
  find_path(CANYON_EMBREE_INCLUDE NAMES embree4/rtcore.h embree3/rtcore.h)
  find_library(CANYON_EMBREE_LIBRARY NAMES embree4 embree3)
  add_library(canyon_embree INTERFACE IMPORTED GLOBAL)
  if(CANYON_EMBREE_INCLUDE AND CANYON_EMBREE_LIBRARY)
    set_target_properties(canyon_embree PROPERTIES
                          INTERFACE_INCLUDE_DIRECTORIES "${CANYON_EMBREE_INCLUDE}"
                          INTERFACE_LINK_LIBRARIES "${CANYON_EMBREE_LIBRARY}")
  else()
    message(STATUS "Embree 3 or 4 not found (libembree-dev): rays use Canyon's own tree, and a drive takes 1.4 times as long")
    set_target_properties(canyon_embree PROPERTIES INTERFACE_COMPILE_DEFINITIONS CANYON_OWN_RAYS)
  endif()
endif()
