# HM_PYTHON: the interpreter of scripts and tests itself. Where `python3` is a shim that looks for one, each call would start
# several processes first.
if(NOT HM_PYTHON)
  find_program(HM_PYTHON_COMMAND NAMES python3 REQUIRED)
  execute_process(COMMAND ${HM_PYTHON_COMMAND} -c "import sys; print(sys.executable)" OUTPUT_VARIABLE interpreter
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  set(HM_PYTHON ${interpreter} CACHE FILEPATH "Python interpreter of scripts and tests")
endif()
