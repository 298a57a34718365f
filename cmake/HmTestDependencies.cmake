# Libraries that only the tests use.
find_package(GTest REQUIRED)
find_package(assimp REQUIRED)
include(GoogleTest)
enable_testing()
