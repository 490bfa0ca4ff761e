// Every channel of the bus, once: name and type here, sender, receivers, rate and size in lcmtypes/README.md,
// and a test holds the two lists together.
#pragma once

#include "fsmsg/cloud_slice_t.hpp"
#include "fsmsg/cooling_state_t.hpp"
#include "fsmsg/exposure_t.hpp"
#include "fsmsg/frame_t.hpp"
#include "fsmsg/fusion_result_t.hpp"
#include "fsmsg/part_arrived_t.hpp"
#include "fsmsg/part_sorted_t.hpp"
#include "fsmsg/part_temperature_t.hpp"
#include "fsmsg/path_state_t.hpp"
#include "fsmsg/processing_time_t.hpp"
#include "fsmsg/recorded_file_t.hpp"
#include "fsmsg/recorder_state_t.hpp"
#include "fsmsg/recording_closed_t.hpp"
#include "fsmsg/recording_opened_t.hpp"
#include "fsmsg/registration_t.hpp"
#include "fsmsg/scan_complete_t.hpp"
#include "fsmsg/service_state_t.hpp"
#include "fsmsg/verdict_t.hpp"
#include "fsmsg/view_captured_t.hpp"
#include "fsmsg/view_frames_t.hpp"
#include "fsmsg/view_ready_t.hpp"
#include "fsmsg/view_result_t.hpp"
#include "services/common/bus/channel.h"

namespace forgescan {

inline constexpr Channel<fsmsg::part_arrived_t> kPartArrived{"PART_ARRIVED"};
inline constexpr Channel<fsmsg::view_ready_t> kViewReady{"VIEW_READY"};
inline constexpr Channel<fsmsg::exposure_t> kExposure{"EXPOSURE"};
inline constexpr Channel<fsmsg::view_captured_t> kViewCaptured{"VIEW_CAPTURED"};
inline constexpr Channel<fsmsg::frame_t> kFrameLeft{"FRAME_LEFT"};
inline constexpr Channel<fsmsg::frame_t> kFrameRight{"FRAME_RIGHT"};
inline constexpr Channel<fsmsg::view_frames_t> kViewFramesLeft{"VIEW_FRAMES_LEFT"};
inline constexpr Channel<fsmsg::view_frames_t> kViewFramesRight{"VIEW_FRAMES_RIGHT"};
inline constexpr Channel<fsmsg::part_temperature_t> kPartTemperature{"PART_TEMPERATURE"};
inline constexpr Channel<fsmsg::scan_complete_t> kScanComplete{"SCAN_COMPLETE"};
inline constexpr Channel<fsmsg::cloud_slice_t> kViewCloud{"VIEW_CLOUD"};
inline constexpr Channel<fsmsg::view_result_t> kViewResult{"VIEW_RESULT"};
inline constexpr Channel<fsmsg::cloud_slice_t> kFusedCloud{"FUSED_CLOUD"};
inline constexpr Channel<fsmsg::fusion_result_t> kFusionResult{"FUSION_RESULT"};
inline constexpr Channel<fsmsg::cloud_slice_t> kRegisteredCloud{"REGISTERED_CLOUD"};
inline constexpr Channel<fsmsg::registration_t> kRegistration{"REGISTRATION"};
inline constexpr Channel<fsmsg::verdict_t> kVerdict{"VERDICT"};
inline constexpr Channel<fsmsg::part_sorted_t> kPartSorted{"PART_SORTED"};

// Wall-clock durations: a stream for each sender, so that no result that replay compares contains one.
inline constexpr Channel<fsmsg::processing_time_t> kReconstructionTime{"RECONSTRUCTION_TIME"};
inline constexpr Channel<fsmsg::processing_time_t> kFusionTime{"FUSION_TIME"};
inline constexpr Channel<fsmsg::processing_time_t> kRegistrationTime{"REGISTRATION_TIME"};

inline constexpr StateChannel<fsmsg::path_state_t> kPathState{"PATH_STATE"};
inline constexpr StateChannel<fsmsg::cooling_state_t> kCoolingState{"COOLING_STATE"};
inline constexpr StateChannel<fsmsg::recorder_state_t> kRecorderState{"RECORDER_STATE"};
inline constexpr StateChannel<fsmsg::service_state_t> kServiceState{"SERVICE_STATE"};

inline constexpr LogChannel<fsmsg::recording_opened_t> kRecordingOpened{"RECORDING_OPENED"};
inline constexpr LogChannel<fsmsg::recorded_file_t> kRecordedFile{"RECORDED_FILE"};
inline constexpr LogChannel<fsmsg::recording_closed_t> kRecordingClosed{"RECORDING_CLOSED"};

}  // namespace forgescan
