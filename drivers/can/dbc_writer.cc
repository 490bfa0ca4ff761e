#include <fmt/format.h>

#include <iterator>

#include "drivers/can/dbc.h"

namespace forgescan {
namespace {

template <typename... Args>
void Put(std::string& out, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Args>(args)...);
}

std::string Camel(const std::string& snake) {
  std::string camel;
  bool upper = true;
  for (const char c : snake) {
    if (c == '_') {
      upper = true;
      continue;
    }
    camel.push_back(upper ? static_cast<char>(std::toupper(static_cast<unsigned char>(c))) : c);
    upper = false;
  }
  return camel;
}

bool IsScaled(const DbcSignal& signal) { return signal.factor < 1 || signal.offset != 0; }

std::string TypeOf(const DbcSignal& signal) {
  if (!signal.values.empty()) {
    return Camel(signal.name);
  }
  if (IsScaled(signal)) {
    return "double";
  }
  if (signal.bits == 1) {
    return "bool";
  }
  const int bits = signal.max > 65535 || signal.bits > 16 ? 32 : signal.max > 255 || signal.bits > 8 ? 16 : 8;
  return fmt::format("std::{}int{}_t", signal.is_signed ? "" : "u", bits);
}

std::string InitialOf(const DbcSignal& signal) {
  if (!signal.values.empty()) {
    return fmt::format("k{}", Camel(signal.values.front().second));
  }
  const double initial = signal.min > 0 || signal.max < 0 ? signal.min : 0;
  return TypeOf(signal) == "bool" ? "false" : fmt::format("{}", initial);
}

std::string CommentOf(const DbcSignal& signal) {
  const std::string unit = signal.unit.empty() ? "" : fmt::format(" {}", signal.unit);
  return fmt::format("{}..{}{}", signal.min, signal.max, unit);
}

void PutStruct(std::string& out, const DbcMessage& message) {
  Put(out, "// {}\nstruct {} {{\n",
      message.comment.empty() ? fmt::format("From {}.", message.sender) : message.comment, message.name);
  for (const DbcSignal& signal : message.signals) {
    if (signal.values.empty()) {
      continue;
    }
    Put(out, "  enum class {} : std::uint8_t {{", Camel(signal.name));
    for (const auto& [value, name] : signal.values) {
      Put(out, " k{} = {},", Camel(name), value);
    }
    out += " };\n";
  }
  Put(out, "  static constexpr std::uint32_t kId = {:#x};\n", message.id);
  for (const DbcSignal& signal : message.signals) {
    const std::string scope = signal.values.empty() ? "" : fmt::format("{}::", Camel(signal.name));
    Put(out, "  {} {} = {}{};  // {}\n", TypeOf(signal), signal.name, scope, InitialOf(signal),
        CommentOf(signal));
  }
  Put(out, "\n  static const MessageInfo& Info();\n  Result<CanFrame> Encode() const;\n");
  Put(out, "  static Result<{}> Decode(const CanFrame& frame);\n", message.name);
  Put(out, "  bool operator==(const {}&) const = default;\n}};\n\n", message.name);
}

void PutTables(std::string& out, const DbcMessage& message) {
  for (const DbcSignal& signal : message.signals) {
    if (signal.values.empty()) {
      continue;
    }
    Put(out, "constexpr int k{}{}[] = {{", message.name, Camel(signal.name));
    for (const auto& value : signal.values) {
      Put(out, "{}, ", value.first);
    }
    out += "};\n";
  }
  Put(out, "constexpr SignalInfo k{}Signals[] = {{\n", message.name);
  for (const DbcSignal& s : message.signals) {
    const std::string allowed = s.values.empty() ? "{}" : fmt::format("k{}{}", message.name, Camel(s.name));
    Put(out, "    {{\"{}\", {}, {}, {}, {}, {}, {}, {}, \"{}\", {}}},\n", s.name, s.start_bit, s.bits,
        s.is_signed, s.factor, s.offset, s.min, s.max, s.unit, allowed);
  }
  Put(out, "}};\nconstexpr MessageInfo k{0}Info{{\"{0}\", {1:#x}, {2}, k{0}Signals}};\n\n", message.name,
      message.id, message.length);
}

void PutCodec(std::string& out, const DbcMessage& message) {
  const std::string& name = message.name;
  Put(out, "const MessageInfo& {0}::Info() {{ return k{0}Info; }}\n\n", name);
  Put(out, "Result<CanFrame> {0}::Encode() const {{\n  const double values[] = {{\n", name);
  for (const DbcSignal& signal : message.signals) {
    Put(out, "      static_cast<double>({}),\n", signal.name);
  }
  Put(out, "  }};\n  return EncodeSignals(Info(), values);\n}}\n\n");
  Put(out, "Result<{0}> {0}::Decode(const CanFrame& frame) {{\n", name);
  Put(out, "  ASSIGN_OR_RETURN(const auto values, DecodeSignals(Info(), frame));\n  {} message;\n", name);
  for (std::size_t i = 0; i < message.signals.size(); ++i) {
    const DbcSignal& signal = message.signals[i];
    if (TypeOf(signal) == "bool") {
      Put(out, "  message.{} = values[{}] != 0;\n", signal.name, i);
    } else {
      Put(out, "  message.{} = static_cast<{}>(values[{}]);\n", signal.name, TypeOf(signal), i);
    }
  }
  Put(out, "  return message;\n}}\n\n");
}

}  // namespace

