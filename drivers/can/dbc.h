// Reads the subset of DBC that station.dbc is written in, and writes C++ and a table from it. Used at build
// time only.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "services/common/result.h"

namespace forgescan {

struct DbcSignal {
  std::string name;
  int start_bit = 0;
  int bits = 0;
  bool is_signed = false;
  double factor = 1;
  double offset = 0;
  double min = 0;
  double max = 0;
  std::string unit;
  std::vector<std::pair<int, std::string>> values;  // of an enumeration
};

struct DbcMessage {
  std::uint32_t id = 0;
  std::string name;
  int length = 0;  // bytes
  std::string sender;
  std::string comment;
  std::vector<DbcSignal> signals;
};

struct DbcFile {
  std::vector<DbcMessage> messages;
};

// Understands BO_, SG_ (little endian, not multiplexed), VAL_ and CM_ BO_, one statement a line; VERSION,
// NS_, BS_ and BU_ are passed over. Source: the DBC format as Vector publishes it. Errors: kFormat, naming
// the line, for anything else, for signals that overlap or leave the message, for ranges the bits cannot
// hold, and for names or identifiers given twice.
Result<DbcFile> ParseDbc(std::string_view text);

// One struct per message with Encode() and Decode(), and the list of all of them.
std::string WriteFramesHeader(const DbcFile& dbc);
std::string WriteFramesSource(const DbcFile& dbc);

// The same as a Markdown table.
std::string WriteFramesTable(const DbcFile& dbc);

}  // namespace forgescan
