// libFuzzer on one reader: fuzz_GROUP --reader=NAME [libFuzzer's options] [CORPUS]; without a name it lists
// them. The corpus folder starts with the reader's good files: --seeds=FOLDER writes them there.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "tests/fuzz/readers.h"

namespace {

forgescan::fuzz::Reader chosen;  // libFuzzer's interface leaves no other place

void WriteSeeds(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (std::size_t i = 0; i < chosen.seeds.size(); ++i) {
    std::ofstream(folder / ("seed_" + std::to_string(i)), std::ios::binary) << chosen.seeds[i];
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  constexpr std::string_view kReader = "--reader=", kSeeds = "--seeds=";
  std::string name, seeds;
  for (int i = 1; i < *argc; ++i) {
    const std::string_view argument = (*argv)[i];
    if (argument.starts_with(kReader)) name = argument.substr(kReader.size());
    if (argument.starts_with(kSeeds)) seeds = argument.substr(kSeeds.size());
  }
  for (forgescan::fuzz::Reader& reader : forgescan::fuzz::Readers()) {
    if (name.empty()) std::printf("%s\n", reader.name.c_str());
    if (reader.name == name) chosen = std::move(reader);
  }
  if (!chosen.read) std::exit(name.empty() ? 0 : 1);
  if (!seeds.empty()) WriteSeeds(seeds);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto outcome = chosen.read(std::string(reinterpret_cast<const char*>(data), size));
  if (!outcome.broken.empty()) {
    std::fprintf(stderr, "%s: %s\n", chosen.name.c_str(), outcome.broken.c_str());
    std::abort();
  }
  return 0;
}
