#include "tools/forgescan/replay/message_text.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "services/common/log/lcm_type.h"
#include "services/common/log/message_definitions.h"

namespace forgescan {
namespace {

using Json = nlohmann::ordered_json;

// The fields that tell a message from others of its channel.
constexpr const char* kTitleFields[] = {"part", "view", "attempt", "camera", "pattern", "slice", "name"};

}  // namespace
}  // namespace forgescan
