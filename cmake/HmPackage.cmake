# The library as others see it: target housemartin::housemartin, here and after installation.
include(CMakePackageConfigHelpers)
get_property(room_targets GLOBAL PROPERTY HM_ROOM_TARGETS)
add_library(housemartin INTERFACE)
add_library(housemartin::housemartin ALIAS housemartin)
target_link_libraries(housemartin INTERFACE ${room_targets})

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/housemartin)
install(TARGETS housemartin ${room_targets} EXPORT housemartinTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT housemartinTargets NAMESPACE housemartin:: DESTINATION ${package_dir})
# Only what the list names is installed; scripts/check_architecture.py checks the list.
set(public_headers_list ${PROJECT_SOURCE_DIR}/src/hm/public_headers.txt)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${public_headers_list})
file(STRINGS ${public_headers_list} public_headers REGEX "^hm/")
foreach(header ${public_headers})
  cmake_path(GET header PARENT_PATH folder)
  install(FILES ${PROJECT_SOURCE_DIR}/src/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder})
endforeach()
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/housemartinConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/housemartinConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/housemartinConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/housemartinConfig.cmake
              ${PROJECT_BINARY_DIR}/housemartinConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/HmDependencies.cmake DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md
        DESTINATION ${CMAKE_INSTALL_DOCDIR})
