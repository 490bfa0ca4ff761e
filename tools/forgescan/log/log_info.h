// What a log holds, without looking into its messages.
#pragma once

#include <nlohmann/json.hpp>

#include "tools/forgescan/log/recording.h"

namespace forgescan {

// An object for programs: events, bytes, times, each channel with its types, damage, and what the recording
// says of itself. A channel's types are those of its first and last message. Errors: kIo.
Result<nlohmann::ordered_json> LogInfo(const Recording& recording);
// The same for people.
std::string LogInfoText(const nlohmann::ordered_json& info);

}  // namespace forgescan
