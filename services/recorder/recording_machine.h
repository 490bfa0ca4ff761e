// Decides which file a message belongs to, when a file is opened and when it is closed. Pure: events with
// their time in, actions out.
//
//   a part:  --PART_ARRIVED, or any message of a part not known--> open --sorted, quiet and settled--> closed
//            open --part_timeout_s without news--> closed, with a gap
//            open --the recorder stops--> closed, with a gap
//            open --the disk fails--> broken: nothing more is written, the file stays a .part
//            too little space--> refused: the part is followed, nothing is written
//   the station: a new volume every day (UTC) and beyond a size; after a failure a new one when there is
//   space
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "fsmsg/recording_gap_t.hpp"
#include "services/common/aged_map.h"
#include "services/recorder/recorder_config.h"

namespace forgescan {

using FileId = std::int64_t;  // 1, 2, 3, ... in the order of opening

// What has to be known of a message to find its files.
struct RecordedMessage {
  enum class Kind { kState, kStream, kArrived, kJudged, kSorted };
  Kind kind = Kind::kStream;
  std::int64_t now_us = 0;           // of delivery
  std::int64_t utime = 0;            // in the message, of its event
  std::optional<std::int32_t> part;  // none: it belongs to the station
  std::int8_t verdict = 0;           // of kJudged
  std::int64_t bytes = 0;
};

struct OpenRecording {
  FileId file = 0;
  std::int64_t utime = 0;
  std::optional<std::int32_t> part;  // none: the station's
  std::int32_t volume = 0;           // of the station's
};
struct AppendMessage {
  FileId file = 0;
};
struct CloseRecording {
  FileId file = 0;
  std::int64_t utime = 0;
  std::optional<std::int32_t> part;
  std::int8_t verdict = 0;
  std::string reason;
  std::vector<fsmsg::recording_gap_t> gaps;
};
struct RecordingNote {
  enum class What { kNotRecorded, kLate };
  What what = What::kNotRecorded;
  std::string text;  // empty: only to be counted
};
using RecordingAction = std::variant<OpenRecording, AppendMessage, CloseRecording, RecordingNote>;

class RecordingMachine {
 public:
  using Actions = std::vector<RecordingAction>;

  explicit RecordingMachine(const RecorderConfig& config) : config_(config) {}

  // The station's first volume.
  Actions Start(std::int64_t now_us);
  // Why there is no space for another part; empty = there is. To be told before every message that may open
  // a file.
  void SetSpace(std::string trouble) { space_trouble_ = std::move(trouble); }
  // Where to append the message; files it needs are opened before.
  Actions OnMessage(const RecordedMessage& message);
  // Messages that no file will ever hold: a gap of every open file.
  void OnLost(const fsmsg::recording_gap_t& gap);
  // A message that one file does not hold.
  void OnDropped(FileId file, const fsmsg::recording_gap_t& gap);
  void OnOpened(FileId file);
  // The file cannot be written any more.
  void OnFailed(FileId file, const std::string& reason, std::int64_t now_us);
  // settled_us: everything sent before this time has been received, or given up.
  Actions OnTick(std::int64_t now_us, std::int64_t settled_us);
  // Closes what is open.
  Actions OnStop(std::int64_t now_us, std::int64_t settled_us);

  // Why a part that came now would not be recorded; empty = it would.
  std::string Trouble() const;
  int open_parts() const;
  // A part that only waits for late news before its file is closed.
  bool finishing() const;
  // Numbers of the open parts, for people.
  std::string Text() const;

 private:
  enum class Writing { kOpening, kOpen, kBroken, kRefused };
  struct Part {
    FileId file = 0;
    std::int32_t part = 0;
    Writing writing = Writing::kOpening;
    std::string trouble;                        // of kBroken
    std::optional<std::int64_t> arrived_utime;  // of PART_ARRIVED
    std::int64_t first_utime = 0;               // least and greatest of its messages
    std::int64_t last_utime = 0;
    std::int64_t last_us = 0;  // delivery of its last message
    std::optional<std::int64_t> verdict_us;
    std::optional<std::int64_t> sorted_utime;
    std::int8_t verdict = 0;
    std::vector<fsmsg::recording_gap_t> gaps;
    bool written() const { return writing == Writing::kOpening || writing == Writing::kOpen; }
  };
  struct StationVolume {
    FileId file = 0;
    Writing writing = Writing::kOpening;
    std::int32_t volume = 0;
    std::int64_t day = 0;
    std::int64_t bytes = 0;
    std::int64_t broken_us = 0;
    std::vector<fsmsg::recording_gap_t> gaps;
    bool written() const { return writing == Writing::kOpening || writing == Writing::kOpen; }
  };

  Part* PartOf(const RecordedMessage& message);
  bool IsLate(const RecordedMessage& message);
  bool Belongs(const Part& part, const RecordedMessage& message) const;
  Part& OpenPart(const RecordedMessage& message, Actions& actions);
  void Note(Part& part, const RecordedMessage& message) const;
  void AppendToStation(const RecordedMessage& message, Actions& actions);
  void OpenVolume(std::int64_t now_us, Actions& actions);
  void CloseVolume(const std::string& reason, std::int64_t now_us, Actions& actions);
  void RenewVolume(std::int64_t now_us, Actions& actions);
  bool Finished(const Part& part, std::int64_t now_us) const;
  bool Quiet(const Part& part, std::int64_t now_us, std::int64_t settled_us) const;
  void ClosePart(Part part, const std::string& reason, std::int64_t now_us, Actions& actions);

  RecorderConfig config_;
  FileId last_file_ = 0;
  std::string space_trouble_;
  std::string station_trouble_ = "the station's recording is not open yet";
  StationVolume station_;
  std::vector<Part> parts_;                          // in the order of opening
  AgedMap<std::int32_t, std::int64_t> closed_{256};  // until which utime a message belongs to it
};

}  // namespace forgescan
