# Fresh small recordings for the examples: a depth camera's and a flying laser's.
file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER})
execute_process(COMMAND ${HM} simulate room -o recording --frames 30 --quiet WORKING_DIRECTORY ${FOLDER}
                COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${HM} simulate room -o flight --sensor laser_mav --frames 700 --quiet
                WORKING_DIRECTORY ${FOLDER} COMMAND_ERROR_IS_FATAL ANY)
