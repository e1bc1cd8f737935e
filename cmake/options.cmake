# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause

# Sums must not depend on what the compiler contracts: fused multiply-adds are written out.
# -march=native is never set: the instruction set is chosen when the program runs.
function(sheaf_compile_options target)
  # A folder that is not optimised compiles in half the time, which is most of a sanitizer's minutes.
  get_target_property(folder ${target} SOURCE_DIR)
  get_filename_component(folder ${folder} NAME)
  if(folder IN_LIST SHEAF_UNOPTIMISED_IN)
    target_compile_options(${target} PRIVATE -O0)
  endif()
  target_compile_options(${target} PRIVATE -Wall -Wextra -ffp-contract=off
    $<$<BOOL:${SHEAF_WERROR}>:-Werror>
    # GCC 12 sees overlapping copies in std::string where there are none (its bug 105651).
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>)
endfunction()

if(SHEAF_SANITIZE)
  add_compile_options(-fsanitize=${SHEAF_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${SHEAF_SANITIZE})
  add_compile_definitions(SHEAF_FEW_INSTRUCTION_SETS)
  if(SHEAF_SANITIZE MATCHES "undefined")
    add_compile_options(-fno-sanitize-recover=undefined)
    # Offsets to null pointers, of empty blocks, that nobody follows: Eigen has them too.
    if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
      add_compile_options(-fno-sanitize=pointer-overflow)
    endif()
  endif()
endif()
