// Bytes as text, for JSON and HTML.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace forgescan {

// RFC 4648, section 4, with padding.
std::string Base64(std::span<const std::uint8_t> bytes);

}  // namespace forgescan
