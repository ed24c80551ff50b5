# EVALBUS_PLUGIN_VERSION: what a plugin and the program that loads it must agree on. The hash covers the messages and the
# headers of the interface, because a plugin with a different layout of a message would read wrong values.
file(GLOB interface CONFIGURE_DEPENDS lcmtypes/*.lcm metrics/sample/sample.h metrics/task/*.h models/*.h policy_bridge/interface/*.h)
set(hashes "")
foreach(file ${interface})
  file(SHA256 ${file} hash)
  string(APPEND hashes ${hash})
endforeach()
string(SHA256 hash "${hashes}")
string(SUBSTRING ${hash} 0 12 hash)
set(EVALBUS_PLUGIN_VERSION "${PROJECT_VERSION}-${hash}")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${interface})
