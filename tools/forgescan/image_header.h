// How large an image file says its image is, before anybody makes room for it.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace forgescan {

// Width times height by the header of a PNG, PNM, BMP or TIFF file. Nothing for another format, or a header
// that is cut off. bytes: the whole file.
std::optional<std::uint64_t> ClaimedPixels(std::string_view bytes);

}  // namespace forgescan
