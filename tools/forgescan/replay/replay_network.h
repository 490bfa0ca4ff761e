// Real service objects on a simulated network whose time is that of a recording. All that the others sent is
// fed from the recording; what the services send is handed out.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "services/common/bus/sim_bus.h"
#include "tools/forgescan/replay/recorded_lives.h"
#include "tools/forgescan/replay/replayable_services.h"

namespace forgescan {

class ReplayNetwork {
 public:
  using ResultHandler = std::function<void(const std::string& channel, ByteView message)>;

  // None of the services lives yet. `station` outlives the network. `start_us`: of the recording.
  ReplayNetwork(const Station& station, std::vector<ReplayableService> services, std::int64_t start_us,
                ResultHandler on_result);
  ~ReplayNetwork();

  // Lets the time come to `utime`, then starts the service. Errors: as the services' Make...Service.
  Status Begin(const std::string& service, const RecordedLife& life, std::int64_t utime);
  // From here on the service may be dead in the record: the first message that it did not come to say there
  // ends it here, with its files as they were before the input that made it say so.
  void NoteLastWord(const std::string& service);
  // Lets the time come to `utime`, then ends the service as it ended in the record, unless it has ended. One
  // that was killed says nothing more and leaves its files as they are. Errors: kIo (its files cannot be
  // kept).
  Status End(const std::string& service, RecordedLife::End how, std::int64_t utime);

  // False for what none of the services hears, or what one of them sends here itself.
  bool Needs(std::string_view channel) const;
  // Lets the time come to `utime`, then delivers a recorded message. A stream message is numbered anew: a
  // part's recording rightly lacks other parts' messages. `lost_before`: messages of the channel that the
  // recording lost, which the services are to miss here too.
  // Errors: kInvalidArgument (no message of the bus), kIo (a service's files cannot be kept).
  Status Feed(std::int64_t utime, const std::string& channel, Bytes message, std::int64_t lost_before);
  // Ends the services that run on. The record does not show what they say then, so it does not count.
  void Finish();

 private:
  struct Host;
  const ReplayableService& Known(const std::string& name) const;
  Status Deliver(std::int64_t utime, const std::string& channel, ByteView message);
  // The service whose files may have to be put back; nothing if there is none.
  Host* DyingWithFiles();
  void Remove(const std::string& name);

  SimNetwork network_;
  SimBus& recording_;  // the node of all that is fed
  const Station& station_;
  ResultHandler on_result_;
  std::vector<ReplayableService> services_;
  std::set<std::string, std::less<>> own_channels_;
  std::map<std::string, std::unique_ptr<Host>, std::less<>> hosts_;  // of those that live, by service
  std::map<std::string, std::int64_t, std::less<>> sequences_;       // last fed, by channel
  std::int64_t session_;
};

}  // namespace forgescan
