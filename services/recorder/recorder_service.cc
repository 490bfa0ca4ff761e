#include "services/recorder/recorder_service.h"

#include <utility>

#include "services/common/bus/channels.h"
#include "services/recorder/gaps.h"
#include "services/recorder/recorded_message.h"

namespace forgescan {
namespace {

constexpr std::int64_t kTickPeriodUs = 100'000;
constexpr std::int64_t kStatePeriodUs = 500'000;
constexpr std::int64_t kPrunePeriodUs = 3'600'000'000;
constexpr std::int64_t kPruneShortUs = 60'000'000;  // the same while there is too little space
constexpr std::int64_t kSyncPeriodUs = 10'000'000;  // of the station's file
constexpr std::int64_t kLingerUs = 1'000'000;       // beyond settle_s, before the recorder stops

}  // namespace

Result<std::unique_ptr<RecorderService>> RecorderService::Create(StreamHub& hub, ServiceMonitor& monitor,
                                                                 const RecorderConfig& config,
                                                                 RecordedStation station) {
  RETURN_IF_ERROR(config.Check());
  ASSIGN_OR_RETURN(RecordingStore store, RecordingStore::Open(config.folder));
  std::unique_ptr<RecorderService> service(
      new RecorderService(hub, monitor, config, std::move(station), std::move(store)));
  service->Begin();
  return service;
}

RecorderService::RecorderService(StreamHub& hub, ServiceMonitor& monitor, const RecorderConfig& config,
                                 RecordedStation station, RecordingStore store)
    : hub_(hub),
      monitor_(monitor),
      config_(config),
      station_(std::move(station)),
      store_(std::move(store)),
      machine_(config),
      channels_(AllChannels()),
      writer_(config.backlog_bytes()) {}

RecorderService::~RecorderService() {
  for (const Bus::TimerId timer : timers_) {
    hub_.bus().Cancel(timer);
  }
  GiveUpWhatIsMissing();
  PerformAll(machine_.OnStop(Now(), SettledUs()));
  TakeAll();
  PerformAll(machine_.OnEnd(Now()));  // it says which part's file could not be closed
  TakeAll();
}

void RecorderService::TakeAll() {
  writer_.Drain();
  for (const WriterReport& report : writer_.TakeReports()) {
    Take(report);
  }
}

void RecorderService::GiveUpWhatIsMissing() {
  for (const ChannelInfo& channel : channels_) {
    const StreamStanding standing = hub_.Standing(channel.name);
    if (standing.waiting()) {
      fsmsg::recording_gap_t gap = GapOf(channel.name, "had not come when the recorder was stopped");
      gap.session = standing.session;
      gap.first_sequence = standing.next;
      gap.last_sequence = standing.announced;
      machine_.OnLost(gap);
    }
  }
}

void RecorderService::Begin() {
  ReportLeftovers();
  UpdateSpace();
  PerformAll(machine_.Start(Now()));
  for (const ChannelInfo& channel : channels_) {
    Subscribe(channel);
  }
  timers_ = {hub_.bus().Every(kTickPeriodUs, [this] { Tick(); }),
             hub_.bus().Every(kStatePeriodUs, [this] { PublishState(); })};
  ShowState();
}

// What a recorder that died has left is evidence too: it is named, and left as it is.
void RecorderService::ReportLeftovers() {
  const auto files = store_.List();
  if (!files.ok()) {
    monitor_.ReportError(files.error());
    return;
  }
  for (const StoredRecording& file : *files) {
    if (file.path.ends_with(".part")) {
      monitor_.Count("recordings_left_open");
      monitor_.ReportError(
          Fail(ErrorCode::kIo,
               "{} was left open when a recorder ended without warning: it ends there, and says "
               "nothing of what is missing",
               file.path));
    }
  }
}

void RecorderService::Subscribe(const ChannelInfo& channel) {
  if (channel.kind == ChannelKind::kStream) {
    hub_.SubscribeRaw(channel.name, [this, channel](ByteView bytes) { OnStream(channel, bytes); });
    hub_.OnLost(channel.name, [this, name = channel.name](std::int64_t first, std::int64_t last) {
      OnLost(name, first, last);
    });
  } else if (channel.kind == ChannelKind::kState) {
    hub_.bus().Subscribe(channel.name, [this, channel](ByteView bytes) { OnState(channel, bytes); });
  }
}

void RecorderService::OnStream(const ChannelInfo& channel, ByteView bytes) {
  const RecordedMessage message = ReadStreamMessage(channel, bytes, Now());
  if (message.kind == RecordedMessage::Kind::kArrived) {
    UpdateSpace();
  }
  Record(channel, message, bytes);
}

void RecorderService::OnState(const ChannelInfo& channel, ByteView bytes) {
  RecordedMessage message;
  message.kind = RecordedMessage::Kind::kState;
  message.now_us = Now();
  message.bytes = static_cast<std::int64_t>(bytes.size());
  Record(channel, message, bytes);
}

void RecorderService::OnLost(const char* channel, std::int64_t first_sequence, std::int64_t last_sequence) {
  fsmsg::recording_gap_t gap = GapOf(channel, "lost on the bus, and not sent again");
  gap.session = hub_.Standing(channel).session;
  gap.first_sequence = first_sequence;
  gap.last_sequence = last_sequence;
  monitor_.Count("gaps");
  machine_.OnLost(gap);
}

void RecorderService::Record(const ChannelInfo& channel, const RecordedMessage& message, ByteView bytes) {
  std::shared_ptr<const Bytes> shared;  // by all files it goes to
  for (const RecordingAction& action : machine_.OnMessage(message)) {
    if (const auto* append = std::get_if<AppendMessage>(&action)) {
      Append(append->file, channel, bytes, shared);
    } else {
      PerformAll({action});
    }
  }
}

void RecorderService::Append(FileId file, const ChannelInfo& channel, ByteView bytes,
                             std::shared_ptr<const Bytes>& shared) {
  if (shared == nullptr) {
    shared = std::make_shared<const Bytes>(bytes.begin(), bytes.end());
  }
  if (writer_.Write(file, channel.name, Now(), shared)) {
    monitor_.Count("messages_recorded");
  } else {
    dropping_ = true;
    monitor_.Count("messages_dropped");
    machine_.OnDropped(file, DroppedGap(channel, bytes));
    ShowState();
  }
  if (channel.name == std::string_view(kViewCaptured.name)) {
    writer_.Sync(file);
  }
}

void RecorderService::PerformAll(const RecordingMachine::Actions& actions) {
  for (const RecordingAction& action : actions) {
    if (const auto* open = std::get_if<OpenRecording>(&action)) {
      Perform(*open);
    } else if (const auto* close = std::get_if<CloseRecording>(&action)) {
      Perform(*close);
    } else if (const auto* note = std::get_if<RecordingNote>(&action)) {
      Perform(*note);
    }
  }
}

void RecorderService::Perform(const RecordingNote& note) {
  monitor_.Count(note.what == RecordingNote::What::kLate ? "messages_late" : "messages_not_recorded");
  if (!note.text.empty()) {
    monitor_.Count("parts_not_recorded");
    monitor_.ReportError(Fail(ErrorCode::kUnavailable, "{}", note.text));
  }
}

void RecorderService::UpdateSpace() {
  const auto free = store_.FreeBytes();
  free_bytes_ = free.ok() ? *free : 0;
  short_of_space_ = free_bytes_ < config_.min_free_bytes();
  const std::int64_t left_bytes = free_bytes_ - writer_.backlog_bytes();
  if (!free.ok()) {
    machine_.SetSpace(free.error().message);
  } else if (left_bytes < config_.min_free_bytes()) {
    machine_.SetSpace(fmt::format("{} MB are free in {}, {} MB are needed", left_bytes / 1'000'000,
                                  store_.folder(), config_.min_free_mb));
  } else {
    machine_.SetSpace("");
  }
}

// Nothing on the bus says when, as VIEW_CAPTURED does for a part.
void RecorderService::SyncStation() {
  if (Now() - synced_us_ < kSyncPeriodUs) {
    return;
  }
  synced_us_ = Now();
  for (const auto& [file, open] : files_) {
    if (!open.name.part.has_value()) {
      writer_.Sync(file);
    }
  }
}

void RecorderService::FinishThen(std::function<void()> done) {
  done_ = std::move(done);
  finish_until_us_ = Now() + static_cast<std::int64_t>(config_.settle_s * 1e6) + kLingerUs;
}

void RecorderService::Tick() {
  for (const WriterReport& report : writer_.TakeReports()) {
    Take(report);
  }
  UpdateSpace();
  dropping_ = dropping_ && writer_.backlog_bytes() > config_.backlog_bytes() / 2;
  PerformAll(machine_.OnTick(Now(), SettledUs()));
  if (Now() - pruned_us_ >= (short_of_space_ ? kPruneShortUs : kPrunePeriodUs)) {
    pruned_us_ = Now();
    writer_.Prune(store_, config_.retention(), Now());
  }
  SyncStation();
  ShowState();
  if (done_ != nullptr && (!machine_.finishing() || Now() >= finish_until_us_)) {
    std::exchange(done_, nullptr)();
  }
}

}  // namespace forgescan
