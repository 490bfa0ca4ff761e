// Text from a log on a terminal.
#pragma once

#include <string>
#include <string_view>

namespace forgescan {

// Control characters, and bytes that are no UTF-8, become \xNN: what a log says must not move the cursor,
// begin a line of its own or speak to the terminal.
std::string Shown(std::string_view text);

}  // namespace forgescan
