// Which processes a station consists of, in the order they are started.
#pragma once

#include <string>
#include <vector>

#include "services/common/service/station.h"

namespace forgescan {

// Stages are started one after the other, consumers before producers, and stopped the other way round: who
// makes parts first, who computes once the parts in work have their verdict, who records last.
enum StationStage : int { kRecording, kComputing, kSensing, kMoving };

struct StationService {
  std::string name;                    // as in its SERVICE_STATE
  std::string program;                 // beside the forgescan tool
  std::vector<std::string> arguments;  // before --station FOLDER
  StationStage stage = kRecording;
};

// Stages ascend. The station's own services come between the recorder and the others: they hear whatever
// these say, the last verdict included.
inline std::vector<StationService> StationServices(const Station& station) {
  std::vector<StationService> services{{"recorder", "forgescan-recorder", {}, kRecording}};
  for (const std::string& name : station.more_services) {
    services.push_back({name, "forgescan-" + name, {}, kComputing});
  }
  const std::vector<StationService> others{{"report", "forgescan-report", {}, kComputing},
                                           {"registration", "forgescan-registration", {}, kComputing},
                                           {"fusion", "forgescan-fusion", {}, kComputing},
                                           {"reconstruction", "forgescan-reconstruction", {}, kComputing},
                                           {"camera_left", "forgescan-camera", {"left"}, kSensing},
                                           {"camera_right", "forgescan-camera", {"right"}, kSensing},
                                           {"cooling", "forgescan-cooling", {}, kSensing},
                                           {"trigger", "forgescan-trigger", {}, kMoving},
                                           {"robot", "forgescan-robot", {}, kMoving}};
  services.insert(services.end(), others.begin(), others.end());
  return services;
}

}  // namespace forgescan
