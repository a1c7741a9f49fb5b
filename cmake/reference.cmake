install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DATADIR}/canyon COMPONENT command PATTERN __pycache__ EXCLUDE)
# Manual pages and completion, written by the program itself.
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
add_dependencies(packaged reference)
