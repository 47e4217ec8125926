# SPDX-License-Identifier: Apache-2.0
# Writes OUTPUT, a C++ file that holds every file of FILES (relative to the repository) as a string.
set(text "// Made by cl/embed_kernels.cmake.\n#include \"cl/program.hpp\"\n\nnamespace raywave::cl {\nconst std::map<std::string, std::string>& kernel_files() {\n  static const std::map<std::string, std::string> files = {\n")
foreach(file IN LISTS FILES)
  file(READ "${file}" content)
  string(APPEND text "      {\"${file}\", R\"kernel(${content})kernel\"},\n")
endforeach()
string(APPEND text "  };\n  return files;\n}\n}  // namespace raywave::cl\n")
file(WRITE "${OUTPUT}" "${text}")
