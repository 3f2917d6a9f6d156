# SPDX-License-Identifier: BSD-3-Clause
# cmake -D PROGRAM=... -D OUT=... -P Manual.cmake: man pages (compressed) and completion, as the program prints them.
file(REMOVE_RECURSE ${OUT}/man)
execute_process(COMMAND ${PROGRAM} man -o ${OUT}/man/man1 COMMAND_ERROR_IS_FATAL ANY)
file(GLOB pages ${OUT}/man/man1/*.1)
execute_process(COMMAND gzip -9 -n -f ${pages} COMMAND_ERROR_IS_FATAL ANY)
foreach(shell bash zsh fish)
  execute_process(COMMAND ${PROGRAM} completion ${shell} OUTPUT_FILE ${OUT}/plumbline.${shell} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
