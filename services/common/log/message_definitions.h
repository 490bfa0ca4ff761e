// The definitions of our own message types, as they stand in lcmtypes/ when the program is built.
#pragma once

#include <span>
#include <string_view>

namespace forgescan {

struct MessageDefinition {
  std::string_view name;  // e.g. frame_t
  std::string_view text;  // in LCM's language
};

// By name.
std::span<const MessageDefinition> MessageDefinitions();

}  // namespace forgescan
