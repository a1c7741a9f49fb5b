# The viewer's page is built by Node.js (./run view), never by this build: the program searches it at run time. If it
# exists it is installed.
if(TARGET canyon_outputs_view_io)
  # A separate file, so that the compiler's cache is valid for all other files in another clone.
  set(file ${CMAKE_BINARY_DIR}/generated/viewer_page.cpp)
  file(GENERATE OUTPUT ${file} CONTENT "#include \"canyon/outputs/view/page.hpp\"\n
const char* const canyon::view::built_page = \"${CMAKE_CURRENT_SOURCE_DIR}/viewer/dist/viewer.html\";\n")
  target_sources(canyon_outputs_view_io PRIVATE ${file})
  install(FILES viewer/dist/viewer.html DESTINATION ${CMAKE_INSTALL_DATADIR}/canyon OPTIONAL)
endif()
