#include "drivers/can/signal_codec.h"

#include <algorithm>
#include <cmath>

namespace forgescan {
namespace {

std::int64_t RawOf(const SignalInfo& signal, double value) {
  return std::llround((value - signal.offset) / signal.factor);
}

// Division by a whole number is rounded correctly (0.3 is 0.3); multiplication by 0.1 is not.
double ValueOf(const SignalInfo& signal, std::int64_t raw) {
  const double divisor = std::round(1 / signal.factor);
  const double scaled =
      signal.factor < 1 ? static_cast<double>(raw) / divisor : static_cast<double>(raw) * signal.factor;
  return scaled + signal.offset;
}

bool InRange(const SignalInfo& signal, std::int64_t raw) {
  const bool listed = signal.allowed.empty() ||
                      std::find(signal.allowed.begin(), signal.allowed.end(), raw) != signal.allowed.end();
  return listed && raw >= RawOf(signal, signal.min) && raw <= RawOf(signal, signal.max);
}

std::uint64_t MaskOf(const SignalInfo& signal) { return (std::uint64_t{1} << signal.bits) - 1; }

std::int64_t RawIn(const SignalInfo& signal, std::uint64_t payload) {
  const std::uint64_t bits = payload >> signal.start_bit & MaskOf(signal);
  const bool negative = signal.is_signed && (bits >> (signal.bits - 1) & 1) != 0;
  return static_cast<std::int64_t>(bits) - (negative ? std::int64_t{1} << signal.bits : 0);
}

}  // namespace

Result<CanFrame> EncodeSignals(const MessageInfo& message, std::span<const double> values) {
  assert(values.size() == message.signals.size());
  std::uint64_t payload = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const SignalInfo& signal = message.signals[i];
    const bool sane = std::abs(values[i]) < 1e15;  // false for NaN; llround is defined below it
    if (!sane || !InRange(signal, RawOf(signal, values[i]))) {
      return Fail(ErrorCode::kInvalidArgument, "{}.{} = {} {} is outside {}..{} or not a listed value",
                  message.name, signal.name, values[i], signal.unit, signal.min, signal.max);
    }
    payload |= (static_cast<std::uint64_t>(RawOf(signal, values[i])) & MaskOf(signal)) << signal.start_bit;
  }
  CanFrame frame{.id = message.id, .length = message.length};
  for (std::size_t i = 0; i < message.length; ++i) {
    frame.data[i] = static_cast<std::uint8_t>(payload >> (8 * i));
  }
  return frame;
}

Result<std::vector<double>> DecodeSignals(const MessageInfo& message, const CanFrame& frame) {
  if (frame.id != message.id || frame.length != message.length || frame.extended || frame.rtr ||
      frame.error) {
    return Fail(ErrorCode::kProtocol, "frame {:#x} of {} bytes is not {} ({:#x}, {} bytes, data, standard)",
                frame.id, frame.length, message.name, message.id, message.length);
  }
  std::uint64_t payload = 0;
  for (std::size_t i = 0; i < message.length; ++i) {
    payload |= std::uint64_t{frame.data[i]} << (8 * i);
  }
  std::vector<double> values;
  values.reserve(message.signals.size());
  for (const SignalInfo& signal : message.signals) {
    const std::int64_t raw = RawIn(signal, payload);
    if (!InRange(signal, raw)) {
      return Fail(ErrorCode::kProtocol, "{}.{} = {} {} is outside {}..{} or not a listed value", message.name,
                  signal.name, ValueOf(signal, raw), signal.unit, signal.min, signal.max);
    }
    values.push_back(ValueOf(signal, raw));
  }
  return values;
}

}  // namespace forgescan
