// Which processes a station consists of, in the order they are started.
#pragma once

#include <string>
#include <vector>

namespace forgescan {

struct StationService {
  std::string name;                    // as in its SERVICE_STATE
  std::string program;                 // beside the forgescan tool
  std::vector<std::string> arguments;  // before --station FOLDER
};

// Consumers before producers, so that nothing is sent to nobody; the recorder before all, so that it hears
// every word, and after all when they stop.
inline std::vector<StationService> StationServices() {
  return {{"recorder", "forgescan-recorder", {}},
          {"report", "forgescan-report", {}},
          {"registration", "forgescan-registration", {}},
          {"fusion", "forgescan-fusion", {}},
          {"reconstruction", "forgescan-reconstruction", {}},
          {"camera_left", "forgescan-camera", {"left"}},
          {"camera_right", "forgescan-camera", {"right"}},
          {"cooling", "forgescan-cooling", {}},
          {"trigger", "forgescan-trigger", {}},
          {"robot", "forgescan-robot", {}}};
}

}  // namespace forgescan
