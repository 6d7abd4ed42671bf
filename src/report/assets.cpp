// SPDX-License-Identifier: Apache-2.0
// report: the assembler reads the files into the program; see room.cmake for the dependency of the build.
#include "report/assets.h"

#define CATGUT_ASSET(name, path)                                                                                   \
  __asm__(".section .rodata\n.global catgut_asset_" #name "\n.balign 16\ncatgut_asset_" #name ":\n.incbin \"" path \
          "\"\n.global catgut_asset_" #name "_end\ncatgut_asset_" #name "_end:\n.byte 0\n.previous\n");            \
  extern "C" const char catgut_asset_##name[];                                                                     \
  extern "C" const char catgut_asset_##name##_end[];                                                               \
  std::string_view catgut::assets::name() {                                                                        \
    return {catgut_asset_##name, static_cast<size_t>(catgut_asset_##name##_end - catgut_asset_##name)};            \
  }

CATGUT_ASSET(style, CATGUT_WEB "/style.css")
CATGUT_ASSET(d3, CATGUT_D3)
CATGUT_ASSET(charts, CATGUT_WEB "/charts.js")
CATGUT_ASSET(report, CATGUT_WEB "/report.js")
CATGUT_ASSET(educator, CATGUT_WEB "/educator.js")
CATGUT_ASSET(survey, CATGUT_WEB "/survey.js")
