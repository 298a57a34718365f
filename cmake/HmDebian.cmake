# Debian packages, made by `./hm package` (cpack): `housemartin`, the program, which depends on the libraries that it is
# linked to; and `libhousemartin-dev`, headers, static libraries and the CMake package, which depends on what those
# headers and libraries need: the -dev packages of packages.txt. What is installed is `development` unless it says
# otherwise.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME housemartin)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The housemartin authors <housemartin@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE zstd)  # xz takes a minute more for the static libraries
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME housemartin)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libhousemartin-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "The program hm.")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Headers, static libraries and the CMake package housemartin.")

# The development packages of the sections [dense], [all], and [cameras] where its libraries are in.
file(STRINGS ${PROJECT_SOURCE_DIR}/packages.txt lines)
set(depends cmake)
set(section)
set(sections dense all)
if(HM_CAMERA_LIBRARIES)
  list(APPEND sections cameras)
endif()
list(JOIN sections "|" sections)
foreach(line ${lines})
  if(line MATCHES "^\\[([a-z0-9]+)\\]")
    set(section ${CMAKE_MATCH_1})
  elseif(section MATCHES "^(${sections})$" AND line MATCHES "^([a-z0-9.+-]+-dev)")
    list(APPEND depends ${CMAKE_MATCH_1})
  endif()
endforeach()
list(JOIN depends ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS)

install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/housemartin RENAME copyright
        COMPONENT program)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libhousemartin-dev RENAME copyright
        COMPONENT development)
include(CPack)
