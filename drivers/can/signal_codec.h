// Packs and unpacks the signals of a CAN message. The tables come from station.dbc by way of dbc_gen.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/can/can_bus.h"
#include "services/common/result.h"

namespace forgescan {

// One signal: value = raw * factor + offset, raw little endian with its least significant bit at start_bit.
struct SignalInfo {
  const char* name;
  int start_bit;  // 0..63
  int bits;       // 1..32, so that a double holds every raw value exactly
  bool is_signed;
  double factor;
  double offset;
  double min;  // of the value, in `unit`
  double max;
  const char* unit;
  std::span<const int> allowed;  // values of an enumeration; empty: everything within min..max
};

struct MessageInfo {
  const char* name;
  std::uint32_t id;
  std::uint8_t length;  // bytes
  std::span<const SignalInfo> signals;
};

// Shape: one value per signal, in the order of the table. Bits of no signal are zero.
// Errors: kInvalidArgument when a value is not finite, outside min..max, or not one of the enumeration.
Result<CanFrame> EncodeSignals(const MessageInfo& message, std::span<const double> values);

// Errors: kProtocol when the frame has another identifier or length, or a value outside min..max or the
// enumeration.
Result<std::vector<double>> DecodeSignals(const MessageInfo& message, const CanFrame& frame);

}  // namespace forgescan
