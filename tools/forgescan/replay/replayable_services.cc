#include "tools/forgescan/replay/replayable_services.h"

#include <algorithm>
#include <array>

#include "services/common/bus/channels.h"
#include "services/fusion/make_fusion_service.h"
#include "services/reconstruction/make_reconstruction_service.h"
#include "services/registration/make_registration_service.h"
#include "services/report/make_report_service.h"

namespace forgescan {

std::span<const ReplayableService> ReplayableServices() {
  static const std::array<ReplayableService, 4> services = {
      {{"reconstruction",
        {kViewCloud.name, kViewResult.name},
        {kReconstructionTime.name},
        MakeReconstructionService},
       {"fusion", {kFusedCloud.name, kFusionResult.name}, {kFusionTime.name}, MakeFusionService},
       {"registration",
        {kRegisteredCloud.name, kRegistration.name},
        {kRegistrationTime.name},
        MakeRegistrationService},
       {"report", {kVerdict.name}, {}, MakeReportService, true}}};
  return services;
}

Result<std::vector<ReplayableService>> SelectServices(const std::vector<std::string>& names) {
  const auto known = ReplayableServices();
  for (const std::string& name : names) {
    if (std::none_of(known.begin(), known.end(), [&](const auto& service) { return service.name == name; })) {
      return Fail(ErrorCode::kInvalidArgument,
                  "service {} cannot be replayed: reconstruction, fusion, registration and report can, the "
                  "others take their input from hardware",
                  name);
    }
  }
  std::vector<ReplayableService> chosen;
  std::copy_if(known.begin(), known.end(), std::back_inserter(chosen), [&names](const auto& service) {
    return names.empty() || std::find(names.begin(), names.end(), service.name) != names.end();
  });
  return chosen;
}

}  // namespace forgescan
