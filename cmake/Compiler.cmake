# SPDX-License-Identifier: BSD-3-Clause
# One place for flags. No global -march (Debian's PCL is built for plain x86-64) and never -ffast-math.
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")
add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>)
# Only the libraries that are used: a program that loads fewer starts sooner.
add_link_options(LINKER:--as-needed)

# -Wmaybe-uninitialized: g++ 12 with -O3 reports it inside Eigen where nothing is uninitialised.
add_library(plumbline_warnings INTERFACE)
target_compile_options(plumbline_warnings INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-Wconversion;-Wshadow>
  $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-maybe-uninitialized>
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${PLUMBLINE_WERROR}>>:-Werror>)

if(PLUMBLINE_SANITIZE)
  add_compile_options(-fsanitize=${PLUMBLINE_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${PLUMBLINE_SANITIZE})
  # Under AddressSanitizer Eigen would put a header before what it allocates; what the packaged PCL and Ceres free and
  # allocate has none.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

find_program(CCACHE ccache)
if(CCACHE)
  # Precompiled headers need these for ccache to hit (see ccache's manual, "Precompiled headers").
  foreach(language C CXX)
    set(CMAKE_${language}_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env
        CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime ${CCACHE})
  endforeach()
  if(NOT CMAKE_DISABLE_PRECOMPILE_HEADERS) # clang-tidy knows neither g++'s headers nor this flag
    add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fpch-preprocess>)
  endif()
endif()
