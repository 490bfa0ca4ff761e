#include "tools/forgescan/log/shown_text.h"

#include <fmt/format.h>

#include "services/common/log/log_header.h"

namespace forgescan {

std::string Shown(std::string_view text) {
  std::string shown;
  while (!text.empty()) {
    const std::size_t bytes =
        PrintableBytes({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    shown += bytes > 0 ? std::string(text.substr(0, bytes))
                       : fmt::format("\\x{:02X}", static_cast<unsigned char>(text.front()));
    text.remove_prefix(bytes > 0 ? bytes : 1);
  }
  return shown;
}

}  // namespace forgescan
