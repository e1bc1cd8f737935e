# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause

# Sums must not depend on what the compiler contracts: fused multiply-adds are written out.
# -march=native is never set: the instruction set is chosen when the program runs.
function(sheaf_compile_options target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -ffp-contract=off
    $<$<BOOL:${SHEAF_WERROR}>:-Werror>)
endfunction()

if(SHEAF_SANITIZE)
  add_compile_options(-fsanitize=${SHEAF_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${SHEAF_SANITIZE})
  if(SHEAF_SANITIZE MATCHES "undefined")
    add_compile_options(-fno-sanitize-recover=undefined)
  endif()
endif()
