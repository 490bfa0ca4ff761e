// LCM logs, recordings and the language they are written in.
#include "services/common/input_file.h"
#include "services/common/log/lcm_decode.h"
#include "services/common/log/log_reader.h"
#include "services/common/log/message_definitions.h"
#include "tests/fuzz/readers.h"
#include "tests/fuzz/small_recording.h"
#include "tools/forgescan/log/log_check.h"
#include "tools/forgescan/log/log_info.h"
#include "tools/forgescan/log/recording.h"
#include "tools/forgescan/replay/recorded_session.h"
#include "tools/forgescan/replay/what_if.h"

namespace forgescan::fuzz {
namespace {

std::string LogProblem(const LogReader& log) {
  std::uint64_t covered = 0;
  for (const LogEntry& entry : log.entries()) {
    const auto message = log.Read(entry);
    if (!message.ok() || message->size() != entry.bytes) return "an event that cannot be read";
    covered += log.EndOf(entry) - entry.offset;
  }
  for (const LogDamage& damage : log.damage()) covered += damage.bytes;
  return covered == log.file_bytes() ? "" : "bytes that are neither event nor damage";
}

Outcome ReadLog(const std::string& bytes) {
  return Judge(LogReader::Open(ScratchFile("a.lcmlog", bytes)), "a.lcmlog", LogProblem);
}

Outcome ReadRecording(const std::string& bytes) {
  const auto recording = OpenRecording(ScratchFile("a.lcmlog", bytes));
  if (!recording.ok()) return {false, SentenceProblem(recording.error(), "a.lcmlog")};
  const auto info = LogInfo(*recording);
  if (info.ok() && LogInfoText(*info).empty()) return {true, "a recording of which nothing can be said"};
  return Judge(CheckLog(*recording), "a.lcmlog");
}

Outcome ReadSession(const std::string& bytes) {
  const auto session = RecordedSession::Open({ScratchFile("a.lcmlog", bytes)});
  if (!session.ok()) return {false, SentenceProblem(session.error(), "a.lcmlog")};
  std::int64_t before = 0;
  for (const RecordedEvent& event : session->events()) {
    if (event.utime < before) return {true, "events that go back in time"};
    before = event.utime;
  }
  return Judge(RecordedVerdicts(*session), "");
}

Outcome ReadTypes(const std::string& bytes) { return Judge(LcmTypes::Parse(bytes), ""); }

}  // namespace

std::vector<Reader> Readers() {
  const std::string recording = SmallRecording(ScratchFolder() / "written.lcmlog");
  return {{"log", 1500, {recording}, ReadLog},
          {"recording", 300, {recording}, ReadRecording},
          {"session", 300, {recording}, ReadSession},
          {"lcm_types", 1000, {AllMessageDefinitions(), RepositoryFile("lcmtypes/frame_t.lcm")}, ReadTypes}};
}

}  // namespace forgescan::fuzz
