// A real service object on a simulated network of its own, whose time is that of a recording. All that the
// others sent is fed; what the service sends is handed out.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "services/common/bus/sim_bus.h"
#include "tools/forgescan/replay/recorded_lives.h"
#include "tools/forgescan/replay/replayable_services.h"

namespace forgescan {

class ReplayNetwork {
 public:
  using ResultHandler = std::function<void(const std::string& channel, ByteView message)>;

  // The service does not live yet. `station` outlives the network. `start_us`: of the recording.
  ReplayNetwork(const Station& station, ReplayableService service, std::int64_t start_us,
                ResultHandler on_result);
  ~ReplayNetwork();

  // Lets the time come to `utime`, then starts the service. Errors: as its Make...Service.
  Status Begin(const RecordedLife& life, std::int64_t utime);
  // From here on the service may be dead in the record: the first message that it did not come to say there
  // ends it here, with its files as they were before the input that made it say so.
  void NoteLastWord();
  // Lets the time come to `utime`, then ends the service as it ended in the record, unless it has ended. One
  // that was killed says nothing more and leaves its files as they are. Errors: kIo (its files cannot be
  // kept).
  Status End(RecordedLife::End how, std::int64_t utime);

  // False for what the service does not hear.
  bool Needs(std::string_view channel) const { return network_.IsHeard(channel) && !own_.contains(channel); }
  void RunUntil(std::int64_t utime) { network_.RunUntil(utime); }
  // Lets the time come to `utime`, then delivers a message. A stream message is numbered anew: a part's
  // recording rightly lacks other parts' messages. `lost_before`: messages of the channel that the recording
  // lost, which the service is to miss here too.
  // Errors: kInvalidArgument (no message of the bus), kIo (the service's files cannot be kept).
  Status Feed(std::int64_t utime, const std::string& channel, Bytes message, std::int64_t lost_before);
  // Ends the service if it runs on. The record does not show what it says then, so it does not count.
  void Finish();

 private:
  struct Host;
  Status Deliver(std::int64_t utime, const std::string& channel, ByteView message);
  void Remove();

  SimNetwork network_;
  SimBus& recording_;  // the node of all that is fed
  const Station& station_;
  ReplayableService service_;
  std::set<std::string, std::less<>> own_;                      // channels of the service
  std::unique_ptr<Host> host_;                                  // while the service lives
  std::map<std::string, std::int64_t, std::less<>> sequences_;  // last fed, by channel
  std::int64_t session_;
};

}  // namespace forgescan
