#include "tools/forgescan/replay/message_text.h"
namespace forgescan {
std::string MessageTitle(const std::string& channel, ByteView) { return channel; }
std::vector<std::string> FieldDifferences(const std::string&, ByteView, ByteView, std::size_t) { return {}; }
}
