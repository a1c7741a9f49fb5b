# Debian packages of this release, by CPack: canyon, libcanyon-dev, python3-canyon. `./run package` makes them.
option(CANYON_PACKAGE "Set up CPack, manual pages and completion" OFF)
if(NOT CANYON_PACKAGE)
  return()
endif()
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_CONTACT "Canyon maintainers <maintainers@canyon.invalid>")
set(CPACK_PACKAGE_VENDOR Canyon)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL command development)
if(TARGET canyon_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  install(TARGETS canyon_python LIBRARY DESTINATION lib/python3/dist-packages/canyon COMPONENT python EXCLUDE_FROM_ALL)
  file(GLOB modules python/canyon/*.py python/canyon/*.pyi python/canyon/py.typed)
  install(FILES ${modules} DESTINATION lib/python3/dist-packages/canyon COMPONENT python EXCLUDE_FROM_ALL)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
                                                WORLD_READ WORLD_EXECUTE)
set(about "It reads a city from maps or meshes and broadcast ephemerides, traces the
 paths of every signal, simulates a receiver and solves its position. Outputs
 are NMEA, UBX, RTCM 3, MAVLink, RINEX, CSV and pictures.")
set(CPACK_DEBIAN_COMMAND_PACKAGE_NAME canyon)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SECTION science)
set(CPACK_DEBIAN_COMMAND_PACKAGE_RECOMMENDS fonts-dejavu-core)
set(CPACK_COMPONENT_COMMAND_DESCRIPTION "simulator of GNSS receivers in cities\n${about}")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libcanyon-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, libgeographiclib-dev, libembree-dev, libtbb-dev, libfmt-dev, libyaml-cpp-dev, \
zlib1g-dev, pkg-config, libassimp-dev, libcairo2-dev, libpng-dev, libexpat1-dev, libbz2-dev, libgeos-dev, libgdal-dev, libnetcdf-dev, \
libcurl4-openssl-dev, libtinyxml2-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "simulator of GNSS receivers in cities, C++ library
${about}
 This package has headers, static libraries, and files for CMake and pkg-config.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-canyon)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
math(EXPR next "${Python3_VERSION_MINOR} + 1")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next}), python3-numpy")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-pandas, python3-xarray")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "simulator of GNSS receivers in cities, Python package\n${about}")

# What Debian asks of every package.
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
set(doc ${CMAKE_CURRENT_BINARY_DIR}/debian)
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  set(name ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  file(WRITE ${doc}/${name}/changelog "canyon (${PROJECT_VERSION}) unstable; urgency=medium

  * CHANGELOG.md of the source has what is new.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")
  execute_process(COMMAND gzip -9nf ${doc}/${name}/changelog)
  install(FILES ${doc}/${name}/changelog.gz packaging/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name}
          COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DATADIR}/canyon COMPONENT command PATTERN __pycache__ EXCLUDE)
# Manual pages and completion, which the program itself writes.
set(written ${CMAKE_CURRENT_BINARY_DIR}/written)
add_custom_target(reference DEPENDS canyon_cli COMMAND ${CMAKE_COMMAND} -E make_directory ${written}
                  COMMAND canyon_cli manual --out ${written}/man COMMAND gzip -9nf ${written}/man/*.1
                  COMMAND canyon_cli completion bash > ${written}/canyon
                  COMMAND canyon_cli completion zsh > ${written}/_canyon
                  COMMAND canyon_cli completion fish > ${written}/canyon.fish)
install(DIRECTORY ${written}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT command OPTIONAL)
install(FILES ${written}/canyon DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT command OPTIONAL)
install(FILES ${written}/_canyon DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT command OPTIONAL)
install(FILES ${written}/canyon.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT command OPTIONAL)
include(CPack)
