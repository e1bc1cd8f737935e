# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
#
# Writes a C++ source that holds the report's page, so that the library needs no file beside it.
#   cmake -DFOLDER=src/page/assets -DOUT=page_assets.cc -P embed.cmake
set(text "// Made by cmake/embed.cmake from src/page/assets/.\n#include \"page/page_assets.h\"\n\nnamespace sheaf {\n\n")
function(embed name)
  set(all "")
  foreach(file ${ARGN})
    file(READ ${FOLDER}/${file} content)
    string(APPEND all "${content}")
  endforeach()
  # Compilers need not take literals of more than 65536 characters: pieces of lines stand beside
  # one another.
  string(LENGTH "${all}" length)
  set(pieces "")
  set(at 0)
  while(at LESS length)
    string(SUBSTRING "${all}" ${at} 12000 piece)
    string(APPEND pieces "R\"sheaf_page(${piece})sheaf_page\"\n")
    math(EXPR at "${at} + 12000")
  endwhile()
  set(text "${text}std::string_view ${name}() {\n  static constexpr std::string_view kText =\n${pieces};\n  return kText;\n}\n\n" PARENT_SCOPE)
endfunction()
embed(page_template page.html)
embed(page_style style.css)
embed(page_script data.js renderer.js scene.js panel.js main.js)
file(WRITE ${OUT} "${text}}  // namespace sheaf\n")
