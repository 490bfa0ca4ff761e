// Decides which file a message belongs to, when a file is opened and when it is closed. Pure: events with
// their time in, actions out.
//
//   a part:  --PART_ARRIVED, or any message of a part not known--> open --sorted, quiet and settled--> closed
//            open --part_timeout_s without news--> closed, with a gap
//            open --the recorder stops--> closed, with a gap
//            open --the disk fails--> broken: nothing more is written, the file stays a .part
//            closed --the disk fails before the writer is done--> the file stays a .part, and it is said
//            too little space--> refused: the part is followed, nothing is written
//   the station: a new volume every day (UTC) and beyond a size; after a failure a new one when there is
//   space, in growing intervals
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
  // The closed file has its closing event and its name.
  void OnClosed(FileId file);
  // The file cannot be written any more, or not be closed.
  void OnFailed(FileId file, const std::string& reason, std::int64_t now_us);
  // settled_us: everything sent before this time has been received, or given up.
  Actions OnTick(std::int64_t now_us, std::int64_t settled_us);
  // Closes the open parts.
  Actions OnStop(std::int64_t now_us, std::int64_t settled_us);
  // Closes the station's volume; after OnStop(), when it is known what became of the parts' files.
  Actions OnEnd(std::int64_t now_us);

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
    std::optional<std::int64_t> sorted_utime;  // no earlier than what had come before PART_SORTED
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
    int failed_before = 0;  // volumes that could not be opened, one after the other, until this one
    std::vector<fsmsg::recording_gap_t> gaps;
    bool written() const { return writing == Writing::kOpening || writing == Writing::kOpen; }
  };

  // A file that is closed, as far as the machine is concerned; the writer may still be at it.
  struct ClosingFile {
    FileId file = 0;
    std::optional<std::int32_t> part;  // none: the station's
  };
  // What is known of a part after its file was closed.
  struct ClosedPart {
    std::optional<std::int64_t> arrived_utime;
    std::int64_t first_utime = 0;
    std::int64_t until_utime = 0;             // a message up to then is late news of it
    std::optional<std::int64_t> latest_news;  // greatest utime of late news
  };

  Part* PartOf(const RecordedMessage& message);
  bool IsLate(const RecordedMessage& message);
  bool Belongs(const Part& part, const RecordedMessage& message) const;
  Part& OpenPart(const RecordedMessage& message, Actions& actions);
  // What the files of other parts with this number may hold of the new part, and it of them.
  void NoteMixing(Part& part, const RecordedMessage& message);
  void Note(Part& part, const RecordedMessage& message) const;
  void OnClosingFailed(const ClosingFile& closing, const std::string& reason, std::int64_t now_us);
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
  std::vector<Part> parts_;  // in the order of opening
  std::vector<ClosingFile> closing_;
  std::string closing_trouble_;  // of a file that could not be closed, for a while
  std::int64_t closing_trouble_us_ = 0;
  AgedMap<std::int32_t, ClosedPart> closed_{256};  // by number
};

}  // namespace forgescan
