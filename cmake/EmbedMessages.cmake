# cmake -DFOLDER=... -DOUTPUT=... -P EmbedMessages.cmake: writes the texts of FOLDER/*.lcm as a C++ array, by name.
cmake_minimum_required(VERSION 3.25)
file(GLOB files ${FOLDER}/*.lcm)
list(SORT files)
file(WRITE ${OUTPUT} "// Made by cmake/EmbedMessages.cmake.
#include \"services/common/log/message_definitions.h\"

namespace forgescan {

std::span<const MessageDefinition> MessageDefinitions() {
  static constexpr MessageDefinition kDefinitions[] = {
")
foreach(file ${files})
  get_filename_component(name ${file} NAME_WE)
  file(READ ${file} text)
  file(APPEND ${OUTPUT} "      {\"${name}\", R\"lcm_text(${text})lcm_text\"},\n")
endforeach()
file(APPEND ${OUTPUT} "  };
  return kDefinitions;
}

}  // namespace forgescan
")
