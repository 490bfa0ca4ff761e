#include "services/common/bus/channel_list.h"

#include <algorithm>

#include "services/common/bus/channels.h"

namespace forgescan {
namespace {

template <typename Message>
ChannelInfo Info(const Channel<Message>& channel) {
  return {channel.name, Message::getTypeName(), Message::getHash(), ChannelKind::kStream};
}

template <typename Message>
ChannelInfo Info(const StateChannel<Message>& channel) {
  return {channel.name, Message::getTypeName(), Message::getHash(), ChannelKind::kState};
}

template <typename Message>
ChannelInfo Info(const LogChannel<Message>& channel) {
  return {channel.name, Message::getTypeName(), Message::getHash(), ChannelKind::kLog};
}

}  // namespace

std::vector<ChannelInfo> AllChannels() {
  return {Info(kPartArrived),      Info(kViewReady),       Info(kExposure),           Info(kViewCaptured),
          Info(kFrameLeft),        Info(kFrameRight),      Info(kViewFramesLeft),     Info(kViewFramesRight),
          Info(kPartTemperature),  Info(kScanComplete),    Info(kViewCloud),          Info(kViewResult),
          Info(kFusedCloud),       Info(kFusionResult),    Info(kRegisteredCloud),    Info(kRegistration),
          Info(kVerdict),          Info(kPartSorted),      Info(kReconstructionTime), Info(kFusionTime),
          Info(kRegistrationTime), Info(kPathState),       Info(kCoolingState),       Info(kRecorderState),
          Info(kServiceState),     Info(kRecordingOpened), Info(kRecordedFile),       Info(kRecordingClosed)};
}

bool IsStateChannel(std::string_view channel) {
  static const std::vector<ChannelInfo> channels = AllChannels();
  return std::any_of(channels.begin(), channels.end(), [channel](const ChannelInfo& info) {
    return info.kind == ChannelKind::kState && channel == info.name;
  });
}

}  // namespace forgescan
