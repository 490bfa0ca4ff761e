// The .lcm files this program was built with, so that a recording can carry the language it is written in.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace forgescan {

struct MessageDefinition {
  std::string_view name;  // e.g. frame_t
  std::string_view text;  // of the file
};

// By name.
std::span<const MessageDefinition> MessageDefinitions();
// All texts, one after the other.
std::string AllMessageDefinitions();

}  // namespace forgescan
