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
#include "tools/forgescan/replay/replayable_services.h"

namespace forgescan {

class ReplayNetwork {
 public:
  using ResultHandler = std::function<void(const std::string& channel, ByteView message)>;

  // `station` outlives the network. `start_us`: of the recording. Errors: as the services' Make...Service.
  static Result<std::unique_ptr<ReplayNetwork>> Create(const Station& station,
                                                       std::vector<ReplayableService> services,
                                                       std::int64_t start_us, ResultHandler on_result);
  ~ReplayNetwork();

  // False for what none of the services hears, or what one of them sends here itself.
  bool Needs(std::string_view channel) const;
  // Lets the time come to `utime`, then delivers a recorded message. A stream message is numbered anew: a
  // part's recording rightly lacks other parts' messages. `lost_before`: messages of the channel that the
  // recording lost, which the services are to miss here too.
  // A SERVICE_STATE that shows that one of the services was started anew starts it anew here.
  // Errors: kInvalidArgument (no message of the bus), and those of starting a service.
  Status Feed(std::int64_t utime, const std::string& channel, Bytes message, std::int64_t lost_before);
  // Ends the services. What a service says while it ends counts only if the record shows that it was stopped.
  void Finish();

 private:
  struct Host;
  ReplayNetwork(const Station& station, std::int64_t start_us, ResultHandler on_result);
  Status Start(const ReplayableService& service);
  void Stop(const std::string& name);
  // What one of the services said of itself in the record.
  Status OnRecordedState(const fsmsg::service_state_t& state);

  SimNetwork network_;
  SimBus& recording_;  // the node of all that is fed
  const Station& station_;
  ResultHandler on_result_;
  bool muted_ = false;  // while a service ends that was killed, or ran on, in the record
  std::vector<ReplayableService> services_;
  std::set<std::string, std::less<>> own_channels_;
  std::map<std::string, std::unique_ptr<Host>, std::less<>> hosts_;
  std::map<std::string, std::int64_t, std::less<>> sequences_;  // last fed, by channel
  std::int64_t session_;
};

}  // namespace forgescan