std::string WriteFramesHeader(const DbcFile& dbc) {
  std::string out =
      "// Written by dbc_gen from drivers/can/station.dbc: change that file, not this one.\n#pragma once\n\n"
      "#include <cstdint>\n#include <tuple>\n\n#include \"drivers/can/signal_codec.h\"\n\nnamespace "
      "forgescan::station {\n\n";
  for (const DbcMessage& message : dbc.messages) {
    PutStruct(out, message);
  }
  out += "using AllMessages = std::tuple<";
  for (std::size_t i = 0; i < dbc.messages.size(); ++i) {
    Put(out, "{}{}", i == 0 ? "" : ", ", dbc.messages[i].name);
  }
  out += ">;\n\n}  // namespace forgescan::station\n";
  return out;
}

std::string WriteFramesSource(const DbcFile& dbc) {
  std::string out =
      "// Written by dbc_gen from drivers/can/station.dbc: change that file, not this one.\n"
      "#include \"drivers/can/station_frames.h\"\n\nnamespace forgescan::station {\nnamespace {\n\n";
  for (const DbcMessage& message : dbc.messages) {
    PutTables(out, message);
  }
  out += "}  // namespace\n\n";
  for (const DbcMessage& message : dbc.messages) {
    PutCodec(out, message);
  }
  out += "}  // namespace forgescan::station\n";
  return out;
}

std::string WriteFramesTable(const DbcFile& dbc) {
  std::string out =
      "# Frames of the station's CAN bus\n\n"
      "Written by `dbc_gen` from station.dbc; a test holds the two together. Little endian; value = raw x "
      "factor + offset.\n";
  for (const DbcMessage& message : dbc.messages) {
    Put(out, "\n## {:#05x} {} ({} bytes, from {})\n", message.id, message.name, message.length,
        message.sender);
    if (!message.comment.empty()) {
      Put(out, "{}\n", message.comment);
    }
    out += "\n| signal | bits | factor | range | unit | values |\n|---|---|---|---|---|---|\n";
    for (const DbcSignal& s : message.signals) {
      std::string values;
      for (const auto& [value, name] : s.values) {
        Put(values, "{}{} {}", values.empty() ? "" : ", ", value, name);
      }
      Put(out, "| {} | {}..{}{} | {} | {}..{} | {} | {} |\n", s.name, s.start_bit, s.start_bit + s.bits - 1,
          s.is_signed ? " signed" : "", s.factor, s.min, s.max, s.unit, values);
    }
  }
  return out;
}

}  // namespace forgescan
