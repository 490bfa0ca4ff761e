#include "tools/forgescan/log/log_export.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>

#include "services/common/geometry/cloud_io.h"
#include "services/common/new_file.h"
#include "services/common/output_file.h"
#include "tools/forgescan/log/image_file.h"
#include "tools/forgescan/log/log_visitor.h"

namespace forgescan {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// A channel's name may hold any printable character; a file's name is kept to those that mean nothing else.
std::string FileName(const std::string& channel) {
  std::string name = channel;
  for (char& c : name) {
    c = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' ? c : '_';
  }
  return name;
}

class Exporter final : public LogVisitor {
 public:
  explicit Exporter(fs::path folder) : folder_(std::move(folder)) {}

  Status Image(const LogEvent& /*event*/, const fsmsg::frame_t& frame, const std::string& png) override {
    const std::string name = fmt::format("{}_{}_{}_{}_{}", frame.part, frame.view, frame.attempt,
                                         CameraName(frame.camera), frame.pattern);
    ++images_;
    return WriteOutputFile(NewFile(name, frame.utime, ".png"), png);
  }

  Status Cloud(const LogEvent& event, const fsmsg::cloud_slice_t& slice, const PointCloud& cloud) override {
    const std::string name = fmt::format("{}_{}_{}", FileName(event.channel), slice.part,
                                         slice.view < 0 ? "all" : std::to_string(slice.view));
    ++clouds_;
    return WritePly(NewFile(name, slice.utime, ".ply"), cloud);
  }

  Status Message(const LogEvent& event, const LcmStruct& /*type*/, const Json& message) override {
    return Line(event, message);
  }
  Status Unknown(const LogEvent& event, ByteView message) override {
    return Line(event, UnknownToJson(message));
  }

  // The lines still in memory.
  Status Flush() {
    for (auto& [channel, text] : lines_) {
      const fs::path path = folder_ / (FileName(channel) + ".jsonl");
      errno = 0;
      std::ofstream file(path, std::ios::binary | std::ios::app);
      file.write(text.data(), static_cast<std::streamsize>(text.size()));
      file.close();
      if (!file) {
        return Fail(ErrorCode::kIo, "{}: cannot be written ({})", path.string(), std::strerror(errno));
      }
    }
    lines_.clear();
    line_bytes_ = 0;
    return {};
  }
  std::string Counts() const {
    return fmt::format("{} images, {} clouds, {} other messages", images_, clouds_, messages_);
  }

 private:
  Status Line(const LogEvent& event, const Json& message) {
    constexpr std::size_t kMaxLineBytes = 8'000'000;  // kept in memory
    Json line{{"recorded_utime", event.utime}, {"channel", event.channel}, {"message", message}};
    const std::string text = JsonText(std::move(line)) + "\n";
    lines_[event.channel] += text;
    line_bytes_ += text.size();
    ++messages_;
    return line_bytes_ > kMaxLineBytes ? Flush() : Status();
  }
  fs::path NewFile(const std::string& name, std::int64_t utime, const std::string& extension) const {
    fs::path path = folder_ / (name + extension);
    for (int copy = 0; fs::exists(path); ++copy) {
      path = folder_ / (copy == 0 ? fmt::format("{}_{}{}", name, utime, extension)
                                  : fmt::format("{}_{}_{}{}", name, utime, copy, extension));
    }
    return path;
  }

  fs::path folder_;
  std::map<std::string, std::string> lines_;  // by channel
  std::size_t line_bytes_ = 0;
  std::int64_t images_ = 0, clouds_ = 0, messages_ = 0;
};

// The folder while it is filled; removed unless it gets its name.
class NewFolder {
 public:
  static Result<NewFolder> Create(const std::string& path) {
    std::error_code error;
    if (fs::exists(fs::symlink_status(path, error))) {
      return Fail(ErrorCode::kInvalidArgument, "{}: exists already", path);
    }
    const fs::path part = path + StagedEnding();
    if (!fs::create_directory(part, error)) {
      return Fail(ErrorCode::kIo, "{}: cannot be made: {}", part.string(),
                  error ? error.message() : "exists already");
    }
    return NewFolder(path, part);
  }
  NewFolder(NewFolder&& other) noexcept
      : path_(std::move(other.path_)), part_(std::exchange(other.part_, {})) {}
  NewFolder& operator=(NewFolder&&) = delete;
  ~NewFolder() {
    std::error_code ignored;
    if (!part_.empty()) {
      fs::remove_all(part_, ignored);
    }
  }
  const fs::path& part() const { return part_; }
  Status Finish() {
    RETURN_IF_ERROR(RenameToNew(part_, path_));
    part_.clear();
    return {};
  }

 private:
  NewFolder(fs::path path, fs::path part) : path_(std::move(path)), part_(std::move(part)) {}
  fs::path path_, part_;
};

}  // namespace

Status ExportLog(const std::string& file, const LogExport& what) {
  ASSIGN_OR_RETURN(const Recording recording, OpenRecording(file));
  std::string path = what.folder;
  while (path.size() > 1 && path.back() == '/') {
    path.pop_back();
  }
  ASSIGN_OR_RETURN(NewFolder folder, NewFolder::Create(path));
  Exporter exporter(folder.part());
  const bool all = !what.images && !what.clouds && !what.messages;
  const VisitedKinds kinds{all || what.images, all || what.clouds, all || what.messages};
  ASSIGN_OR_RETURN(const std::int64_t problems, VisitLog(recording, kinds, exporter));
  RETURN_IF_ERROR(exporter.Flush());
  RETURN_IF_ERROR(folder.Finish());
  fmt::print("{}: {}\n", path, exporter.Counts());
  return CheckExport(recording, problems);
}

}  // namespace forgescan
