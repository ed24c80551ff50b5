# `cmake --install` installs programs, models, messages, schemas, the Python package, headers, man pages and completion.
# `cpack` builds a Debian package from these files (used by scripts/package).
include(GNUInstallDirs)
set(shared ${CMAKE_INSTALL_DATADIR}/evalbus)
get_property(programs GLOBAL PROPERTY EVALBUS_PROGRAMS)
install(TARGETS ${programs} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY models/ DESTINATION ${shared}/models FILES_MATCHING
  PATTERN "*.yaml" PATTERN "*.xml" PATTERN "*.obj" PATTERN "*.stl" PATTERN "*.png")
install(DIRECTORY lcmtypes/ DESTINATION ${shared}/lcmtypes FILES_MATCHING PATTERN "*.lcm")
install(DIRECTORY docs/schema DESTINATION ${shared})
install(DIRECTORY python DESTINATION ${shared} PATTERN "__pycache__" EXCLUDE)
# Headers, libraries and find_package(evalbus) for third-party programs and plugins (docs/extending.md).
set(headers ${CMAKE_INSTALL_INCLUDEDIR}/evalbus)
foreach(folder base bus lcmtypes models metrics policy_bridge)
  install(DIRECTORY ${folder} DESTINATION ${headers} FILES_MATCHING PATTERN "*.h")
endforeach()
install(DIRECTORY ${CMAKE_BINARY_DIR}/generated/evalbus DESTINATION ${headers} FILES_MATCHING PATTERN "*.hpp")
install(TARGETS base bus ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/evalbus)
include(CMakePackageConfigHelpers)
configure_package_config_file(cmake/evalbusConfig.cmake.in ${CMAKE_BINARY_DIR}/evalbusConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/evalbus PATH_VARS headers CMAKE_INSTALL_LIBDIR)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/evalbusConfigVersion.cmake COMPATIBILITY ExactVersion)
install(FILES ${CMAKE_BINARY_DIR}/evalbusConfig.cmake ${CMAKE_BINARY_DIR}/evalbusConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/evalbus)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES scripts/evalbus.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME evalbus)
# The target `man` generates these pages from --help.
install(DIRECTORY ${CMAKE_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL
  FILES_MATCHING PATTERN "*.1")

find_program(HELP2MAN help2man)
if(HELP2MAN)
  set(pages)
  foreach(program ${programs})
    set(page ${CMAKE_BINARY_DIR}/man/${program}.1)
    add_custom_command(OUTPUT ${page} DEPENDS ${program}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/man
      COMMAND ${HELP2MAN} --no-info --output=${page} --name=evalbus $<TARGET_FILE:${program}>)
    list(APPEND pages ${page})
  endforeach()
  add_custom_target(man DEPENDS ${pages})
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "evalbus <evalbus@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "scores robot-manipulation policies while they run")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
# dpkg-shlibdeps adds the linked libraries. This list adds programs, fonts and libraries that are loaded at run time.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "ffmpeg, libosmesa6 | libegl1, fonts-dejavu-core, liblcm-bin, libjs-three, iproute2")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3-numpy, python3-msgpack, python3-websockets, zstd")
include(CPack)
