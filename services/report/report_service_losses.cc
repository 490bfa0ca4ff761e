// What a message given up means for the parts in work.
#include <algorithm>

#include "services/common/bus/channels.h"
#include "services/report/report_service.h"

namespace forgescan {

void ReportService::OnLoss(bool PartInWork::*hole) {
  monitor_.Count("holes");
  for (auto& [part, open] : open_) {
    open.work.*hole = true;
  }
  CheckLossesLater();
}

void ReportService::CheckLossesLater() {
  if (loss_timer_ != 0) {
    return;  // further losses must not put the look off
  }
  loss_timer_ = hub_.bus().At(hub_.bus().NowUs() + config_.loss_settle_us(), [this] {
    loss_timer_ = 0;
    FinishWhatWaitsInVain();
  });
}

// Cloud and fusion's result are sent before the registration; a while after it they have been announced at
// least.
bool ReportService::WaitsInVain(const PartInWork& work) const {
  if (!work.registration.has_value() ||
      hub_.bus().NowUs() < work.registration_us + config_.loss_settle_us()) {
    return false;
  }
  const bool fusion_lost = work.fusion_hole && !hub_.Waiting(kFusionResult);
  const bool cloud_lost = work.cloud_hole && !hub_.Waiting(kRegisteredCloud);
  return (work.fusion.has_value() || fusion_lost) && (work.CloudSettled() || cloud_lost);
}

void ReportService::FinishWhatWaitsInVain() {
  std::vector<int> in_vain;
  bool others = false;
  for (const auto& [part, open] : open_) {
    if (WaitsInVain(open.work)) {
      in_vain.push_back(part);
    } else {
      others = others || open.work.cloud_hole || open.work.fusion_hole;
    }
  }
  std::for_each(in_vain.begin(), in_vain.end(), [this](int part) { Finish(part); });
  if (others) {
    CheckLossesLater();
  }
}

}  // namespace forgescan
