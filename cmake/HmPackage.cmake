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
install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/hm DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        FILES_MATCHING PATTERN "*.hpp" PATTERN "testing" EXCLUDE
        PATTERN "*test*" EXCLUDE PATTERN "*_inl.hpp" EXCLUDE)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/housemartinConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/housemartinConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/housemartinConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/housemartinConfig.cmake
              ${PROJECT_BINARY_DIR}/housemartinConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/HmDependencies.cmake DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md
        DESTINATION ${CMAKE_INSTALL_DOCDIR})
