// The channels of the resend protocol itself.
#pragma once

namespace forgescan {

inline constexpr char kStreamStatusChannel[] = "STREAM_STATUS";
inline constexpr char kResendRequestChannel[] = "RESEND_REQUEST";
inline constexpr char kResendPieceChannel[] = "RESEND_PIECE";

}  // namespace forgescan
