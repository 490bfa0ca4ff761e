// What has to be looked at before the TOML parser sees a text.
#pragma once

#include <string_view>

#include "services/common/result.h"

namespace forgescan {

// toml++ 3 runs into code that its authors hold unreachable where a character beyond ASCII stands outside
// texts and comments, where TOML allows none. Errors: kFormat with `name` and the line of the first such
// character.
Status CheckTomlText(std::string_view text, std::string_view name);

}  // namespace forgescan
