#include "services/recorder/station_files.h"

#include <libdeflate.h>

#include <filesystem>
#include <fstream>
#include <utility>

namespace forgescan {
namespace {

namespace fs = std::filesystem;

Result<std::int64_t> BytesOf(const StationFile& file) {
  std::error_code problem;
  const std::uintmax_t bytes = fs::file_size(file.path, problem);
  if (problem) {
    return Fail(ErrorCode::kNotFound, "{}: cannot be read ({})", file.path, problem.message());
  }
  if (bytes > static_cast<std::uintmax_t>(kMaxStationFileBytes)) {
    return Fail(ErrorCode::kInvalidArgument, "{}: has {} bytes; a recording takes files of at most {}",
                file.path, bytes, kMaxStationFileBytes);
  }
  return static_cast<std::int64_t>(bytes);
}

}  // namespace

Result<std::vector<StationFile>> StationFilesOf(const Station& station) {
  std::vector<StationFile> files{{"station.toml", (fs::path(station.folder) / "station.toml").string()}};
  for (const auto& [role, path] :
       {std::pair<const char*, const std::string*>{"calibration", &station.calibration},
        {"pattern", &station.pattern},
        {"views", &station.views},
        {"model", &station.model},
        {"features", &station.features}}) {
    files.push_back({role + fs::path(*path).extension().string(), *path});
  }
  if (!station.standing.empty()) {
    files.push_back({"standing" + fs::path(station.standing).extension().string(), station.standing});
  }
  for (const StationFile& file : files) {
    RETURN_IF_ERROR(BytesOf(file));
  }
  return files;
}

Result<fsmsg::recorded_file_t> ReadStationFile(const StationFile& file) {
  ASSIGN_OR_RETURN(const std::int64_t bytes, BytesOf(file));
  fsmsg::recorded_file_t content{};
  content.name = file.name;
  content.data.resize(static_cast<std::size_t>(bytes));
  std::ifstream stream(file.path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(content.data.data()), bytes);
  if (!stream || stream.gcount() != bytes) {
    return Fail(ErrorCode::kIo, "{}: {} bytes of it cannot be read", file.path, bytes);
  }
  content.size = static_cast<std::int32_t>(bytes);
  content.crc32 =
      content.data.empty()
          ? 0
          : static_cast<std::int32_t>(libdeflate_crc32(0, content.data.data(), content.data.size()));
  return content;
}

}  // namespace forgescan
