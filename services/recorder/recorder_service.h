// The recorder: everything said on the bus, into files that are complete or say what they lack. See
// README.md.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "services/common/bus/channel_list.h"
#include "services/common/service/service_monitor.h"
#include "services/recorder/recorder_config.h"
#include "services/recorder/recording_machine.h"
#include "services/recorder/recording_store.h"
#include "services/recorder/recording_writer.h"

namespace forgescan {

// What a recording says of the station.
struct RecordedStation {
  std::string name;
  std::string version;  // of the programs
  std::string build;    // compiler and kind of build
  std::string config_hash;
  std::vector<StationFile> files;
};

class RecorderService {
 public:
  // Hub and monitor must live as long as the service. config.folder is a path that can be opened.
  // Errors: as RecorderConfig::Check and RecordingStore::Open.
  static Result<std::unique_ptr<RecorderService>> Create(StreamHub& hub, ServiceMonitor& monitor,
                                                         const RecorderConfig& config,
                                                         RecordedStation station);
  RecorderService(const RecorderService&) = delete;
  RecorderService& operator=(const RecorderService&) = delete;
  // Writes everything received and closes the files. A part that was not finished says so.
  ~RecorderService();

  // Calls `done` as soon as no part waits for late news only, after settle_s and a little at the latest.
  void FinishThen(std::function<void()> done);
  // Returns when everything received so far is written.
  void Drain() { writer_.Drain(); }

 private:
  RecorderService(StreamHub& hub, ServiceMonitor& monitor, const RecorderConfig& config,
                  RecordedStation station, RecordingStore store);
  std::int64_t Now() const { return hub_.bus().NowUs(); }
  void Begin();
  void ReportLeftovers();
  void GiveUpWhatIsMissing();
  void Subscribe(const ChannelInfo& channel);
  void OnStream(const ChannelInfo& channel, ByteView bytes);
  void OnState(const ChannelInfo& channel, ByteView bytes);
  void OnLost(const char* channel, std::int64_t first_sequence, std::int64_t last_sequence);
  void Record(const ChannelInfo& channel, const RecordedMessage& message, ByteView bytes);
  void Append(FileId file, const ChannelInfo& channel, ByteView bytes, std::shared_ptr<const Bytes>& shared);
  struct OpenFile {
    RecordingName name;
    std::vector<const char*> unheard;  // channels whose senders had not been heard when it was opened
  };
  fsmsg::recording_opened_t OpeningEvent(const OpenRecording& open) const;
  void AddUnheard(const OpenFile& file, std::vector<fsmsg::recording_gap_t>& gaps) const;
  void Perform(const OpenRecording& open);
  void Perform(const CloseRecording& close);
  void Perform(const RecordingNote& note);
  void PerformAll(const RecordingMachine::Actions& actions);
  void Take(const WriterReport& report);
  // When everything given to the writer is done.
  void TakeAll();
  void UpdateSpace();
  void Tick();
  void SyncStation();
  std::int64_t SettledUs() const;
  void PublishState();
  void ShowState();
  // Why nothing is recorded now; empty = it is.
  std::string Trouble() const;

  StreamHub& hub_;
  ServiceMonitor& monitor_;
  RecorderConfig config_;
  RecordedStation station_;
  RecordingStore store_;
  RecordingMachine machine_;
  std::vector<ChannelInfo> channels_;
  std::map<FileId, OpenFile> files_;
  std::int64_t free_bytes_ = 0;
  bool dropping_ = false;  // the backlog was full, and is not yet half empty
  bool started_ = false;   // it has been recording before
  std::string shown_trouble_;
  bool short_of_space_ = false;
  std::int64_t pruned_us_ = 0;  // when files that may go were looked for; 0 = to be done at once
  std::int64_t synced_us_ = 0;  // when the station's file was last brought to the disk
  std::function<void()> done_;
  std::int64_t finish_until_us_ = 0;
  std::vector<Bus::TimerId> timers_;
  RecordingWriter writer_;  // last: it goes first, after everything is written
};

}  // namespace forgescan
