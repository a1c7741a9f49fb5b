# The installed package: find_package(canyon) defines canyon::canyon and, if built, canyon::io.
include(CMakePackageConfigHelpers)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
set(targets canyon)
if(CANYON_BUILD_IO)
  list(APPEND targets canyon_io)
endif()
install(TARGETS ${targets} EXPORT canyonTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
set(umbrellas canyon/canyon.hpp)
if(CANYON_BUILD_IO)
  list(APPEND umbrellas canyon/io.hpp)
endif()
install(CODE "set(CANYON_SOURCE \"${CMAKE_CURRENT_SOURCE_DIR}\")
  set(CANYON_UMBRELLAS \"${umbrellas}\")
  set(CANYON_INCLUDE \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}\")")
install(SCRIPT cmake/install_headers.cmake)
install(EXPORT canyonTargets NAMESPACE canyon:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/canyon)
configure_package_config_file(cmake/canyonConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/canyonConfig.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/canyon)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/canyonConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/canyonConfig.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/canyonConfigVersion.cmake cmake/CanyonDependencies.cmake
              cmake/CanyonIoDependencies.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/canyon)
set(CANYON_EMBREE_FLAG "")
if(CANYON_EMBREE_LIBRARY)
  get_filename_component(CANYON_EMBREE_FLAG ${CANYON_EMBREE_LIBRARY} NAME_WE)
  string(REGEX REPLACE "^lib" "-l" CANYON_EMBREE_FLAG ${CANYON_EMBREE_FLAG})
endif()
foreach(target IN LISTS targets)
  configure_file(cmake/${target}.pc.in ${CMAKE_CURRENT_BINARY_DIR}/${target}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${target}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()
