# The viewer's page is built by Node.js (./run view), never by this build: the program looks for it when it runs. Where it
# is there it is installed.
if(TARGET canyon_view_io)
  set_property(SOURCE ${CMAKE_CURRENT_SOURCE_DIR}/canyon/view/page.cpp APPEND PROPERTY
               COMPILE_DEFINITIONS CANYON_VIEWER_BUILT="${CMAKE_CURRENT_SOURCE_DIR}/viewer/dist/viewer.html")
  install(FILES viewer/dist/viewer.html DESTINATION ${CMAKE_INSTALL_DATADIR}/canyon OPTIONAL)
endif()
