#include "drivers/can/open_can_bus.h"

#include <charconv>
#include <optional>

#include "drivers/can/can_socketcan.h"
#include "drivers/can/can_udp.h"

namespace forgescan {
namespace {

std::optional<int> ToInt(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

Error BadUrl(std::string_view url) {
  return Fail(ErrorCode::kInvalidArgument,
              "CAN URL '{}' is neither socketcan:INTERFACE nor udp:GROUP:PORT nor udp:GROUP:PORT?hops=N",
              url);
}

Result<UdpCanConfig> ParseUdp(std::string_view url, std::string_view rest) {
  UdpCanConfig config;
  if (const std::size_t mark = rest.find('?'); mark != std::string_view::npos) {
    const std::string_view query = rest.substr(mark + 1);
    const auto hops = query.starts_with("hops=") ? ToInt(query.substr(5)) : std::nullopt;
    if (!hops) {
      return BadUrl(url);
    }
    config.hop_limit = *hops;
    rest = rest.substr(0, mark);
  }
  const std::size_t colon = rest.find(':');
  const auto port = colon == std::string_view::npos ? std::nullopt : ToInt(rest.substr(colon + 1));
  if (!port || *port < 1 || *port > 65535) {
    return BadUrl(url);
  }
  config.group = std::string(rest.substr(0, colon));
  config.port = static_cast<std::uint16_t>(*port);
  RETURN_IF_ERROR(config.Check());
  return config;
}

}  // namespace

Result<std::unique_ptr<CanBus>> OpenCanBus(std::string_view url, TimeSource now_us) {
  constexpr std::string_view kSocketCan = "socketcan:";
  constexpr std::string_view kUdp = "udp:";
  if (url.starts_with(kSocketCan) && url.size() > kSocketCan.size()) {
    return OpenSocketCan({.interface = std::string(url.substr(kSocketCan.size()))}, std::move(now_us));
  }
  if (url.starts_with(kUdp)) {
    ASSIGN_OR_RETURN(const UdpCanConfig config, ParseUdp(url, url.substr(kUdp.size())));
    return OpenUdpCan(config, std::move(now_us));
  }
  return BadUrl(url);
}

}  // namespace forgescan
