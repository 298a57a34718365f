# Libraries that only the tests use.
find_package(GTest REQUIRED)
find_package(octomap REQUIRED)
include(GoogleTest)
enable_testing()
