#include "services/common/log/message_definitions.h"

namespace forgescan {

std::string AllMessageDefinitions() {
  std::string all;
  for (const MessageDefinition& definition : MessageDefinitions()) {
    all += definition.text;
    all += '\n';
  }
  return all;
}

}  // namespace forgescan
