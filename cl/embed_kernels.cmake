# SPDX-License-Identifier: Apache-2.0
# Embeds the kernels: writes OUTPUT, a C++ file that holds every file of FILES (paths relative to
# the repository) as a string. cl/program.cpp resolves their #include lines.
string(CONCAT text
       "// Made by cl/embed_kernels.cmake.\n"
       "#include \"cl/program.hpp\"\n\n"
       "namespace raywave::cl {\n"
       "const std::map<std::string, std::string>& kernel_files() {\n"
       "  static const std::map<std::string, std::string> files = {\n")
foreach(file IN LISTS FILES)
  file(READ "${file}" content)
  string(APPEND text "      {\"${file}\", R\"kernel(${content})kernel\"},\n")
endforeach()
string(APPEND text "  };\n  return files;\n}\n}  // namespace raywave::cl\n")
file(WRITE "${OUTPUT}" "${text}")
