# cmake -DTYPES=<folder of .lcm files> -DOUTPUT=<file.cc> -P MessageDefinitions.cmake: the definitions as C++ strings.
file(GLOB files ${TYPES}/*.lcm)
list(SORT files)
list(LENGTH files count)
set(entries "")
foreach(file IN LISTS files)
  get_filename_component(name "${file}" NAME_WE)
  file(READ "${file}" text)
  string(APPEND entries "    {\"${name}\", R\"lcm(${text})lcm\"},\n")
endforeach()
file(WRITE ${OUTPUT} "#include \"services/common/log/message_definitions.h\"

#include <array>

namespace forgescan {
namespace {

constexpr std::array<MessageDefinition, ${count}> kDefinitions{{
${entries}}};

}  // namespace

std::span<const MessageDefinition> MessageDefinitions() { return kDefinitions; }

}  // namespace forgescan
")
